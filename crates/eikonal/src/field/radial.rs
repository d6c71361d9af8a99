//! Functions for fields of spherical symmetry: n² = f(s) with s = |d|², d = x − c.

use super::{Jet, outer};
use crate::bounds::Aabb;
use glam::{DMat3, DVec3};

/// Returns the jet of f(|d|²) from f, f' and f'', which are derivatives by s, so that nothing is
/// divided by |d|: ∇ = 2f'd, Hess = 2f'I + 4f'' d⊗d.
pub(super) fn jet(d: DVec3, [f, f1, f2]: [f64; 3]) -> Jet {
    Jet {
        n2: f,
        grad: d * (2.0 * f1),
        hess: DMat3::from_diagonal(DVec3::splat(2.0 * f1)) + outer(d) * (4.0 * f2),
    }
}

/// Returns the range of the distance to `center` over a box.
pub(super) fn distance_range(center: DVec3, region: &Aabb) -> [f64; 2] {
    [
        region.nearest_distance(center),
        region.farthest_distance(center),
    ]
}
