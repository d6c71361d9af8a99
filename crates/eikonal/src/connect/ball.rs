//! All rays between a point inside a ball and a point outside, for a constant index on either side.
//!
//! A ray lies in a plane through the centre, and n·r·sin(angle to the radius) is constant along it
//! (Bouguer's formula). A ray meets the sphere at the same angle every time. A totally reflected
//! ray therefore never leaves, and a refracted ray never returns. Consider a ray that leaves the
//! inner point at the angle θ to the radius. Seen from the centre, it has turned by
//!
//! η = θ − asin(s sin θ) + asin(ms sin θ) − asin(kms sin θ)
//!
//! when it meets the outer point. Here m = n_inside/n_outside; s and 1/k are the distances of the
//! points from the centre, in radii.
//!
//! * **ms ≤ 1**: all rays leave. The derivative of asin(c sin θ), c cos θ/√(1 − c² sin² θ), grows
//!   with c and is at most 1 for c ≤ 1. Hence η grows with θ from 0 to π: there is one ray.
//! * **ms > 1**: rays leave at angles τ to the normal, sin τ = ms sin θ, forwards (θ < π/2) or
//!   backwards. Forwards, η = τ + asin(sin τ/(ms)) − asin(sin τ/m) − asin(k sin τ) grows with τ:
//!   there is one ray, or none. Backwards, π − η = asin(sin τ/(ms)) + asin(sin τ/m) + asin(k sin τ)
//!   − τ is concave: it takes a value at most twice. A value below 0, on the other side of the
//!   axis, it takes once.
//!
//! Theory: docs/theory.md#through-a-ball.

use crate::ray::perpendicular_basis;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Smallest angle between two directions that defines their common plane, in radians. At smaller
/// angles round-off would determine the plane.
const MIN_PLANE_ANGLE: f64 = 1e-9;
/// Size of the Newton step, in radians, below which the iteration stops.
const MAX_LAST_STEP: f64 = 1e-6;
/// Round-off of angles, in radians.
const ROUND_OFF: f64 = 1e-12;
/// Maximum number of iterations; more than even a double root needs.
const MAX_ITERATIONS: usize = 60;

/// A ball of constant index in surroundings of constant index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre.
    pub center: DVec3,
    /// Radius.
    pub radius: f64,
    /// Index inside over index outside.
    pub ratio: f64,
}

/// The outer end of rays that leave a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outside {
    /// A point outside.
    Point(DVec3),
    /// Infinitely far away in this unit direction, which is the direction of the leaving rays.
    Direction(DVec3),
}

impl Ball {
    /// Returns true if the point `x` lies inside.
    pub fn contains(&self, x: DVec3) -> bool {
        x.distance_squared(self.center) < self.radius * self.radius
    }

    /// Returns true if every ray through the inner point `x` leaves the ball.
    pub fn leaves_ball(&self, x: DVec3) -> bool {
        self.ratio * x.distance(self.center) <= self.radius
    }

    /// Returns the points where rays from `x`, inside, to an end outside are refracted at the
    /// sphere: all of them, to 1e-6 radians seen from the centre or better. Every other ray to this
    /// end is reflected where it could be refracted. If both ends lie on a line through the centre,
    /// one ray represents each cone of rays.
    pub fn crossings(&self, x: DVec3, to: Outside) -> impl Iterator<Item = DVec3> + use<> {
        let Ball { center, radius, .. } = *self;
        let (toward, k) = match to {
            Outside::Point(y) => ((y - center).normalize(), radius / y.distance(center)),
            Outside::Direction(direction) => (direction, 0.0),
        };
        let axis = (x - center).try_normalize().unwrap_or(toward);
        let across = across(axis, toward);
        let goal = libm::atan2(toward.dot(across), toward.dot(axis));
        let angles = self.angles(x.distance(center) / radius, k, goal);
        angles.into_iter().flatten().map(move |angle| {
            let (sin, cos) = libm::sincos(angle);
            center + (axis * cos + across * sin) * radius
        })
    }

    /// Returns the angles of the crossings to the axis from the centre to the inner point, for an
    /// outer point at the angle `goal`.
    fn angles(&self, s: f64, k: f64, goal: f64) -> [Option<f64>; 4] {
        let m = self.ratio;
        if m * s <= 1.0 {
            let turn = Turn(1.0, [(-1.0, s), (1.0, m * s), (-1.0, k * m * s)]);
            let theta = turn.rise([0.0, PI], goal);
            return [theta.map(|t| t - arc_sine(s, t)), None, None, None];
        }
        let (a, b) = (1.0 / (m * s), 1.0 / m);
        let ahead = Turn(1.0, [(1.0, a), (-1.0, b), (-1.0, k)]);
        let back = Turn(-1.0, [(1.0, a), (1.0, b), (1.0, k)]);
        let [near, far] = [0.0, FRAC_PI_2].map(|end| back.climb(end, PI - goal));
        let other = back.climb(FRAC_PI_2, goal - PI);
        let behind = |t: f64| arc_sine(a, t) + arc_sine(b, t);
        [
            ahead
                .rise([0.0, FRAC_PI_2], goal)
                .map(|t| arc_sine(a, t) - arc_sine(b, t)),
            near.map(|t| PI - behind(t)),
            far.map(|t| PI - behind(t)),
            other.map(|t| PI + behind(t)),
        ]
    }
}

/// Returns a unit vector perpendicular to `axis` in the plane of `axis` and `toward`, both unit
/// vectors.
pub(super) fn across(axis: DVec3, toward: DVec3) -> DVec3 {
    let across = toward - axis * axis.dot(toward);
    if across.length() > MIN_PLANE_ANGLE {
        across.normalize()
    } else {
        perpendicular_basis(axis)[0]
    }
}

fn arc_sine(c: f64, t: f64) -> f64 {
    libm::asin((c * libm::sin(t)).min(1.0))
}

/// The function a·t + Σ σ asin(c sin t) of t, with σ = ±1 and 0 ≤ c ≤ 1.
struct Turn(f64, [(f64, f64); 3]);

impl Turn {
    /// Returns value and derivative.
    fn at(&self, t: f64) -> (f64, f64) {
        let (sin, cos) = libm::sincos(t);
        let Turn(linear, terms) = *self;
        let (mut value, mut slope) = (linear * t, linear);
        for (sign, c) in terms {
            let sine = (c * sin).min(1.0);
            value += sign * libm::asin(sine);
            slope += sign * c * cos / (1.0 - sine * sine).sqrt();
        }
        (value, slope)
    }

    /// Solves for the place where a function that rises from 0 over an interval reaches `goal` > 0,
    /// by Newton's method with bisection as safeguard. Returns `None` if it does not reach `goal`.
    fn rise(&self, [mut low, mut high]: [f64; 2], goal: f64) -> Option<f64> {
        let top = self.at(high).0;
        if goal > top + ROUND_OFF {
            return None;
        }
        let mut t = high * (goal / top).min(1.0);
        for _ in 0..MAX_ITERATIONS {
            let (value, slope) = self.at(t);
            if value < goal {
                low = t;
            } else {
                high = t;
            }
            let next = t + (goal - value) / slope;
            let next = if next >= low && next <= high {
                next
            } else {
                0.5 * (low + high)
            };
            let change = (next - t).abs();
            t = next;
            if change < MAX_LAST_STEP {
                break;
            }
        }
        Some(t)
    }

    /// Solves for the first place where a concave function reaches `goal`, starting at an `end` of
    /// [0, π/2] where it is lower. Tangents of a concave function lie above it. Newton's method
    /// therefore approaches from one side, or finds that the function falls before it reaches
    /// `goal`.
    fn climb(&self, end: f64, goal: f64) -> Option<f64> {
        let inward = if end > 0.0 { -1.0 } else { 1.0 };
        let mut t = end;
        for _ in 0..MAX_ITERATIONS {
            let (value, slope) = self.at(t);
            let step = (goal - value) / slope;
            let forth = step * inward;
            if forth.is_nan() || forth < -MAX_LAST_STEP || slope * inward <= 0.0 {
                return None;
            }
            t += step;
            if !(0.0..=FRAC_PI_2).contains(&t) {
                return None;
            }
            if forth < MAX_LAST_STEP {
                return Some(t);
            }
        }
        None
    }
}
