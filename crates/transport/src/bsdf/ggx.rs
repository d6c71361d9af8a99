//! The GGX distribution of microfacets (Walter et al. 2007), due to Trowbridge and Reitz.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// D(h) at roughness `alpha`.
pub(super) fn d(alpha: f64, h: DVec3) -> f64 {
    // cos⁴θ (α² + tan²θ)² without the tangent.
    let base = h.truncate().length_squared() / (alpha * alpha) + h.z * h.z;
    1.0 / (PI * alpha * alpha * base * base)
}

/// G₁/|cosθ| at |cosθ| and α sinθ.
pub(super) fn g1_over_cos(cos: f64, stretched: f64) -> f64 {
    2.0 / (cos + (cos * cos + stretched * stretched).sqrt())
}

/// A facet normal, not of unit length, as visible from `o` at roughness 1. Spherical caps (Dupuy and Benyoub
/// 2023): it is the half vector of `o` and a uniform direction of the cap above −o.z.
pub(super) fn visible(o: DVec3, u: [f64; 2]) -> DVec3 {
    let height = (1.0 - u[1]) * (1.0 + o.z);
    let z = height - o.z;
    let sin = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    (sin * DVec2::from_angle(TAU * u[0]) + o.truncate()).extend(height)
}
