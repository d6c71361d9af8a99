//! Directions about the z axis: sphere, cone, cosine-weighted hemisphere.

use super::disc::{uniform_disc_inverse, uniform_disc_sample};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Samples a unit vector uniform over the sphere.
pub fn uniform_sphere_sample(u: [f64; 2]) -> DVec3 {
    uniform_cone_sample(2.0, u)
}

/// Inverts [`uniform_sphere_sample`]: returns the `u` that it maps to the unit vector `d`.
pub fn uniform_sphere_inverse(d: DVec3) -> [f64; 2] {
    uniform_cone_inverse(2.0, d)
}

/// Returns the density 1/(4π) per steradian.
pub fn uniform_sphere_pdf() -> f64 {
    0.25 / PI
}

/// Samples a unit vector uniform over the cone around +z whose cap has the given height.
///
/// `height` = 1 − cosθ_max is in (0, 2]. It replaces the cosine so that narrow cones keep their
/// digits. For an angle θ_max, pass 2 sin²(θ_max/2).
pub fn uniform_cone_sample(height: f64, u: [f64; 2]) -> DVec3 {
    let w = height * u[0];
    let sin = (w * (2.0 - w)).sqrt();
    (sin * DVec2::from_angle(TAU * u[1])).extend(1.0 - w)
}

/// Inverts [`uniform_cone_sample`]: returns the `u` that it maps to `d`, a unit vector in the cone.
pub fn uniform_cone_inverse(height: f64, d: DVec3) -> [f64; 2] {
    // Use 1 − z = (x² + y²)/(1 + z) in the upper hemisphere to avoid cancellation.
    let w = if d.z > 0.0 {
        d.truncate().length_squared() / (1.0 + d.z)
    } else {
        1.0 - d.z
    };
    let turn = d.y.atan2(d.x) / TAU;
    [w / height, if turn < 0.0 { turn + 1.0 } else { turn }]
}

/// Returns the density per steradian: 1/(2π·height) inside the cone, 0 outside.
pub fn uniform_cone_pdf(height: f64, d: DVec3) -> f64 {
    if 1.0 - d.z <= height {
        1.0 / (TAU * height)
    } else {
        0.0
    }
}

/// Samples a unit vector with density cosθ/π over the upper hemisphere (Malley's method).
pub fn cosine_hemisphere_sample(u: [f64; 2]) -> DVec3 {
    let p = uniform_disc_sample(u);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Inverts [`cosine_hemisphere_sample`]: returns the `u` that it maps to `d`, a unit vector of the
/// upper hemisphere.
pub fn cosine_hemisphere_inverse(d: DVec3) -> [f64; 2] {
    uniform_disc_inverse(d.truncate())
}

/// Returns the density cosθ/π per steradian; 0 below the horizon.
pub fn cosine_hemisphere_pdf(d: DVec3) -> f64 {
    d.z.max(0.0) * FRAC_1_PI
}
