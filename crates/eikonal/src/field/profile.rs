//! Fields that vary with one coordinate alone: along an axis, with the distance from an axis, or
//! from a point (docs/theory.md#formulas).

use super::analytic::{Mixed, add_mixed, dot};
use super::error::FieldError;
use super::formula::{Coordinate, Formula, Free, Function, Interval, Number, Program, Series};
use super::length_cells::LengthCells;
use super::spline::{Spline, Start};
use super::steepness::{Steepness, length_at};
use super::{IndexDerivative, Jet, outer, radial};
use crate::bounds::{Aabb, FieldBounds};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Maximum number of pieces of a range that are bounded separately; fewer if the formula is long.
const MAX_PIECES: usize = 16;
/// Maximum number of operations in all pieces together, spent on bounds.
const MAX_BOUND_OPERATIONS: usize = 512;
/// Field with n² as a function f(u) of one coordinate u.
#[derive(Clone, Debug)]
pub struct IndexProfile {
    curve: Arc<Curve>,
    coordinate: Coordinate,
    /// True if f′(0) is zero, so that a function of a distance is smooth where the distance is
    /// zero.
    is_even: bool,
    /// Program with the parameters as inputs.
    free: Option<Arc<Free>>,
    /// Length scales, with the coordinate as x.
    lengths: Arc<LengthCells>,
}

/// Function n² of one variable.
#[derive(Debug)]
enum Curve {
    Formula(Program),
    /// Samples of n, at u less `shift`.
    Table {
        spline: Spline,
        shift: f64,
    },
}

impl Curve {
    /// Returns the Taylor coefficients at a place.
    #[inline]
    fn at<const K: usize>(&self, u: f64) -> [f64; K] {
        match self {
            Curve::Formula(program) => program.run([Series::variable(u)]).0,
            Curve::Table { spline, shift } => spline.at::<K>(u - shift).square().0,
        }
    }

    /// Returns a range of the Taylor coefficients over an interval.
    fn over<const K: usize>(&self, u: Interval) -> [Interval; K] {
        match self {
            Curve::Formula(program) => program.run([Series::variable(u)]).0,
            Curve::Table { spline, shift } => {
                let shifted = Interval::new(u.low - shift, u.high - shift);
                spline.over::<K>(shifted).square().0
            }
        }
    }

    /// Returns the number of operations of an evaluation.
    fn operations(&self) -> usize {
        match self {
            Curve::Formula(program) => program.len().max(1),
            Curve::Table { .. } => 1,
        }
    }

    /// Returns the largest fourth derivative over an interval.
    fn fourth(&self, u: Interval) -> f64 {
        match self {
            Curve::Formula(_) => 24.0 * self.over::<5>(u)[4].magnitude(),
            Curve::Table { spline, shift } => {
                let shifted = Interval::new(u.low - shift, u.high - shift);
                let n = spline.over::<1>(shifted).0[0].magnitude();
                24.0 * self.over::<5>(u)[4].magnitude() + 2.0 * n * spline.fourth(shifted)
            }
        }
    }
}

/// Ranges of n² and of its derivatives by the coordinate: the first, the second, and the first over
/// the distance.
struct Ranges {
    n2: Interval,
    slope: Interval,
    bend: Interval,
    across: Interval,
}

impl IndexProfile {
    pub(super) fn of_formula(formula: Formula, coordinate: Coordinate) -> Self {
        IndexProfile {
            free: formula.free.map(Arc::new),
            ..IndexProfile::new(Curve::Formula(formula.program), coordinate)
        }
    }

    /// Creates the profile through samples: pairs of the coordinate less `shift`, ascending, and
    /// the index n > 0 there. The profile is a cubic spline. If the samples begin on the axis or in
    /// the centre, it is smooth there; beyond the samples it continues as a parabola.
    ///
    /// # Errors
    ///
    /// Too few samples, places that do not ascend, or indices that are not positive.
    pub fn table(
        coordinate: Coordinate,
        shift: f64,
        samples: &[[f64; 2]],
    ) -> Result<Self, FieldError> {
        let first = samples.first().map(|s| s[0] + shift);
        let even = is_distance(coordinate) && first == Some(0.0);
        let start = if even { Start::Even } else { Start::Free };
        let spline = Spline::new(samples, start)?;
        let shift = super::error::finite("shift of a table", shift)?;
        Ok(IndexProfile::new(
            Curve::Table { spline, shift },
            coordinate,
        ))
    }

    fn new(curve: Curve, coordinate: Coordinate) -> Self {
        let [_, slope] = curve.at::<2>(0.0);
        IndexProfile {
            curve: Arc::new(curve),
            coordinate,
            is_even: slope == 0.0,
            free: None,
            lengths: Arc::new(LengthCells::new()),
        }
    }

    /// Returns the program with the parameters as inputs.
    pub(super) fn free(&self) -> Option<&Free> {
        self.free.as_deref()
    }

    /// Returns the indices of the table.
    pub(super) fn table_values(&self) -> Option<Vec<f64>> {
        match &*self.curve {
            Curve::Formula(_) => None,
            Curve::Table { spline, .. } => Some(spline.values().collect()),
        }
    }

    /// Returns the number of sums of derivatives: with respect to the parameters of the formula, or
    /// to the coefficients of the table's cubics.
    pub(super) fn parameter_count(&self) -> usize {
        match &*self.curve {
            Curve::Formula(_) => self.free.as_ref().map_or(0, |free| free.values().len()),
            Curve::Table { spline, .. } => spline.coefficient_count(),
        }
    }

    /// Converts derivatives with respect to coefficients to derivatives with respect to the indices
    /// of a table.
    pub(super) fn value_derivative(&self, by: Vec<f64>) -> Vec<f64> {
        match &*self.curve {
            Curve::Formula(_) => by,
            Curve::Table { spline, .. } => spline.value_derivative(&by),
        }
    }

    /// Converts changes of the indices of a table to changes of coefficients.
    pub(super) fn coefficient_change(&self, change: &[f64]) -> Vec<f64> {
        match &*self.curve {
            Curve::Formula(_) => change.to_vec(),
            Curve::Table { spline, .. } => spline.coefficient_change(change),
        }
    }

    /// Adds derivatives with respect to the parameters of the formula, or to the coefficients of
    /// the table's cubics.
    pub(super) fn add_parameter_derivative(&self, x: DVec3, by: IndexDerivative, into: &mut [f64]) {
        match (&*self.curve, &self.free) {
            (Curve::Formula(_), Some(free)) => {
                let squared = |x: [Mixed; 3], p: &[Mixed]| free.run(&[self.mixed(x)], p);
                add_mixed(free.values(), x, by, squared, into);
            }
            (Curve::Formula(_), None) => {}
            (Curve::Table { spline, shift }, _) => {
                let (u, d) = self.coordinate(x);
                let per = if is_distance(self.coordinate) && u > 0.0 {
                    1.0 / u
                } else {
                    1.0
                };
                let along = by.gradient.dot(d) * per;
                let [n, slope] = spline.at::<2>(u - shift).0;
                // Convert to derivatives with respect to n and its slope: n² and its slope change
                // by 2n δn and 2n′δn + 2n δn′.
                let value = 2.0 * (by.n2 * n + along * slope);
                spline.add_coefficient_derivative(u - shift, [value, 2.0 * along * n], into);
            }
        }
    }

    /// Returns the coordinate of a point that carries derivatives.
    fn mixed(&self, [x, y, z]: [Mixed; 3]) -> Mixed {
        match self.coordinate {
            Coordinate::X => x,
            Coordinate::Y => y,
            Coordinate::Z => z,
            Coordinate::R => dot(&[x, y, z], &[x, y, z]).apply(Function::Sqrt),
            Coordinate::Rho => dot(&[x, y], &[x, y]).apply(Function::Sqrt),
        }
    }

    /// Returns the coordinate of a point, and a vector: of this length for a distance, otherwise
    /// the unit vector along the coordinate.
    #[inline]
    fn coordinate(&self, x: DVec3) -> (f64, DVec3) {
        match self.coordinate {
            Coordinate::X => (x.x, DVec3::X),
            Coordinate::Y => (x.y, DVec3::Y),
            Coordinate::Z => (x.z, DVec3::Z),
            Coordinate::R => (x.length(), x),
            Coordinate::Rho => {
                let d = DVec3::new(x.x, x.y, 0.0);
                (d.length(), d)
            }
        }
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        let [n2] = self.curve.at(self.coordinate(x).0);
        n2
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (u, d) = self.coordinate(x);
        let [n2, slope] = self.curve.at(u);
        if !is_distance(self.coordinate) {
            (n2, d * slope)
        } else if u > 0.0 {
            (n2, d * (slope / u))
        } else {
            (n2, DVec3::ZERO)
        }
    }

    /// Returns the jet. For a distance with the unit vector d̂, the Hessian is f″ d̂⊗d̂ + f′/u (P −
    /// d̂⊗d̂). P is the projection on the directions in which the distance varies.
    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let (u, d) = self.coordinate(x);
        let [n2, slope, half] = self.curve.at(u);
        let bend = 2.0 * half;
        if !is_distance(self.coordinate) {
            let (grad, hess) = (d * slope, outer(d) * bend);
            return Jet { n2, grad, hess };
        }
        let (unit, across) = if u > 0.0 {
            (d / u, slope / u)
        } else {
            (DVec3::ZERO, bend)
        };
        let flat = if self.coordinate == Coordinate::R {
            1.0
        } else {
            0.0
        };
        let projection = DMat3::from_diagonal(DVec3::new(1.0, 1.0, flat));
        Jet {
            n2,
            grad: unit * slope,
            hess: projection * across + outer(unit) * (bend - across),
        }
    }

    /// Returns the range of the coordinate over a box.
    fn range(&self, region: &Aabb) -> Interval {
        let [low, high] = match self.coordinate {
            Coordinate::X => [region.min.x, region.max.x],
            Coordinate::Y => [region.min.y, region.max.y],
            Coordinate::Z => [region.min.z, region.max.z],
            Coordinate::R => radial::distance_range(DVec3::ZERO, region),
            Coordinate::Rho => {
                let flat = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
                let region = Aabb::new(flat(region.min), flat(region.max));
                radial::distance_range(DVec3::ZERO, &region)
            }
        };
        Interval::new(low, high)
    }

    /// Returns the ranges over a range of the coordinate. The mean value theorem about the middle
    /// also bounds slopes and values. If f is even, f′/u is a mean of f″ over smaller coordinates.
    fn ranges(&self, u: Interval) -> Ranges {
        let [n2, slope, half] = self.curve.over(u);
        let bend = half + half;
        let mut ranges = Ranges {
            n2,
            slope,
            bend,
            across: Interval::ALL,
        };
        let middle = 0.5 * (u.low + u.high);
        if middle.is_finite() {
            let at = Interval::new(middle, middle);
            let offset = u - at;
            let [n2, slope, _] = self.curve.over::<3>(at);
            ranges.slope = ranges.slope.intersection(slope + bend * offset);
            ranges.n2 = ranges.n2.intersection(n2 + ranges.slope * offset);
        }
        if is_distance(self.coordinate) {
            if u.low > 0.0 {
                ranges.across = ranges.slope / u;
            }
            // Skip this far from the centre: it does not improve the bound, and a table would be
            // searched from the centre.
            let is_near = matches!(*self.curve, Curve::Formula(_)) || u.low < 0.5 * u.high;
            if self.is_even && is_near {
                let [_, _, half] = self.curve.over(Interval::new(0.0, u.high));
                ranges.across = ranges.across.intersection(half + half);
            }
        }
        ranges
    }

    /// Returns a range of the eigenvalues of the Hessian.
    fn eigenvalues(&self, ranges: &Ranges) -> Interval {
        let zero = Interval::new(0.0, 0.0);
        match self.coordinate {
            Coordinate::R => ranges.bend.union(ranges.across),
            Coordinate::Rho => ranges.bend.union(ranges.across).union(zero),
            _ => ranges.bend.union(zero),
        }
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let whole = self.range(region);
        let affordable = MAX_BOUND_OPERATIONS / self.curve.operations();
        let extent = whole.high - whole.low;
        let pieces = if extent > 0.0 && extent.is_finite() {
            affordable.clamp(1, MAX_PIECES)
        } else {
            1
        };
        let width = extent / pieces as f64;
        let end = |i: usize| match i {
            0 => whole.low,
            i if i == pieces => whole.high,
            i => whole.low + width * i as f64,
        };
        let bounds = |i: usize| {
            let ranges = self.ranges(Interval::new(end(i), end(i + 1)));
            let eigenvalues = self.eigenvalues(&ranges);
            FieldBounds {
                n2_min: ranges.n2.low,
                n2_max: ranges.n2.high,
                grad_max: ranges.slope.magnitude(),
                hess_min: eigenvalues.low,
                hess_max: eigenvalues.high,
            }
        };
        (1..pieces).map(bounds).fold(bounds(0), FieldBounds::union)
    }

    fn steepness(&self, u: Interval) -> Steepness {
        let ranges = self.ranges(u);
        Steepness {
            first: ranges.slope.magnitude(),
            second: self.eigenvalues(&ranges).magnitude(),
            fourth: self.curve.fourth(u),
        }
    }

    /// Returns a range grown by a radius; distances do not become negative.
    fn grown(&self, u: Interval, radius: f64) -> Interval {
        let least = if is_distance(self.coordinate) {
            0.0
        } else {
            f64::NEG_INFINITY
        };
        Interval::new((u.low - radius).max(least), u.high + radius)
    }

    /// Returns the length scale of the coordinate.
    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        let (u, _) = self.coordinate(x);
        self.lengths.at(DVec3::new(u, 0.0, 0.0), |at| {
            let [n2] = self.curve.at(at.x);
            let place = Interval::new(at.x, at.x);
            let around = |radius: f64| self.steepness(self.grown(place, radius));
            length_at(n2, at.x.abs(), around)
        })
    }

    pub(super) fn memory(&self) -> usize {
        let samples = match &*self.curve {
            Curve::Formula(_) => 0,
            Curve::Table { spline, .. } => spline.memory(),
        };
        samples + self.lengths.memory()
    }

    pub(super) fn is_constant(&self) -> bool {
        false
    }
}

/// Returns true if a coordinate is a distance, hence not negative.
fn is_distance(coordinate: Coordinate) -> bool {
    matches!(coordinate, Coordinate::R | Coordinate::Rho)
}
