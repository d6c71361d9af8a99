//! GGX distribution of microfacets (Walter et al. 2007), due to Trowbridge and Reitz.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Computes D(h) for the roughness `u` along and `v` across. `cos` is the cosine h_z, and `sin2` is
/// (v/u) h_u² + (u/v) h_v².
pub(super) fn d([u, v]: [f64; 2], cos: f64, sin2: f64) -> f64 {
    // Evaluate cos⁴θ (1 + tan²θ/α²)² without the tangent.
    let base = sin2 / (u * v) + cos * cos;
    1.0 / (PI * u * v * base * base)
}

/// Computes G₁/|cosθ| at |cosθ| and α sinθ.
pub(super) fn g1_over_cos(cos: f64, stretched: f64) -> f64 {
    2.0 / (cos + (cos * cos + stretched * stretched).sqrt())
}

/// Samples a facet normal visible from `o` at roughness 1. The normal does not have unit length.
/// The method of spherical caps (Dupuy and Benyoub 2023) returns the half vector of `o` and a
/// uniform direction of the cap above −o.z.
pub(super) fn visible(o: DVec3, u: [f64; 2]) -> DVec3 {
    let height = (1.0 - u[1]) * (1.0 + o.z);
    let z = height - o.z;
    let sin = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    (sin * DVec2::from_angle(TAU * u[0]) + o.truncate()).extend(height)
}
