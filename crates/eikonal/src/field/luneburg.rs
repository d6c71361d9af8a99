//! The Luneburg lens.

use super::analytic::{Analytic, MAX_VALUES, difference, dot};
use super::error::{FieldError, finite_vector, positive};
use super::formula::Number;
use super::{Jet, radial};
use crate::bounds::{Aabb, FieldBounds};
use glam::DVec3;

/// Luneburg lens n²(x) = n_ext² (2 − r²/R²), r = |x − c|: a ball of radius R that focuses parallel
/// light on its far pole and matches the index n_ext outside (R. K. Luneburg, *Mathematical Theory
/// of Optics*, 1944).
///
/// The formula continues outside the ball, where n² falls below n_ext², and is invalid from r = √2
/// R on. A scene bounds the medium by the ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Luneburg {
    n2_ext: f64,
    center: DVec3,
    radius: f64,
}

impl Luneburg {
    /// Creates a lens of `radius` > 0 for an outside of index `n_ext` > 0.
    ///
    /// # Errors
    ///
    /// An index or radius that is not positive and finite; a centre that is not finite.
    pub fn new(n_ext: f64, center: DVec3, radius: f64) -> Result<Self, FieldError> {
        let n_ext = positive("refractive index outside", n_ext)?;
        Ok(Luneburg {
            n2_ext: n_ext * n_ext,
            center: finite_vector("center", center)?,
            radius: positive("radius", radius)?,
        })
    }

    /// Returns n_ext²/R², minus the derivative of n² by r².
    fn fall(&self) -> f64 {
        self.n2_ext / (self.radius * self.radius)
    }

    fn at_distance_squared(&self, s: f64) -> f64 {
        2.0 * self.n2_ext - self.fall() * s
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.at_distance_squared((x - self.center).length_squared())
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let d = x - self.center;
        (
            self.at_distance_squared(d.length_squared()),
            d * (-2.0 * self.fall()),
        )
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let d = x - self.center;
        let f = self.at_distance_squared(d.length_squared());
        radial::jet(d, [f, -self.fall(), 0.0])
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let [near, far] = radial::distance_range(self.center, region);
        FieldBounds {
            n2_min: self.at_distance_squared(far * far),
            n2_max: self.at_distance_squared(near * near),
            grad_max: 2.0 * self.fall() * far,
            hess_min: -2.0 * self.fall(),
            hess_max: -2.0 * self.fall(),
        }
    }

    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        self.radius
    }

    pub(super) fn is_constant(&self) -> bool {
        false
    }
}

impl Analytic for Luneburg {
    const PARAMETERS: &'static [(&'static str, usize)] =
        &[("n_exterior", 1), ("center", 3), ("radius", 1)];

    fn numbers(&self) -> [f64; MAX_VALUES] {
        let [x, y, z] = self.center.to_array();
        [self.n2_ext.sqrt(), x, y, z, self.radius, 0.0, 0.0, 0.0]
    }

    fn squared<N: Number>(x: [N; 3], p: &[N]) -> N {
        let d = difference(x, &p[1..4]);
        let share = dot(&d, &d).div(&p[4].square());
        p[0].square().mul(&share.times(-1.0).plus(2.0))
    }
}
