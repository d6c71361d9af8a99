//! Branches of a glass ball. They lie in the plane through its centre and the two points, where the
//! impact parameter determines the ray.

use crate::branches::world::Glass;
use glam::DVec3;
use morgana_eikonal::connect::{InitialGuess, RayFamily, Reach};
use morgana_eikonal::{ConnectingRay, Solver, Tolerance};
use std::f64::consts::{PI, TAU};
use testkit::Rng;

const N: f64 = 1.5;
/// Tolerance of the comparison. Rays keep 1e-10; errors grow near grazing incidence and close to
/// caustics.
const MAX_ERROR: f64 = 1e-7;
/// Impact parameter from which the search may miss a ray: the ray then grazes the ball within 3°.
const GRAZING: f64 = 0.999;

/// A ray in the plane: the angle at x between its direction and the direction to the centre, ∫n ds,
/// and its number of reflections.
#[derive(Clone, Copy, Debug)]
struct Planar {
    angle: f64,
    optical: f64,
    reflections: u32,
}

/// Returns the angle around the centre that a ray with impact parameter `b` covers from radius `x`
/// to radius `y`, both outside, and its optical length. The ray passes `chords` chords inside the
/// ball; it has none if it is reflected off the outside.
fn around(b: f64, x: f64, y: f64, chords: u32) -> (f64, f64) {
    let (incidence, inside) = (b.asin(), (b / N).asin());
    let (alpha, beta) = ((b / x).asin(), (b / y).asin());
    let k = f64::from(chords);
    let angle = 2.0 * incidence - alpha - beta + k * (PI - 2.0 * inside);
    let outside = x * alpha.cos() + y * beta.cos() - 2.0 * incidence.cos();
    (angle, outside + k * N * 2.0 * inside.cos())
}

/// Returns every ray that meets the ball, with at most `most` reflections, between points at radii
/// `x` and `y` and the angle `gamma` apart. Bisection finds all roots over the impact parameter.
fn planar(x: f64, y: f64, gamma: f64, most: u32) -> Vec<Planar> {
    const CELLS: usize = 20_000;
    let mut rays = Vec::new();
    // A ray without a reflection has one chord. With one reflection it has either none (off the
    // outside) or two, and so on.
    for chords in (0..=most + 1).filter(|&c| c > 0 || most > 0) {
        let reflections = if chords == 0 { 1 } else { chords - 1 };
        let b = |i: usize| -1.0 + 2.0 * (i as f64) / CELLS as f64;
        for turns in -4..=4 {
            let goal = gamma + TAU * f64::from(turns);
            let miss = |b: f64| around(b, x, y, chords).0 - goal;
            for i in 0..CELLS {
                let (mut low, mut high) = (b(i), b(i + 1));
                if (miss(low) < 0.0) == (miss(high) < 0.0) {
                    continue;
                }
                for _ in 0..100 {
                    let middle = 0.5 * (low + high);
                    if (miss(middle) < 0.0) == (miss(low) < 0.0) {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                rays.push(Planar {
                    angle: (low / x).asin(),
                    optical: around(low, x, y, chords).1,
                    reflections,
                });
            }
        }
    }
    rays
}

/// Two points in the plane of z and a direction perpendicular to it.
fn ends(x: f64, y: f64, gamma: f64) -> ([DVec3; 2], DVec3) {
    let up = DVec3::new(0.6, 0.8, 0.0);
    let at = |r: f64, angle: f64| (DVec3::Z * angle.cos() + up * angle.sin()) * r;
    ([at(x, 0.0), at(y, gamma)], up)
}

/// True if ray and branch agree in direction, length and number of reflections.
fn is(ray: &Planar, branch: &ConnectingRay, up: DVec3) -> bool {
    let direction = up * ray.angle.sin() - DVec3::Z * ray.angle.cos();
    branch.direction_out.distance(direction) < MAX_ERROR
        && (branch.optical_length - ray.optical).abs() < MAX_ERROR
        && branch.pattern.reflections() == ray.reflections
}

#[test]
fn branches_of_a_ball_are_those_of_the_planar_scan() {
    let world = Glass::ball(N);
    let mut solver = Solver::new(Tolerance::new(1e-10));
    let mut rng = Rng::new(51);
    let mut seen = [0; 4];
    for i in 0..if super::long() { 200 } else { 12 } {
        let (x, y) = (rng.range(1.1, 4.0), rng.range(1.1, 4.0));
        // Put every second pair on opposite sides, where rays pass straight through.
        let gamma = rng.range([0.05, 2.2][i % 2], 3.1);
        let ([from, to], up) = ends(x, y, gamma);
        let reach = Reach {
            optical_length: 40.0,
            reflections: 3,
            bounces: u32::MAX,
        };
        let found = solver.all(&world, from, 1, to, &reach).branches;
        let expected = planar(x, y, gamma, 3);
        for ray in &expected {
            let count = found.iter().filter(|(_, b)| is(ray, b, up)).count();
            let grazes = (ray.angle.sin() * x).abs() > GRAZING;
            assert!(count == 1 || grazes && count == 0, "{ray:?} {found:?}");
            seen[ray.reflections as usize] += count;
        }
        // Any other branch is the straight line past the ball, if there is one.
        let sight = (1.0 / x).acos() + (1.0 / y).acos() > gamma;
        let other = |b: &ConnectingRay| !expected.iter().any(|ray| is(ray, b, up));
        let others: Vec<_> = found.iter().filter(|(_, b)| other(b)).collect();
        assert_eq!(others.len(), usize::from(sight), "{others:?}");
        for (start, branch) in &found {
            reciprocal(&world, start, branch, to);
        }
    }
    assert!(seen.iter().all(|n| *n >= 5), "{seen:?}");
}

/// Asserts that J is equal both ways, because both ends are in air. The reverse ray makes the same
/// choices in reverse order.
fn reciprocal(world: &Glass, start: &InitialGuess<usize>, branch: &ConnectingRay, to: DVec3) {
    let mut solver = Solver::new(Tolerance::new(1e-12));
    let there = solver.solve(world, start, to).unwrap();
    let encounters = solver.pieces().len() as u32 - 1;
    let reflected = (0..encounters).filter(|&i| there.pattern.reflects(i));
    let pattern = reflected.fold(morgana_eikonal::connect::Pattern::REFRACT, |p, i| {
        p.with(encounters - 1 - i).unwrap()
    });
    let back = InitialGuess {
        family: RayFamily::Point {
            x: to,
            direction: -there.direction_in,
        },
        pattern,
        ..*start
    };
    let back = solver.solve(world, &back, start.family.x()).unwrap();
    assert!(back.direction_in.distance(-branch.direction_out) < MAX_ERROR);
    assert!(
        (there.jacobian / back.jacobian - 1.0).abs() < 1e-9,
        "{there:?} {back:?}"
    );
}
