//! Rays out of a glass ball: the rays that the closed form gives, compared with a scan of all
//! directions in the plane of the centre and the two ends.

use glam::DVec3;
use morgana_eikonal::connect::{Ball, Outside};
use morgana_eikonal::ray::perpendicular_basis;
use std::f64::consts::TAU;
use testkit::Rng;

const CELLS: usize = 10_000;
/// Tolerance of the comparison. Crossings are accurate to 1e-6 radians, and less accurate where
/// several lie close together.
const MAX_ERROR: f64 = 1e-5;

/// Returns the point where a ray from `x` inside leaves the ball, and the unit direction beyond;
/// `None` if the ray does not leave.
fn leave(ball: &Ball, x: DVec3, direction: DVec3) -> Option<(DVec3, DVec3)> {
    let offset = x - ball.center;
    let b = offset.dot(direction);
    let t = (b * b + ball.radius.powi(2) - offset.length_squared()).sqrt() - b;
    let p = x + direction * t;
    let normal = (p - ball.center) / ball.radius;
    let tangential = (direction - normal * normal.dot(direction)) * ball.ratio;
    let square = 1.0 - tangential.length_squared();
    (square > 0.0).then(|| (p, tangential + normal * square.sqrt()))
}

/// Returns the part of an interval in which a predicate holds. It must hold at one of the ends, or
/// at both.
fn part([a, b]: [f64; 2], holds: impl Fn(f64) -> bool) -> Option<[f64; 2]> {
    let (mut inside, mut outside) = match (holds(a), holds(b)) {
        (true, true) => return Some([a, b]),
        (false, false) => return None,
        (true, false) => (a, b),
        (false, true) => (b, a),
    };
    let end = inside;
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    Some([end, inside])
}

/// Finds all crossings, by bisection between the directions of a scan.
fn scan(ball: &Ball, x: DVec3, to: Outside) -> Vec<DVec3> {
    let far = match to {
        Outside::Point(y) => y - ball.center,
        Outside::Direction(direction) => direction,
    };
    let normal = (x - ball.center).cross(far).normalize();
    let [u, v] = perpendicular_basis(normal);
    let ray = |angle: f64| leave(ball, x, u * angle.cos() + v * angle.sin());
    // Angle by which a ray misses the target.
    let miss = |angle: f64| {
        let (p, direction) = ray(angle)?;
        let aim = match to {
            Outside::Point(y) => y - p,
            Outside::Direction(direction) => direction,
        };
        Some(normal.dot(aim.cross(direction)).atan2(aim.dot(direction)))
    };
    let angle = |i: usize| TAU * i as f64 / CELLS as f64;
    let mut found = Vec::new();
    for i in 0..CELLS {
        let leaves = |angle: f64| ray(angle).is_some();
        let Some([mut low, mut high]) = part([angle(i), angle(i + 1)], leaves) else {
            continue;
        };
        let (Some(first), Some(last)) = (miss(low), miss(high)) else {
            continue;
        };
        if (first < 0.0) == (last < 0.0) || (first - last).abs() > 1.0 {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match miss(middle) {
                Some(m) if (m < 0.0) == (first < 0.0) => low = middle,
                _ => high = middle,
            }
        }
        found.extend(ray(low).map(|(p, _)| p));
    }
    found
}

#[test]
fn rays_out_of_a_ball_are_those_of_a_scan() {
    let mut rng = Rng::new(61);
    let mut seen = [0; 5];
    for i in 0..600 {
        let mut point = |least, most| DVec3::from_array(rng.direction()) * rng.range(least, most);
        let ball = Ball {
            center: point(0.0, 2.0),
            radius: 1.7,
            ratio: [0.7, 1.0, 1.33, 1.5, 2.4][i % 5],
        };
        let inner = point(0.3, 0.999);
        let x = ball.center + inner * ball.radius;
        // Put many outer ends opposite the inner end, where caustics are.
        let across = -inner.normalize() * [0.0, 3.0, 8.0][i % 3];
        let outer = (across + point(1.0, 1.0)).normalize();
        let to = match i % 2 {
            0 => Outside::Direction(outer),
            _ => Outside::Point(ball.center + outer * (ball.radius * rng.range(1.001, 4.0))),
        };
        let known: Vec<DVec3> = ball.crossings(x, to).collect();
        let expected = scan(&ball, x, to);
        assert_eq!(known.len(), expected.len(), "{ball:?} {x} {to:?}");
        for p in &expected {
            let close = known.iter().any(|k| k.distance(*p) < MAX_ERROR);
            assert!(close, "{ball:?} {x} {to:?}: {known:?}, {expected:?}");
        }
        assert!(!ball.leaves_ball(x) || known.len() == 1);
        seen[known.len()] += 1;
    }
    // The cases cover zero, one, and several rays, which a caustic separates.
    assert!(seen[..4].iter().all(|n| *n >= 5), "{seen:?}");
}
