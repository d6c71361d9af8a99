//! Fields with n or n² linear in position.

use super::Jet;
use super::analytic::{Analytic, MAX_VALUES, difference, dot};
use super::error::{FieldError, finite_vector, positive};
use super::formula::Number;
use crate::bounds::{Aabb, FieldBounds, IndexBounds};
use glam::{DMat3, DVec3};

/// Index n(x) = n₀ + g·(x − x₀): the usual first-order model of stratified air or water.
///
/// Rays are catenaries. n² is the square of this expression everywhere, so that the index grows
/// again beyond the plane n = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearIndex {
    n0: f64,
    slope: DVec3,
    origin: DVec3,
}

impl LinearIndex {
    /// Creates a field of index `n0` > 0 at `origin`, with gradient `slope` = ∇n in inverse scene
    /// units.
    ///
    /// # Errors
    ///
    /// An index that is not positive and finite; a gradient or origin that is not finite.
    pub fn new(n0: f64, slope: DVec3, origin: DVec3) -> Result<Self, FieldError> {
        Ok(LinearIndex {
            n0: positive("refractive index", n0)?,
            slope: finite_vector("gradient of the index", slope)?,
            origin: finite_vector("origin", origin)?,
        })
    }

    fn index(&self, x: DVec3) -> f64 {
        self.n0 + self.slope.dot(x - self.origin)
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        let n = self.index(x);
        n * n
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let n = self.index(x);
        (n * n, self.slope * (2.0 * n))
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        Jet::from_index(self.index(x), self.slope, DMat3::ZERO)
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let [low, high] = region.project(self.slope);
        let at_zero = self.n0 - self.slope.dot(self.origin);
        let slope = self.slope.length();
        // Use the exact Hessian, 2g⊗g; `squared` knows only its norm.
        FieldBounds {
            hess_min: 0.0,
            hess_max: 2.0 * slope * slope,
            ..IndexBounds {
                n_min: at_zero + low,
                n_max: at_zero + high,
                grad_max: slope,
                hess_min: 0.0,
                hess_max: 0.0,
            }
            .squared()
        }
    }

    /// Returns the length scale: the distance over which the index changes by n₀.
    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        self.n0 / self.slope.length()
    }

    pub(super) fn is_constant(&self) -> bool {
        self.slope == DVec3::ZERO
    }
}

/// Squared index n²(x) = n₀² + g·(x − x₀). Rays are parabolas in σ (docs/theory.md#rays).
///
/// Beyond the plane where n² vanishes it is negative, and the field is invalid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSquare {
    n2: f64,
    slope: DVec3,
    origin: DVec3,
}

impl LinearSquare {
    /// Creates a field of index `n0` > 0 at `origin`, with gradient `slope` = ∇n² in inverse scene
    /// units.
    ///
    /// # Errors
    ///
    /// An index that is not positive and finite; a gradient or origin that is not finite.
    pub fn new(n0: f64, slope: DVec3, origin: DVec3) -> Result<Self, FieldError> {
        let n0 = positive("refractive index", n0)?;
        Ok(LinearSquare {
            n2: n0 * n0,
            slope: finite_vector("gradient of the squared index", slope)?,
            origin: finite_vector("origin", origin)?,
        })
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.n2 + self.slope.dot(x - self.origin)
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        (self.n2(x), self.slope)
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        Jet {
            n2: self.n2(x),
            grad: self.slope,
            hess: DMat3::ZERO,
        }
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let [low, high] = region.project(self.slope);
        let at_zero = self.n2 - self.slope.dot(self.origin);
        FieldBounds {
            n2_min: at_zero + low,
            n2_max: at_zero + high,
            grad_max: self.slope.length(),
            hess_min: 0.0,
            hess_max: 0.0,
        }
    }

    /// Returns the length scale: the distance over which n² changes by n₀².
    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        self.n2 / self.slope.length()
    }

    pub(super) fn is_constant(&self) -> bool {
        self.slope == DVec3::ZERO
    }
}

impl Analytic for LinearIndex {
    const PARAMETERS: &'static [(&'static str, usize)] = &[("n0", 1), ("slope", 3), ("origin", 3)];

    fn numbers(&self) -> [f64; MAX_VALUES] {
        let ([a, b, c], [x, y, z]) = (self.slope.to_array(), self.origin.to_array());
        [self.n0, a, b, c, x, y, z, 0.0]
    }

    fn squared<N: Number>(x: [N; 3], p: &[N]) -> N {
        let d = difference(x, &p[4..7]);
        p[0].add(&dot(&d, &p[1..4])).square()
    }
}

impl Analytic for LinearSquare {
    const PARAMETERS: &'static [(&'static str, usize)] = &[("n0", 1), ("slope", 3), ("origin", 3)];

    fn numbers(&self) -> [f64; MAX_VALUES] {
        let ([a, b, c], [x, y, z]) = (self.slope.to_array(), self.origin.to_array());
        [self.n2.sqrt(), a, b, c, x, y, z, 0.0]
    }

    fn squared<N: Number>(x: [N; 3], p: &[N]) -> N {
        let d = difference(x, &p[4..7]);
        p[0].square().add(&dot(&d, &p[1..4]))
    }
}
