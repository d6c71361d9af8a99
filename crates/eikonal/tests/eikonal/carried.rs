//! Parallel transport along rays (docs/theory.md#polarisation-along-rays), compared with helices in
//! a SELFOC rod.
//!
//! In n² = n₀²(1 − α²r²) a ray at the constant distance r from the axis is a helix. Its curvature
//! is κ = sin²χ/r and its torsion τ = sinχ cosχ/r, with tanχ = αr/√(1 − 2α²r²). A transported
//! vector turns by −τs in the frame of normal N and binormal B. Over a full turn this angle is the
//! solid angle 2π(1 − cosχ) of the cone of tangents.

use glam::{DQuat, DVec3};
use morgana_eikonal::Tolerance;
use morgana_eikonal::field::{Field, Selfoc};
use morgana_eikonal::ray::{StopCondition, march};
use std::f64::consts::TAU;

const N0: f64 = 1.5;
const ALPHA: f64 = 0.8;
const RADIUS: f64 = 0.6;

struct Helix {
    sin: f64,
    cos: f64,
}

impl Helix {
    fn new() -> Self {
        let (across, squared) = (ALPHA * RADIUS, (ALPHA * RADIUS).powi(2));
        let along = (1.0 - 2.0 * squared).sqrt();
        let speed = across.hypot(along);
        Helix {
            sin: across / speed,
            cos: along / speed,
        }
    }

    /// Returns tangent, normal and binormal after an arc length.
    fn frame(&self, s: f64) -> [DVec3; 3] {
        let (sin, cos) = (self.sin * s / RADIUS).sin_cos();
        let outward = DVec3::new(cos, sin, 0.0);
        let tangent = DVec3::new(-sin, cos, 0.0) * self.sin + DVec3::Z * self.cos;
        [tangent, -outward, tangent.cross(-outward)]
    }

    fn carried(&self, s: f64) -> DVec3 {
        let [_, normal, binormal] = self.frame(s);
        let (sin, cos) = (self.sin * self.cos * s / RADIUS).sin_cos();
        normal * cos - binormal * sin
    }
}

/// Transports the initial normal along the ray, and the result back to the start.
fn carried(s: f64, tolerance: f64) -> [DVec3; 2] {
    let field = Field::from(Selfoc::new(N0, ALPHA, DVec3::ZERO, DVec3::Z).unwrap());
    let [tangent, normal, _] = Helix::new().frame(0.0);
    let mut arcs = Vec::new();
    let stop = StopCondition::ArcLength(s);
    let start = DVec3::X * RADIUS;
    march(
        &field,
        start,
        tangent,
        &stop,
        2.0 * s,
        Tolerance::new(tolerance),
        |step, theta| arcs.push((step.arc, theta)),
    );
    let forth = arcs
        .iter()
        .fold(normal, |axis, (arc, theta)| arc.carried(axis, 0.0, *theta));
    let back = arcs
        .iter()
        .rev()
        .fold(forth, |axis, (arc, theta)| arc.carried(axis, *theta, 0.0));
    [forth, back]
}

#[test]
fn turns_by_the_torsion_of_helices() {
    let helix = Helix::new();
    let turn = TAU * RADIUS / helix.sin;
    for (tolerance, allowed) in [(1e-4, 3e-4), (1e-6, 5e-6), (1e-9, 1e-8)] {
        for share in [0.1, 0.37, 1.0, 2.6] {
            let s = share * turn;
            let [forth, back] = carried(s, tolerance);
            let error = forth.distance(helix.carried(s)) / (1.0 + share);
            assert!(error < allowed, "{tolerance} {share}: {error}");
            // Forward and backward transport differ only by the quadrature error of the solid
            // angle.
            let lost = back.distance(helix.frame(0.0)[1]);
            println!("{tolerance:e} {share}: {error:e}, {lost:e}");
            assert!(lost < 1e-5 * allowed, "{tolerance} {share}: {lost}");
        }
    }
}

#[test]
fn a_full_turn_is_the_solid_angle_of_the_tangents_cone() {
    let helix = Helix::new();
    let [tangent, normal, _] = helix.frame(0.0);
    let [forth, _] = carried(TAU * RADIUS / helix.sin, 1e-9);
    let turned = DQuat::from_axis_angle(tangent, TAU * (1.0 - helix.cos)) * normal;
    assert!(forth.distance(turned) < 1e-7, "{}", forth.distance(turned));
}
