//! Random starts: their densities, and their ability to reach every branch.

use crate::branches::world::Glass;
use crate::common::tables::tables;
use glam::DVec3;
use morgana_eikonal::connect::{
    Guide, InitialGuess, Pattern, RayFamily, Reach, Unbounded, random_direction, random_foot,
};
use morgana_eikonal::{Solver, Tolerance};
use std::f64::consts::PI;
use testkit::Rng;

/// Points per axis of a grid in the unit cube. Midpoints of the grid replace random numbers, so
/// that the test has no false alarms.
const GRID: usize = 40;

fn uniform() -> impl Iterator<Item = [f64; 3]> {
    let at = |i: usize| (i % GRID) as f64 / GRID as f64 + 0.5 / GRID as f64;
    (0..GRID.pow(3)).map(move |i| [at(i), at(i / GRID), at(i / GRID / GRID)])
}

/// Fraction of the distribution below `t`: three quarters of it are log-uniform between two bounds.
fn log_uniform(t: f64, [least, most]: [f64; 2]) -> f64 {
    0.75 * ((t / least).ln() / (most / least).ln()).clamp(0.0, 1.0)
}

/// Asserts that the fraction of `values` below `t` is `expected`, to the resolution of the grid.
fn check(values: &[f64], t: f64, expected: f64) {
    let below = values.iter().filter(|v| **v < t).count() as f64 / values.len() as f64;
    let resolution = 1.5 / GRID as f64;
    assert!(
        (below - expected).abs() < resolution,
        "{t}: {below} {expected}"
    );
}

#[test]
fn random_directions_favour_the_chord() {
    let chord = DVec3::new(0.3, -2.0, 0.7);
    let directions: Vec<DVec3> = uniform().map(|u| random_direction(chord, u)).collect();
    assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
    let angles: Vec<f64> = directions.iter().map(|d| d.angle_between(chord)).collect();
    for t in [0.002, 0.01, 0.1, 0.5, 1.0, 2.0, 3.0] {
        let sphere = 0.25 * 0.5 * (1.0 - f64::cos(t));
        check(&angles, t, log_uniform(t, [1e-3, PI]) + sphere);
    }
    // Directions are distributed evenly around the chord.
    let mean = directions.iter().map(|d| d.cross(chord)).sum::<DVec3>() / angles.len() as f64;
    assert!(mean.length() < 1e-3, "{mean}");
    // Without a chord, directions are uniform.
    for none in [DVec3::ZERO, DVec3::NAN] {
        let heights: Vec<f64> = uniform().map(|u| random_direction(none, u).z).collect();
        for t in [-0.9, -0.3, 0.0, 0.6] {
            check(&heights, t, 0.5 * (t + 1.0));
        }
    }
}

#[test]
fn random_feet_favour_the_foot() {
    let direction = DVec3::new(0.6, 0.0, 0.8);
    let (foot, center, radius) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 7.0, 0.5), 1.5);
    let feet: Vec<DVec3> = uniform()
        .map(|u| random_foot(foot, direction, center, radius, u))
        .collect();
    assert!(feet.iter().all(|p| direction.dot(*p - foot).abs() < 1e-12));
    let off: Vec<f64> = feet.iter().map(|p| p.distance(foot) / radius).collect();
    for t in [0.002, 0.01, 0.1, 0.7, 1.9] {
        // The other quarter, a disc around the centre, is farther away than `t` radii.
        check(&off, t, log_uniform(t, [1e-3, 2.0]));
    }
    let projected = center + direction * direction.dot(foot - center);
    assert!(projected.distance(foot) > 3.0 * radius);
    let off: Vec<f64> = feet
        .iter()
        .map(|p| p.distance(projected) / radius)
        .collect();
    for t in [0.3, 0.6, 0.9] {
        check(&off, t, 0.25 * t * t);
    }
}

#[test]
fn random_starts_lead_to_every_branch_behind_a_lens() {
    let table = tables().into_iter().find(|t| t.name == "F5X").unwrap();
    let world = Unbounded(&table.field);
    let mut solver = Solver::new(Tolerance::new(1e-8));
    let mut rng = Rng::new(61);
    let reach = Reach {
        optical_length: 10.0,
        reflections: 0,
        bounces: u32::MAX,
    };
    for pair in &table.pairs {
        let [x, y] = pair.ends;
        let mut found = vec![0; pair.branches.len()];
        for _ in 0..200 {
            let u = std::array::from_fn(|_| rng.next_1d());
            let direction = random_direction(y - x, u);
            let family = RayFamily::Point { x, direction };
            let start = solver.approach(&world, family, (), y, &reach, &mut || rng.next_1d());
            let Some((start, arrival)) = start else {
                continue;
            };
            assert!((arrival.length() - 1.0).abs() < 1e-12);
            if let Ok(branch) = solver.solve(&world, &start, y) {
                let is = |b: &crate::common::tables::Branch| {
                    b.direction_out.distance(branch.direction_out)
                };
                let index = pair.branches.iter().position(|b| is(b) < 1e-6);
                found[index.expect("a listed branch")] += 1;
            }
        }
        assert!(found.iter().all(|n| *n >= 10), "{}: {found:?}", pair.id);
    }
}

#[test]
fn approaches_decide_at_every_choice_until_the_reflections_are_used_up() {
    // Send a ray straight up through a slab: reflected off its far side, off its near side, and
    // out.
    let world = Glass::slab(1.5, 1.0);
    let mut solver = Solver::new(Tolerance::default());
    let (x, y) = (DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.1, 0.0, 4.0));
    let family = RayFamily::Point {
        x,
        direction: DVec3::Z,
    };
    let mut approach = |reflections: u32, answers: &[bool]| {
        let reach = Reach {
            optical_length: 20.0,
            reflections,
            bounces: u32::MAX,
        };
        let mut asked = 0;
        // After tracing the ray, `approach` draws random numbers to choose the closest of its
        // approaches.
        let mut uniform = || {
            asked += 1;
            match answers.get(asked - 1) {
                Some(true) | None => 0.0,
                Some(false) => 0.9,
            }
        };
        let (start, arrival) = solver
            .approach(&world, family, 0, y, &reach, &mut uniform)
            .unwrap();
        let asked = asked.min(answers.len());
        (start, arrival.z, asked)
    };
    let (start, arrival, asked) = approach(0, &[]);
    assert_eq!((start.pattern, asked), (Pattern::REFRACT, 0));
    assert!((start.optical_length - 5.5).abs() < 1e-9 && arrival > 0.999);
    // After two reflections no choice is left.
    let (start, arrival, asked) = approach(2, &[false, true, true]);
    let pattern = Pattern::REFRACT.with(1).and_then(|p| p.with(2)).unwrap();
    assert_eq!((start.pattern, asked), (pattern, 3));
    assert!((start.optical_length - 8.5).abs() < 1e-9 && arrival > 0.999);
    // Reflected down and out, the ray was closest to y earlier, at the far side of the slab.
    let (start, _, asked) = approach(1, &[false, true]);
    assert_eq!((start.pattern, asked), (Pattern::REFRACT, 2));
    assert!((start.optical_length - 2.5).abs() < 1e-9);
    // Reflected off the near side at once.
    let (start, _, asked) = approach(3, &[true]);
    assert_eq!((start.pattern, asked), (Pattern::REFRACT, 1));
    assert!((start.optical_length - 1.0).abs() < 1e-9);
}

#[test]
fn a_guide_starts_where_its_ray_comes_close() {
    // The ray goes down into a slab and up again. It passes the point on its way in and on its way
    // back.
    let world = Glass::slab(1.5, 1.0);
    let direction = DVec3::new(0.6, 0.0, 0.8);
    let guided = |pattern| {
        let start = InitialGuess {
            family: RayFamily::Plane {
                x: -direction,
                direction,
            },
            region: 0,
            optical_length: 10.0,
            pattern,
        };
        Guide::new(&world, start, Tolerance::default()).unwrap()
    };
    let y = DVec3::new(0.01, 0.02, -0.05);
    assert_eq!(guided(Pattern::REFRACT).starts(&world, y).len(), 1);
    let guide = guided(Pattern::REFRACT.with(0).unwrap());
    let starts = guide.starts(&world, y);
    assert_eq!(starts.len(), 2);
    assert_eq!(guide.start().optical_length, 10.0);
    let mut solver = Solver::new(Tolerance::default());
    let mut found: Vec<_> = starts
        .iter()
        .map(|s| solver.solve_on(&world, s, y).unwrap())
        .collect();
    found.sort_by(|a, b| a.optical_length.total_cmp(&b.optical_length));
    assert_eq!(
        found
            .iter()
            .map(|f| f.pattern.reflections())
            .collect::<Vec<_>>(),
        [0, 1]
    );
    // The mirror image of y in the surface lies equally far along the beam.
    let image = DVec3::new(y.x, y.y, -y.z);
    for (found, target) in found.iter().zip([y, image]) {
        let depth = (target + direction).dot(direction);
        assert!((found.optical_length - depth).abs() < 1e-9);
        assert!(found.start.distance(target - direction * depth) < 1e-9);
        assert!((found.jacobian - 1.0).abs() < 1e-9);
    }
    assert!(!found[0].same_branch(&found[1], 1e-3, 1e-3));
    assert!(found[0].same_branch(&found[0], 0.0, 0.0));
}

/// A start in front of germanium, along the normal: the linearisation inside the germanium steps
/// back four times too far, and only changing the length can correct this.
#[test]
fn a_step_too_far_along_the_ray_is_shortened() {
    let world = Glass::slab(4.0, 1.0);
    let x = DVec3::new(0.0, 0.0, -5.0);
    let start = InitialGuess {
        family: RayFamily::Point {
            x,
            direction: DVec3::Z,
        },
        region: 0,
        optical_length: 5.8,
        pattern: Pattern::REFRACT,
    };
    let mut solver = Solver::new(Tolerance::default());
    let y = DVec3::new(0.0, 0.0, -0.2);
    let found = solver.solve(&world, &start, y).unwrap();
    assert!((found.optical_length - 4.8).abs() < 1e-9, "{found:?}");
}
