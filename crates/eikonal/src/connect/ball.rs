//! All rays between a point inside a ball and one outside, where the index is constant on either side.
//!
//! A ray lies in a plane through the centre, and n·r·sin(angle to the radius) is the same all along it
//! (Bouguer's formula). It meets the sphere at one angle again and again, so that one that is reflected
//! totally never leaves, and one that is refracted out never returns. Seen from the centre, a ray that leaves
//! the inner point at the angle θ to the radius has turned by
//!
//! η = θ − asin(s sin θ) + asin(ms sin θ) − asin(kms sin θ)
//!
//! when it meets the outer point: m = n_inside/n_outside, s and 1/k are the distances of the points from the
//! centre in radii.
//!
//! * **ms ≤ 1**: all rays leave. η grows from 0 to π with θ, as c cos θ/√(1 − c² sin² θ), the derivative
//!   of asin(c sin θ), grows with c and is at most 1 for c ≤ 1: there is one ray.
//! * **ms > 1**: rays leave at angles τ to the normal, sin τ = ms sin θ, ahead (θ < π/2) or back. Ahead, η = τ +
//!   asin(sin τ/(ms)) − asin(sin τ/m) − asin(k sin τ) grows with τ: there is one ray, or none. Back, π − η =
//!   asin(sin τ/(ms)) + asin(sin τ/m) + asin(k sin τ) − τ is concave: it takes a value twice at most,
//!   and one below 0, on the other side of the axis, once.
//!
//! Theory: docs/theory.md#through-a-ball.

use crate::ray::perpendicular_basis;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Directions that differ by less, in radians, are one: round-off would decide about the plane that they lie in.
const ALIGNED: f64 = 1e-9;
/// Newton's steps below this, in radians, are the last.
const SETTLED: f64 = 1e-6;
/// Of angles.
const ROUND_OFF: f64 = 1e-12;
/// More rounds than even a double root needs.
const ROUNDS: usize = 60;

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
    /// Infinitely far away in this unit direction, in which the rays leave.
    Direction(DVec3),
}

impl Ball {
    /// Whether a point lies inside.
    pub fn contains(&self, x: DVec3) -> bool {
        x.distance_squared(self.center) < self.radius * self.radius
    }

    /// Whether every ray leaves that passes through the point `x` inside.
    pub fn lets_out(&self, x: DVec3) -> bool {
        self.ratio * x.distance(self.center) <= self.radius
    }

    /// Where the rays cross the sphere that go from `x`, inside, to an end outside and are refracted there:
    /// all of them, in radians seen from the centre to 1e-6 or better. There are no others that are
    /// not reflected where they could be refracted. If both ends lie on a line through the centre, one of
    /// each cone of rays stands for all.
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

    /// The crossings' angles to the axis from the centre to the inner point, for the outer one at `goal`.
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

/// The unit vector across an axis in the plane of it and of another unit vector.
pub(super) fn across(axis: DVec3, toward: DVec3) -> DVec3 {
    let across = toward - axis * axis.dot(toward);
    if across.length() > ALIGNED {
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
    /// Value and derivative.
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

    /// Where a function that rises from 0 over an interval reaches `goal` > 0: Newton's method, kept inside by
    /// bisection. `None` if it does not.
    fn rise(&self, [mut low, mut high]: [f64; 2], goal: f64) -> Option<f64> {
        let top = self.at(high).0;
        if goal > top + ROUND_OFF {
            return None;
        }
        let mut t = high * (goal / top).min(1.0);
        for _ in 0..ROUNDS {
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
            if change < SETTLED {
                break;
            }
        }
        Some(t)
    }

    /// Where a concave function reaches `goal` first, seen from an end of [0, π/2] at which it is lower: as its
    /// tangents lie above it, Newton's method comes closer from one side, or finds that the function falls
    /// before it gets there.
    fn climb(&self, end: f64, goal: f64) -> Option<f64> {
        let inward = if end > 0.0 { -1.0 } else { 1.0 };
        let mut t = end;
        for _ in 0..ROUNDS {
            let (value, slope) = self.at(t);
            let step = (goal - value) / slope;
            let forth = step * inward;
            if forth.is_nan() || forth < -SETTLED || slope * inward <= 0.0 {
                return None;
            }
            t += step;
            if !(0.0..=FRAC_PI_2).contains(&t) {
                return None;
            }
            if forth < SETTLED {
                return Some(t);
            }
        }
        None
    }
}
