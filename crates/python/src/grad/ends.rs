//! Starts and ends of rays, and losses of the ends.

use super::course::Course;
use eikonal::Aabb;
use eikonal::adjoint::{EndDerivative, RayEnd, RayStart};
use glam::DVec3;
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// Starts of all rays: Python arrays, which are not copied.
#[derive(Clone, Copy)]
pub(super) struct Starts<'a> {
    origins: ArrayView2<'a, f64>,
    directions: ArrayView2<'a, f64>,
    /// Box of the field.
    region: Aabb,
    /// True for a box, false for a sequence, which rays meet from its front.
    is_boxed: bool,
}

/// Returns a row of three numbers.
pub(super) fn row(of: &ArrayView2<f64>, i: usize) -> DVec3 {
    DVec3::new(of[[i, 0]], of[[i, 1]], of[[i, 2]])
}

impl<'a> Starts<'a> {
    pub(super) fn new(
        origins: &'a PyReadonlyArray2<f64>,
        directions: &'a PyReadonlyArray2<f64>,
        course: &Course,
    ) -> Self {
        Starts {
            origins: origins.as_array(),
            directions: directions.as_array(),
            region: course.region,
            is_boxed: course.is_boxed(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.origins.nrows()
    }

    /// Returns the start of a ray, and the length of its direction as given.
    pub(super) fn get(&self, i: usize) -> (RayStart<usize>, f64) {
        let (x, given) = (row(&self.origins, i), row(&self.directions, i));
        let length = given.length();
        let start = RayStart {
            x,
            direction: given / length,
            region: usize::from(self.is_boxed && enters(&self.region, x, given)),
        };
        (start, length)
    }
}

/// Returns true if a ray starts in a box: inside, or on a face and inwards.
fn enters(region: &Aabb, x: DVec3, direction: DVec3) -> bool {
    (0..3).all(|axis| {
        let (x, d) = (x[axis], direction[axis]);
        let [low, high] = [region.min[axis], region.max[axis]];
        x > low && x < high || x == low && d > 0.0 || x == high && d < 0.0
    })
}

/// Arrays of ends: positions, unit directions, optical lengths; `None` if left out.
#[derive(FromPyObject)]
pub struct GivenEnds<'py>(
    Option<PyReadonlyArray2<'py, f64>>,
    Option<PyReadonlyArray2<'py, f64>>,
    Option<PyReadonlyArray1<'py, f64>>,
);

impl GivenEnds<'_> {
    pub(super) fn view(&self) -> Ends<'_> {
        Ends {
            positions: self.0.as_ref().map(|of| of.as_array()),
            directions: self.1.as_ref().map(|of| of.as_array()),
            lengths: self.2.as_ref().map(|of| of.as_array()),
        }
    }
}

/// Numbers for the ends of rays.
#[derive(Clone, Copy)]
pub(super) struct Ends<'a> {
    positions: Option<ArrayView2<'a, f64>>,
    directions: Option<ArrayView2<'a, f64>>,
    lengths: Option<ArrayView1<'a, f64>>,
}

/// Position, direction and optical length of one end, or derivatives by them.
type EndValues = (DVec3, DVec3, f64);

impl Ends<'_> {
    /// Returns the numbers of a ray, with `missing` for arrays that are left out.
    fn get(&self, i: usize, missing: f64) -> EndValues {
        let vector = |of: &Option<ArrayView2<f64>>| {
            of.as_ref().map_or(DVec3::splat(missing), |of| row(of, i))
        };
        let length = self.lengths.map_or(missing, |of| of[i]);
        (vector(&self.positions), vector(&self.directions), length)
    }
}

/// A loss of the ends of rays.
#[derive(Clone, Copy)]
pub(super) enum Loss<'a> {
    /// Loss that is given by its derivatives.
    Derivatives(Ends<'a>),
    /// Loss ½Σ ((end − measured)/noise)² over measured values that are finite.
    Squares {
        measured: Ends<'a>,
        /// Noise of positions, directions and optical lengths.
        noise: [f64; 3],
    },
}

impl Loss<'_> {
    /// Returns true if the loss depends on a ray.
    pub(super) fn depends_on(&self, i: usize) -> bool {
        match self {
            Loss::Derivatives(by) => by.get(i, 0.0) != (DVec3::ZERO, DVec3::ZERO, 0.0),
            Loss::Squares { measured, .. } => {
                let (x, d, length) = measured.get(i, f64::NAN);
                x.is_finite() || d.is_finite() || length.is_finite()
            }
        }
    }

    /// Returns a ray's contribution to twice the sum of squares, and the derivative of the loss by
    /// its end.
    pub(super) fn at(&self, i: usize, end: &RayEnd) -> (f64, EndDerivative) {
        let direction = end.v.normalize();
        let (squares, (x, d, length)) = match self {
            Loss::Derivatives(by) => (0.0, by.get(i, 0.0)),
            Loss::Squares { measured, noise } => {
                let (x, d, length) = measured.get(i, f64::NAN);
                let [of_x, of_d, of_length] = *noise;
                let x = known((end.x - x) / of_x);
                let d = known((direction - d) / of_d);
                let length = known(DVec3::X * ((end.optical_length - length) / of_length)).x;
                let squares = x.length_squared() + d.length_squared() + length * length;
                (squares, (x / of_x, d / of_d, length / of_length))
            }
        };
        (squares, EndDerivative::of_direction(x, d, length, end.v))
    }
}

/// Returns a residual; zero if it is unknown.
fn known(residual: DVec3) -> DVec3 {
    if residual.is_finite() {
        residual
    } else {
        DVec3::ZERO
    }
}
