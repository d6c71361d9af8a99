//! All rays to points outside a ball, from points outside or inside the ball. The index outside is
//! constant. The index inside depends only on the distance from the centre, at least approximately.
//!
//! Along a ray, b = n·r·sin(angle to the radius) is constant (Bouguer's formula). Let q = n·r,
//! which must grow with r (Q at the surface), w = d ln r/d ln q, and T = ±√(q² − b²), negative
//! before the ray is closest to the centre. Seen from the centre, a ray turns by Ψ over the optical
//! length L:
//!
//! Ψ = ∫ b w/q² dT, L = ∫ w dT.
//!
//! For w = 1, the integrals are the closed forms of straight lines. At the centre, w − 1 vanishes
//! as q². At the surface, it is at most of the order of 1/y, y = √(1 − q²/Q²), even if q has its
//! maximum there, as in Luneburg's lens. Let h = y (w − 1)/q² and s = T/T_max = 1 − (1 − s₀)u². The
//! difference from straight lines, from s₀ ≥ 0 to the surface, is
//!
//! 2bQ√(1 − s₀) ∫ h/√(1 + s) du and 2Q√(1 − s₀) ∫ q² h/√(1 + s) du, 0 < u < 1, y = (T_max/Q) √(1 −
//! s²),
//!
//! so that Gauss's rule integrates smooth functions only. For a field that is not exactly radial,
//! the mean over spheres replaces the field. The results are then initial guesses of its rays.
//!
//! Theory: docs/theory.md#through-a-lens.

use super::ball::{Ball, Outside, across};
use super::collocate::QuadratureRule;
use crate::field::Field;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::{Add, Mul};

/// Number of intervals of tables, evenly spaced in squared radii. The error of linear interpolation
/// is about 1e-5 of the field's contrast.
const TABLE_INTERVALS: usize = 512;
/// Smallest allowed value of (dq/dr)/(n y). Where dq/dr vanishes inside, rays circle.
const MIN_DERIVATIVE: f64 = 0.05;
/// Number of intervals of angles. At most one ray is expected in each, except where the angle turns
/// back within it.
const ANGLE_INTERVALS: usize = 6;
/// Accuracy of angles, in radians, at which root finding stops.
const ANGLE_ACCURACY: f64 = 1e-6;
/// Maximum number of iterations; more than regula falsi needs.
const MAX_ITERATIONS: usize = 40;
/// Number of halvings of an interval in which angles turn back.
const HALVINGS: usize = 6;
/// Largest miss, in radians, of a ray that is kept as a candidate, per relative deviation of n²
/// from its mean over spheres. A ray of the actual field may lie close to it.
const MAX_MISS_PER_DEVIATION: f64 = 4.0;
/// Miss up to which candidates are always kept, in radians.
const ALWAYS_KEPT_MISS: f64 = 1e-4;

static RULE: QuadratureRule<10> = QuadratureRule::new();

/// A ball with an index that depends on the radius.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialBall {
    center: DVec3,
    radius: f64,
    /// Index outside the ball.
    outside: f64,
    /// q at the surface.
    rim: f64,
    /// Values of n² at evenly spaced r².
    n2: Vec<f64>,
    /// Values of h at evenly spaced y.
    bend: Vec<f64>,
    /// Largest relative deviation of n² from its mean over spheres.
    deviation: f64,
}

/// A ray from a point inside a ball to a point outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallRay {
    /// Point where the ray crosses the surface.
    pub crossing: DVec3,
    /// Unit direction at the inner point.
    pub direction: DVec3,
    /// Optical length inside.
    pub optical_length: f64,
}

/// A ray from one point outside a ball to another, through the ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassingRay {
    /// Point where the ray enters the ball.
    pub entry: DVec3,
    /// Point where the ray leaves the ball.
    pub exit: DVec3,
    /// Optical length between entry and exit.
    pub optical_length: f64,
}

/// Rays from the inner point, parametrised by their angle to the radius.
struct Rays<'a> {
    ball: &'a RadialBall,
    /// q at the inner point.
    q: f64,
    /// Reciprocal distance of the outer point from the centre; 0 for a direction.
    k: f64,
}

/// Turn and optical length of a part of a ray inside the ball.
#[derive(Clone, Copy)]
struct Turn {
    /// Angle Ψ by which the ray turns, seen from the centre.
    inside: f64,
    /// Optical length L.
    optical_length: f64,
}

impl RadialBall {
    /// Creates the ball from the mean of a field over spheres, in surroundings of the index
    /// `outside`. `None` if n·r does not grow with r everywhere, or the radius or an index is not
    /// positive and finite.
    pub fn new(field: &Field, center: DVec3, radius: f64, outside: f64) -> Option<Self> {
        if ![radius, outside].iter().all(|v| *v > 0.0 && v.is_finite()) {
            return None;
        }
        // Tabulate the mean of n² over spheres.
        let step = radius * radius / TABLE_INTERVALS as f64;
        let (mut n2, mut deviation) = (Vec::with_capacity(TABLE_INTERVALS + 1), 0.0);
        for i in 0..=TABLE_INTERVALS {
            let r = (i as f64 * step).sqrt();
            let values = DIRECTIONS.map(|d| field.n2(center + d.normalize() * r));
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let apart = values.iter().map(|v| (v / mean - 1.0).abs());
            deviation = apart.fold(deviation, f64::max);
            n2.push(mean);
        }
        if !n2.iter().all(|n2| *n2 > 0.0 && n2.is_finite()) {
            return None;
        }
        // Extrapolate h to the surface, where y = 0.
        let last = TABLE_INTERVALS;
        let rim2 = n2[last] * radius * radius;
        let slope = |i: usize| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (n2[b] - n2[a]) / ((b - a) as f64 * step)
        };
        let mut known = Vec::with_capacity(TABLE_INTERVALS + 1);
        for (i, n2) in n2[..last].iter().enumerate() {
            let r2 = i as f64 * step;
            let y = (1.0 - n2 * r2 / rim2).max(0.0).sqrt();
            let steepness = 1.0 + r2 * slope(i) / n2;
            if steepness < MIN_DERIVATIVE * y || y == 0.0 {
                return None;
            }
            known.push((y, -y * slope(i) / (n2 * n2 * steepness)));
        }
        let [(a, fa), (b, fb)] = [known[last - 2], known[last - 1]];
        known.push((0.0, fb + (fb - fa) * b / (a - b)));
        known.reverse();
        if known.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
            return None;
        }
        Some(RadialBall {
            center,
            radius,
            outside,
            rim: rim2.sqrt(),
            bend: evenly(&known),
            n2,
            deviation,
        })
    }

    /// Returns the largest relative deviation of n² from its mean over spheres.
    pub fn deviation(&self) -> f64 {
        self.deviation
    }

    /// Returns the largest miss of candidates; see [`MAX_MISS_PER_DEVIATION`].
    fn slack(&self) -> f64 {
        ALWAYS_KEPT_MISS + MAX_MISS_PER_DEVIATION * self.deviation
    }

    /// Returns a ball of constant index, the index at the surface of this ball.
    pub fn surface(&self) -> Ball {
        Ball {
            center: self.center,
            radius: self.radius,
            ratio: self.rim / (self.radius * self.outside),
        }
    }

    /// Returns the rays from `x`, inside, to an end outside, refracted at the surface, to about
    /// 1e-5 in the mean field. A ray that only nearly exists may be among them. If both ends lie on
    /// a line through the centre, one ray represents each cone of rays.
    pub fn rays(&self, x: DVec3, to: Outside) -> Vec<BallRay> {
        let (toward, k) = match to {
            Outside::Point(y) => ((y - self.center).normalize(), 1.0 / y.distance(self.center)),
            Outside::Direction(direction) => (direction, 0.0),
        };
        let (arm, s) = (x - self.center, x.distance(self.center));
        let axis = arm.try_normalize().unwrap_or(toward);
        let across = across(axis, toward);
        let goal = libm::atan2(toward.dot(across), toward.dot(axis));
        let rays = Rays {
            ball: self,
            q: s * interpolated(&self.n2, (s / self.radius).powi(2)).sqrt(),
            k,
        };
        let mut found = Vec::new();
        for (goal, across) in rays.angles(goal, across) {
            let turn = rays.turn(goal);
            let (sin, cos) = libm::sincos(turn.inside);
            let (sin_out, cos_out) = libm::sincos(goal);
            found.push(BallRay {
                crossing: self.center + (axis * cos + across * sin) * self.radius,
                direction: axis * cos_out + across * sin_out,
                optical_length: turn.optical_length,
            });
        }
        found
    }
}

impl RadialBall {
    /// Integrates the part of a ray with the invariant `b` from T = `start` to the surface.
    fn turn(&self, b: f64, start: f64) -> Turn {
        let most = self.largest(b);
        let straight = Turn {
            inside: libm::atan2(b * (most - start), b * b + start * most),
            optical_length: most - start,
        };
        let rest = self.bent(b, most, (start.abs() / most).min(1.0));
        if start < 0.0 {
            straight + self.bent(b, most, 0.0) * 2.0 + rest * -1.0
        } else {
            straight + rest
        }
    }

    /// Integrates a whole ray through the ball: twice a half.
    fn whole_turn(&self, b: f64) -> Turn {
        let most = self.largest(b);
        let straight = Turn {
            inside: libm::atan2(most, b),
            optical_length: most,
        };
        (straight + self.bent(b, most, 0.0)) * 2.0
    }

    /// Returns the value of T at the surface.
    fn largest(&self, b: f64) -> f64 {
        (self.rim * self.rim - b * b).max(0.0).sqrt()
    }

    /// Integrates the difference from a straight line, from the fraction s₀ = `first` ≥ 0 of the
    /// largest T, `most`, to the surface.
    fn bent(&self, b: f64, most: f64, first: f64) -> Turn {
        let root = (1.0 - first).sqrt();
        let mut sums = [0.0; 2];
        for (u, weight) in RULE.nodes.iter().zip(&RULE.weights) {
            let (depth, other) = (root * u, (2.0 - (root * u).powi(2)).sqrt());
            let y = most * depth * other / self.rim;
            let bend = weight * interpolated(&self.bend, y) / other;
            sums[0] += bend;
            sums[1] += bend * (1.0 - y * y);
        }
        let scale = 2.0 * self.rim * root;
        Turn {
            inside: b * scale * sums[0],
            optical_length: scale * self.rim * self.rim * sums[1],
        }
    }
}

impl Add for Turn {
    type Output = Turn;
    fn add(self, o: Turn) -> Turn {
        Turn {
            inside: self.inside + o.inside,
            optical_length: self.optical_length + o.optical_length,
        }
    }
}

impl Mul<f64> for Turn {
    type Output = Turn;
    fn mul(self, factor: f64) -> Turn {
        Turn {
            inside: self.inside * factor,
            optical_length: self.optical_length * factor,
        }
    }
}

impl RadialBall {
    /// Returns the rays from one end outside, through the ball, to another, to about 1e-5 in the
    /// mean field. The first end may lie infinitely far away in the direction of an
    /// [`Outside::Direction`]. A ray that only nearly exists may be among them. If both ends lie on
    /// a line through the centre, one ray represents each cone of rays.
    pub fn passing(&self, from: Outside, y: DVec3) -> Vec<PassingRay> {
        let far = |p: DVec3| 1.0 / p.distance(self.center);
        let (axis, k) = match from {
            Outside::Point(x) => ((x - self.center).normalize(), far(x)),
            Outside::Direction(direction) => (direction, 0.0),
        };
        let toward = (y - self.center).normalize();
        let across = across(axis, toward);
        let goal = libm::atan2(toward.dot(across), toward.dot(axis));
        let passing = Passing {
            ball: self,
            k: [k, far(y)],
        };
        let at = |t: f64| passing.whole(t);
        let values: [f64; ANGLE_INTERVALS + 1] =
            std::array::from_fn(|i| at(i as f64 / ANGLE_INTERVALS as f64));
        let mut found = Vec::new();
        for (goal, across) in [(goal, across), (TAU - goal, -across)] {
            let mut keep = |t: f64| {
                let (approaches, turn) = passing.parts(t);
                let at = |angle: f64| {
                    let (sin, cos) = libm::sincos(angle);
                    self.center + (axis * cos + across * sin) * self.radius
                };
                found.push(PassingRay {
                    entry: at(approaches[0]),
                    exit: at(approaches[0] + turn.inside),
                    optical_length: turn.optical_length,
                });
            };
            roots(&at, &values, goal, self.slack(), &mut keep);
        }
        found
    }
}

/// Rays through the ball, parametrised by the angle of incidence as a fraction `t` of π/2.
struct Passing<'a> {
    ball: &'a RadialBall,
    /// Reciprocal distances of the ends from the centre.
    k: [f64; 2],
}

impl Passing<'_> {
    /// Returns the angles by which a ray turns before and behind the ball, and the turn inside.
    fn parts(&self, t: f64) -> ([f64; 2], Turn) {
        let ball = self.ball;
        let incidence = FRAC_PI_2 * t;
        let impact = ball.radius * libm::sin(incidence);
        let b = (impact * ball.outside).min(ball.rim);
        let approach = |k: f64| incidence - libm::asin((impact * k).min(1.0));
        (self.k.map(approach), ball.whole_turn(b))
    }

    /// Returns the whole angle between the ends, seen from the centre.
    fn whole(&self, t: f64) -> f64 {
        let (approaches, turn) = self.parts(t);
        // Planted error "turns on the way out of a ball forgotten", found by morgana-transport/transport::lens::rays_through_a_surface_that_does_not_refract_are_all_found:
        // approaches[0] + turn.inside
        approaches[0] + turn.inside + approaches[1]
    }
}

impl Rays<'_> {
    /// Returns the invariant b of the ray at an angle.
    fn invariant(&self, theta: f64) -> f64 {
        let most = self.ball.rim.min(self.ball.radius * self.ball.outside);
        (self.q * libm::sin(theta)).clamp(0.0, most)
    }

    fn turn(&self, theta: f64) -> Turn {
        let b = self.invariant(theta);
        let start = (self.q * self.q - b * b)
            .max(0.0)
            .sqrt()
            .copysign(FRAC_PI_2 - theta);
        self.ball.turn(b, start)
    }

    /// Returns the whole angle by which a ray has turned when it meets the outer point.
    fn whole(&self, theta: f64) -> f64 {
        let impact = self.invariant(theta) / self.ball.outside;
        let surface = libm::asin((impact / self.ball.radius).min(1.0));
        self.turn(theta).inside + surface - libm::asin((impact * self.k).min(1.0))
    }

    /// Returns the angles of all rays that turn by `goal`, or by 2π − `goal` on the other side,
    /// each with its side.
    fn angles(&self, goal: f64, across: DVec3) -> Vec<(f64, DVec3)> {
        let limit = self.ball.radius * self.ball.outside;
        // If some rays are reflected, search by angles of refraction, because the angles of
        // incidence lie close together.
        let share = limit / self.q;
        let mut found = Vec::new();
        let mut search = |range: &dyn Fn(f64) -> f64| {
            let at = |t: f64| self.whole(range(t));
            let values: [f64; ANGLE_INTERVALS + 1] =
                std::array::from_fn(|i| at(i as f64 / ANGLE_INTERVALS as f64));
            for (goal, across) in [(goal, across), (TAU - goal, -across)] {
                let mut keep = |t: f64| found.push((range(t), across));
                roots(&at, &values, goal, self.ball.slack(), &mut keep);
            }
        };
        if share >= 1.0 {
            search(&|t| PI * t);
        } else {
            let incidence = |t: f64| libm::asin(share * libm::sin(FRAC_PI_2 * t));
            search(&incidence);
            // Planted error "rays that start backwards in a lens left out", found by morgana-transport/transport::lens::every_pair_that_has_a_ray_is_found:
            // (no line)
            search(&|t| PI - incidence(t));
        }
        found
    }
}

/// Finds the places in [0, 1] where a function takes the value `goal`, given its `values` at evenly
/// spaced places. Also finds places where it comes within `slack` of `goal` at an end or at an
/// extremum.
fn roots(
    at: &dyn Fn(f64) -> f64,
    values: &[f64; ANGLE_INTERVALS + 1],
    goal: f64,
    slack: f64,
    found: &mut dyn FnMut(f64),
) {
    let h = 1.0 / ANGLE_INTERVALS as f64;
    let off = values.map(|value| value - goal);
    for i in 0..ANGLE_INTERVALS {
        if (off[i] < 0.0) != (off[i + 1] < 0.0) {
            found(between(
                at,
                goal,
                [i as f64 * h, (i + 1) as f64 * h],
                [off[i], off[i + 1]],
            ));
        }
    }
    for (end, next) in [(0, 1), (ANGLE_INTERVALS, ANGLE_INTERVALS - 1)] {
        if off[end].abs() < slack && (off[end] < 0.0) == (off[next] < 0.0) {
            found(end as f64 * h);
        }
    }
    for i in 1..ANGLE_INTERVALS {
        let near = [off[i - 1], off[i], off[i + 1]];
        if let Some(turn) = turning(at, goal, [i as f64 * h, h], near, slack) {
            let (t, top) = turn;
            if top * near[0] < 0.0 {
                found(between(at, goal, [(i - 1) as f64 * h, t], [near[0], top]));
                found(between(at, goal, [t, (i + 1) as f64 * h], [top, near[2]]));
            } else if top.abs() < slack {
                found(t);
            }
        }
    }
}

/// Finds the extremum of a function near `t` that comes close to `goal`, given its offsets from
/// `goal` at t − h, t and t + h. Returns the place and the offset there: at the extremum, or at a
/// place beyond `goal`.
fn turning(
    at: &dyn Fn(f64) -> f64,
    goal: f64,
    [mut t, mut h]: [f64; 2],
    [mut a, mut b, mut c]: [f64; 3],
    slack: f64,
) -> Option<(f64, f64)> {
    let sign = b.signum();
    for _ in 0..HALVINGS {
        let turns = b * sign <= (a * sign).min(c * sign) && a * sign > 0.0 && c * sign > 0.0;
        // Estimate the extremum by the parabola through the three points.
        let curvature = a - 2.0 * b + c;
        let closest = (b - (c - a).powi(2) / (8.0 * curvature)) * sign;
        if !turns || closest > slack + 0.5 * curvature.abs() {
            return None;
        }
        let [left, right] = [t - 0.5 * h, t + 0.5 * h].map(|t| at(t) - goal);
        h *= 0.5;
        ([a, b, c], t) = if left * sign < (b * sign).min(right * sign) {
            ([a, left, b], t - h)
        } else if right * sign < b * sign {
            ([b, right, c], t + h)
        } else {
            ([left, b, right], t)
        };
        if b * sign < 0.0 {
            break;
        }
    }
    Some((t, b))
}

/// Finds the root between two places with values of different sign: regula falsi, the Illinois
/// variant.
fn between(at: &dyn Fn(f64) -> f64, goal: f64, place: [f64; 2], off: [f64; 2]) -> f64 {
    let ([mut a, mut b], [mut fa, mut fb]) = (place, off);
    for _ in 0..MAX_ITERATIONS {
        let t = b - fb * (b - a) / (fb - fa);
        let ft = at(t) - goal;
        if (ft < 0.0) == (fb < 0.0) {
            fa *= 0.5;
        } else {
            (a, fa) = (b, fb);
        }
        (b, fb) = (t, ft);
        if ft.abs() < ANGLE_ACCURACY {
            break;
        }
    }
    b
}

/// Resamples (place, value) pairs, in ascending places, at evenly spaced places from 0 to the last.
fn evenly(known: &[(f64, f64)]) -> Vec<f64> {
    let last = known.len() - 1;
    let mut i = 1;
    (0..=last)
        .map(|j| {
            let place = known[last].0 * j as f64 / last as f64;
            while i < last && known[i].0 < place {
                i += 1;
            }
            let ((a, fa), (b, fb)) = (known[i - 1], known[i]);
            fa + (fb - fa) * (place - a) / (b - a)
        })
        .collect()
}

/// Interpolates a table linearly at a fraction `share` of its range.
#[inline]
fn interpolated(table: &[f64], share: f64) -> f64 {
    let place = share.clamp(0.0, 1.0) * (table.len() - 1) as f64;
    let i = (place as usize).min(table.len() - 2);
    table[i] + (table[i + 1] - table[i]) * (place - i as f64)
}

/// Directions for means over spheres: the faces and corners of a cube.
const DIRECTIONS: [DVec3; 14] = [
    DVec3::X,
    DVec3::NEG_X,
    DVec3::Y,
    DVec3::NEG_Y,
    DVec3::Z,
    DVec3::NEG_Z,
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(1.0, -1.0, -1.0),
    DVec3::new(-1.0, 1.0, 1.0),
    DVec3::new(-1.0, 1.0, -1.0),
    DVec3::new(-1.0, -1.0, 1.0),
    DVec3::new(-1.0, -1.0, -1.0),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Constant, Gaussian, Luneburg};

    /// Accuracy of the results. Near a caustic, two rays are known only to the square root of the
    /// accuracy of their angles.
    const RESULT_ACCURACY: f64 = 3e-4;

    /// With a constant index, the rays agree with the closed form of [`Ball`].
    #[test]
    fn rays_of_a_constant_index_are_those_in_closed_form() {
        let (center, radius) = (DVec3::new(0.3, -0.2, 0.1), 1.2);
        let radial = RadialBall::new(&Constant::new(1.5).into(), center, radius, 1.1).unwrap();
        let closed = radial.surface();
        let mut counts = [0; 5];
        for i in 0..400 {
            let at = |turns: f64, r: f64| {
                let (sin, cos) = (turns * TAU).sin_cos();
                center + DVec3::new(cos, sin, 0.3 * sin).normalize() * r
            };
            let x = at(
                f64::from(i) * 0.618_034,
                radius * (0.02 + 0.95 * f64::from(i % 20) / 20.0),
            );
            let y = at(
                0.1 + f64::from(i) * 0.414_214,
                radius * (1.1 + 0.2 * f64::from(i % 7)),
            );
            let expected: Vec<DVec3> = closed.crossings(x, Outside::Point(y)).collect();
            let found = radial.rays(x, Outside::Point(y));
            for p in &expected {
                let near = |ray: &&BallRay| ray.crossing.distance(*p) < RESULT_ACCURACY;
                let ray = found
                    .iter()
                    .find(near)
                    .unwrap_or_else(|| panic!("{x} {y} {p}"));
                assert!((ray.optical_length - 1.5 * x.distance(*p)).abs() < 2.0 * RESULT_ACCURACY);
                assert!(ray.direction.distance((*p - x).normalize()) < 10.0 * RESULT_ACCURACY);
            }
            // At most one more, which nearly exists.
            assert!(found.len() <= expected.len() + 1);
            counts[found.len()] += 1;
        }
        assert!(
            counts[0] > 0 && counts[1] > 0 && counts[2] > 0,
            "{counts:?}"
        );
    }

    /// All rays that arrive parallel to an axis leave Luneburg's lens at its far pole. The angle to
    /// the axis is asin β, and the optical length inside is π/2 + √(1 − β²).
    #[test]
    fn luneburgs_lens_focuses() {
        let lens = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
        let ball = RadialBall::new(&lens.into(), DVec3::ZERO, 1.0, 1.0).unwrap();
        for i in 1..40 {
            let beta = f64::from(i) / 40.0;
            let height = (1.0 - beta * beta).sqrt();
            let y = DVec3::Z + 1.7 * DVec3::new(-beta, 0.0, height);
            let found = ball.passing(Outside::Direction(DVec3::NEG_Z), y);
            let entry = DVec3::new(beta, 0.0, -height);
            let ray = found
                .iter()
                .find(|ray| ray.entry.distance(entry) < RESULT_ACCURACY);
            let ray = ray.unwrap_or_else(|| panic!("{beta} {found:?}"));
            assert!(
                ray.exit.distance(DVec3::Z) < RESULT_ACCURACY,
                "{beta} {ray:?}"
            );
            let length = FRAC_PI_2 + height;
            assert!(
                (ray.optical_length - length).abs() < RESULT_ACCURACY,
                "{beta} {ray:?}"
            );
        }
    }

    /// Rays through a ball of constant index turn, in closed form, by
    /// π − asin(b/s) − asin(b/d) + 2 (asin(b/R) − asin(b/(mR))).
    #[test]
    fn rays_through_a_glass_ball_turn_as_in_closed_form() {
        let glass = RadialBall::new(&Constant::new(1.5).into(), DVec3::ZERO, 1.0, 1.0).unwrap();
        let x = DVec3::new(-3.0, 0.4, 0.2);
        for i in 0..200 {
            let (sin, cos) = (f64::from(i) * 0.618_034 * TAU).sin_cos();
            let y = DVec3::new(cos, sin, 0.3).normalize() * 2.2;
            for ray in glass.passing(Outside::Point(x), y) {
                let [before, inside, behind] = [ray.entry - x, ray.exit - ray.entry, y - ray.exit];
                assert!((ray.optical_length - 1.5 * inside.length()).abs() < RESULT_ACCURACY);
                // Check Snell's law by the components along the surface.
                for (p, a, b) in [(ray.entry, before, inside), (ray.exit, behind, inside)] {
                    let along = |v: DVec3| v.normalize().cross(p).length();
                    assert!((along(a) - 1.5 * along(b)).abs() < 10.0 * RESULT_ACCURACY);
                }
            }
        }
    }

    /// Rays that graze Luneburg's lens bound a shadow, which no ray from far away reaches, past the
    /// lens or through it.
    #[test]
    fn there_is_shadow_beside_luneburgs_lens() {
        let lens = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
        let ball = RadialBall::new(&lens.into(), DVec3::ZERO, 1.0, 1.0).unwrap();
        for i in 0..20 {
            // Rays leave the pole at up to a right angle to the axis, so that the shadow lies only
            // beside it, close to the lens.
            let y = DVec3::new(1.0001, 0.0, -0.9 + 0.09 * f64::from(i));
            let found = ball.passing(Outside::Direction(DVec3::NEG_Z), y);
            assert!(found.is_empty(), "{y} {found:?}");
        }
    }

    #[test]
    fn radii_and_indices_of_balls_are_positive() {
        let ball = |radius, outside| {
            RadialBall::new(&Constant::new(1.5).into(), DVec3::ZERO, radius, outside)
        };
        assert!(ball(1.0, 1.0).is_some());
        for wrong in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(
                [ball(wrong, 1.0), ball(1.0, wrong)],
                [None, None],
                "{wrong}"
            );
        }
    }

    #[test]
    fn rays_circle_where_the_index_falls_too_fast() {
        let steep = Gaussian::new(1.0, 4.0, DVec3::ZERO, 0.3).unwrap();
        assert!(RadialBall::new(&steep.into(), DVec3::ZERO, 1.0, 1.0).is_none());
    }
}
