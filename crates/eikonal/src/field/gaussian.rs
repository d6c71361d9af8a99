//! A Gaussian bump of the index.

use super::analytic::{Analytic, MAX_VALUES, difference, dot};
use super::error::{FieldError, finite, finite_vector, positive};
use super::formula::{Function, Number};
use super::{Jet, radial};
use crate::bounds::{Aabb, FieldBounds, IndexBounds};
use glam::DVec3;

/// Index n(x) = n₀ + Δn exp(−r²/(2w²)), r = |x − c|: a warm or cold, dense or dilute spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    n0: f64,
    delta: f64,
    center: DVec3,
    width: f64,
}

impl Gaussian {
    /// Creates a bump with the index `n0` > 0 far away and `n0 + delta` > 0 at `center`; `width` w
    /// > 0 is the standard deviation in scene units.
    ///
    /// # Errors
    ///
    /// An index, far away or at the centre, or a width that is not positive and finite; a centre
    /// that is not finite.
    pub fn new(n0: f64, delta: f64, center: DVec3, width: f64) -> Result<Self, FieldError> {
        finite("change of the index at the center", delta)?;
        positive("refractive index at the center", n0 + delta)?;
        Ok(Gaussian {
            n0: positive("refractive index far away", n0)?,
            delta,
            center: finite_vector("center", center)?,
            width: positive("width", width)?,
        })
    }

    /// Returns x − c and Δn exp(−r²/(2w²)).
    fn offset(&self, x: DVec3) -> (DVec3, f64) {
        let d = x - self.center;
        let u = d.length_squared() / (self.width * self.width);
        (d, self.delta * (-0.5 * u).exp())
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        let n = self.n0 + self.offset(x).1;
        n * n
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (d, bump) = self.offset(x);
        let n = self.n0 + bump;
        (n * n, d * (-2.0 * n * bump / (self.width * self.width)))
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let (d, bump) = self.offset(x);
        let n = self.n0 + bump;
        let per_area = 1.0 / (self.width * self.width);
        let f1 = -n * bump * per_area;
        let f2 = 0.5 * bump * (bump + n) * per_area * per_area;
        radial::jet(d, [n * n, f1, f2])
    }

    /// Computes bounds from extrema, with r in units of w. The gradient of the bump, r e^(−r²/2),
    /// has its maximum at r = 1. The eigenvalue of its Hessian across the radius, −e^(−r²/2),
    /// increases with r. The eigenvalue along the radius, (r² − 1)e^(−r²/2), has its maximum at r =
    /// √3.
    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let range = radial::distance_range(self.center, region);
        // Cap the radii at 100 w, where all terms underflow, so that an unbounded box yields no
        // 0·∞.
        let [near, far] = range.map(|r| (r / self.width).min(100.0));
        let bump = |r: f64| (-0.5 * r * r).exp();
        let along = |r: f64| (r * r - 1.0) * bump(r);
        let steepest = 1.0_f64.clamp(near, far);
        let curved = [
            (-bump(near)).min(along(near)).min(along(far)),
            (-bump(far)).max(along(3.0_f64.sqrt().clamp(near, far))),
        ];
        let [n_min, n_max] = scaled(self.delta, [bump(far), bump(near)]);
        let per_area = self.delta / (self.width * self.width);
        let [hess_min, hess_max] = scaled(per_area, curved);
        IndexBounds {
            n_min: self.n0 + n_min,
            n_max: self.n0 + n_max,
            grad_max: self.delta.abs() / self.width * steepest * bump(steepest),
            hess_min,
            hess_max,
        }
        .squared()
    }

    /// Returns the length scale L at which the fifth derivative of a ray with respect to σ is
    /// n⁵L⁻⁴. It follows from the fourth derivative of n² at the centre, 6nΔn/w⁴. L is at most 3w,
    /// so that steps resolve the bump. Far away L is half the distance to the centre, so that no
    /// step jumps over the bump.
    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        let contrast = self.delta.abs() / self.n0.min(self.n0 + self.delta);
        let widths = (1.0 / (3.0 * contrast)).sqrt().sqrt().min(3.0);
        (self.width * widths).max(0.5 * (x - self.center).length())
    }

    pub(super) fn is_constant(&self) -> bool {
        self.delta == 0.0
    }
}

impl Analytic for Gaussian {
    const PARAMETERS: &'static [(&'static str, usize)] =
        &[("n0", 1), ("delta", 1), ("center", 3), ("width", 1)];

    fn numbers(&self) -> [f64; MAX_VALUES] {
        let [x, y, z] = self.center.to_array();
        [self.n0, self.delta, x, y, z, self.width, 0.0, 0.0]
    }

    fn squared<N: Number>(x: [N; 3], p: &[N]) -> N {
        let d = difference(x, &p[2..5]);
        let exponent = dot(&d, &d).div(&p[5].square()).times(-0.5);
        p[1].mul(&exponent.apply(Function::Exp)).add(&p[0]).square()
    }
}

/// Returns the interval `factor`·[a, b].
fn scaled(factor: f64, [a, b]: [f64; 2]) -> [f64; 2] {
    let (p, q) = (factor * a, factor * b);
    [p.min(q), p.max(q)]
}
