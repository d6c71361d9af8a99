//! Random initial directions and positions of rays, as functions of uniform numbers.
//!
//! Both densities are positive everywhere. Newton's method therefore finds, with positive
//! probability, every branch to which it converges from some neighbourhood. Both densities favour
//! the surroundings of the chord, on all scales, because branches behind a lens often lie close
//! together.

use crate::ray::perpendicular_basis;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Fraction of initial rays around the chord; the others are uniform.
const CHORD_FRACTION: f64 = 0.75;
/// Smallest angle between initial rays and the chord, in radians. For rays from a plane, it is the
/// smallest distance from the foot, in units of the radius.
const MIN_ANGLE: f64 = 1e-3;
/// Largest distance of starts from the foot, in units of the radius.
const MAX_DISTANCE: f64 = 2.0;

/// Returns a random unit direction: with probability 3/4 at an angle to `chord` that is log-uniform
/// in [1e-3, π], otherwise uniform on the sphere.
///
/// `u` are independent and uniform in [0, 1). The chord may have any length; if it is zero or not
/// finite, all directions are uniform.
pub fn random_direction(chord: DVec3, u: [f64; 3]) -> DVec3 {
    let [choice, polar, azimuth] = u;
    let axis = chord.try_normalize();
    let (sin, cos) = match axis {
        Some(_) if choice < CHORD_FRACTION => (MIN_ANGLE * (PI / MIN_ANGLE).powf(polar)).sin_cos(),
        _ => {
            let cos = 1.0 - 2.0 * polar;
            ((1.0 - cos * cos).max(0.0).sqrt(), cos)
        }
    };
    let axis = axis.unwrap_or(DVec3::Z);
    (axis * cos + around(axis, azimuth) * sin).normalize()
}

/// Returns a random point of the plane through `foot` perpendicular to the unit `direction`. With
/// probability 3/4, its distance from the foot is log-uniform in [1e-3, 2]·`radius`. Otherwise the
/// point is uniform in the disc of this radius around the projection of `center`.
///
/// `u` are independent and uniform in [0, 1).
pub fn random_foot(
    foot: DVec3,
    direction: DVec3,
    center: DVec3,
    radius: f64,
    u: [f64; 3],
) -> DVec3 {
    let [choice, distance, azimuth] = u;
    let across = around(direction, azimuth) * radius;
    if choice < CHORD_FRACTION {
        foot + across * (MIN_ANGLE * (MAX_DISTANCE / MIN_ANGLE).powf(distance))
    } else {
        let projected = center + direction * direction.dot(foot - center);
        projected + across * distance.sqrt()
    }
}

/// Returns the unit vector perpendicular to `axis` at the fraction `u` of a full turn.
fn around(axis: DVec3, u: f64) -> DVec3 {
    let [t1, t2] = perpendicular_basis(axis);
    let (sin, cos) = (TAU * u).sin_cos();
    t1 * cos + t2 * sin
}
