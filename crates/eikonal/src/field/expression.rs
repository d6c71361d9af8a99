//! Fields with a formula in three coordinates (docs/theory.md#formulas).

use super::analytic::add_mixed;
use super::formula::{
    Formula, Free, GRADIENT, HESSIAN, Interval, Program, Real, Series, Spatial, VALUE,
};
use super::length_cells::LengthCells;
use super::steepness::{Steepness, length_at};
use super::{IndexDerivative, Jet};
use crate::bounds::{Aabb, FieldBounds, interval_eigenvalues};
use glam::{DMat3, DVec3};
use std::array::from_fn;
use std::sync::Arc;

/// Field with a program for n².
#[derive(Clone, Debug)]
pub struct Expression {
    program: Arc<Program>,
    /// Program with the parameters as inputs.
    free: Option<Arc<Free>>,
    lengths: Arc<LengthCells>,
}

impl Expression {
    pub(super) fn new(formula: Formula) -> Self {
        Expression {
            program: Arc::new(formula.program),
            free: formula.free.map(Arc::new),
            lengths: Arc::new(LengthCells::new()),
        }
    }

    /// Returns the program with the parameters as inputs.
    pub(super) fn free(&self) -> Option<&Free> {
        self.free.as_deref()
    }

    /// Adds derivatives with respect to the parameters of the formula.
    pub(super) fn add_parameter_derivative(&self, x: DVec3, by: IndexDerivative, into: &mut [f64]) {
        if let Some(free) = &self.free {
            let squared = |x: [_; 3], p: &[_]| free.run(&x, p);
            add_mixed(free.values(), x, by, squared, into);
        }
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        let [n2] = self.program.run(point::<VALUE>(x)).0;
        n2
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let [n2, gx, gy, gz] = self.program.run(point::<GRADIENT>(x)).0;
        (n2, DVec3::new(gx, gy, gz))
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let found = self.program.run(point::<HESSIAN>(x)).0;
        Jet {
            n2: found[0],
            grad: DVec3::new(found[1], found[2], found[3]),
            hess: symmetric(&found),
        }
    }

    /// Encloses values and derivatives over a box by intervals, which grow with the box.
    fn natural(&self, region: &Aabb) -> [Interval; HESSIAN] {
        let inputs: [_; 3] = from_fn(|i| Spatial::coordinate(i, range(region, i)));
        self.program.run(inputs).0
    }

    /// Encloses values and derivatives over a box, by intervals and by the mean value theorem about
    /// the middle, which is better in small boxes.
    fn over(&self, region: &Aabb) -> [Interval; HESSIAN] {
        let mut found = self.natural(region);
        let middle = region.center();
        if middle.is_finite() {
            let center = self.natural(&Aabb::new(middle, middle));
            let offset = [0, 1, 2].map(|i| range(region, i) - Interval::of(middle[i]));
            let mean = |at: Interval, slopes: [Interval; 3]| {
                (0..3).fold(at, |sum, i| sum + slopes[i] * offset[i])
            };
            for i in 0..3 {
                let row = ROWS[i].map(|at| found[at]);
                found[1 + i] = found[1 + i].intersection(mean(center[1 + i], row));
            }
            let slopes = [found[1], found[2], found[3]];
            found[0] = found[0].intersection(mean(center[0], slopes));
        }
        found
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let found = self.over(region);
        let [hess_min, hess_max] = eigenvalues(&found);
        FieldBounds {
            n2_min: found[0].low,
            n2_max: found[0].high,
            grad_max: gradient(&found),
            hess_min,
            hess_max,
        }
    }

    /// Bounds derivatives over a box.
    fn steepness(&self, region: &Aabb) -> Steepness {
        let found = self.natural(region);
        let squares = (4..HESSIAN).map(|i| {
            let twice = if i < 7 { 1.0 } else { 2.0 };
            twice * found[i].magnitude().powi(2)
        });
        let along = |axis: usize| {
            let inputs: [_; 3] = from_fn(|i| {
                if i == axis {
                    Series::<_, 5>::variable(range(region, i))
                } else {
                    Series::fixed(range(region, i))
                }
            });
            24.0 * self.program.run(inputs).0[4].magnitude()
        };
        Steepness {
            first: gradient(&found),
            // Use the Frobenius norm: unlike bounds of eigenvalues it cannot fall as the box grows.
            second: squares.sum::<f64>().sqrt(),
            fourth: (0..3).map(along).fold(0.0, f64::max),
        }
    }

    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        self.lengths.at(x, |x| {
            let around = |radius: f64| self.steepness(&Aabb::new(x, x).grown(radius));
            length_at(self.n2(x), x.length(), around)
        })
    }

    pub(super) fn memory(&self) -> usize {
        self.lengths.memory()
    }

    pub(super) fn is_constant(&self) -> bool {
        false
    }
}

/// Indices of the entries of the Hessian, in rows.
const ROWS: [[usize; 3]; 3] = [[4, 7, 9], [7, 5, 8], [9, 8, 6]];

/// Returns the range of a coordinate in a box.
fn range(region: &Aabb, axis: usize) -> Interval {
    Interval::new(region.min[axis], region.max[axis])
}

/// Converts a point to inputs of a program.
#[inline(always)]
fn point<const N: usize>(x: DVec3) -> [Spatial<f64, N>; 3] {
    from_fn(|i| Spatial::coordinate(i, x[i]))
}

fn symmetric(found: &[f64; HESSIAN]) -> DMat3 {
    let column = |row: [usize; 3]| DVec3::from_array(row.map(|at| found[at]));
    let [a, b, c] = ROWS.map(column);
    DMat3::from_cols(a, b, c)
}

fn gradient(found: &[Interval; HESSIAN]) -> f64 {
    let largest = |i: usize| found[i].magnitude();
    DVec3::new(largest(1), largest(2), largest(3)).length()
}

/// Returns a range of the eigenvalues of the Hessian.
fn eigenvalues(found: &[Interval; HESSIAN]) -> [f64; 2] {
    let [low, high] = [found.map(|i| i.low), found.map(|i| i.high)].map(|ends| symmetric(&ends));
    if low.is_finite() && high.is_finite() {
        interval_eigenvalues(low, high)
    } else {
        [f64::NEG_INFINITY, f64::INFINITY]
    }
}
