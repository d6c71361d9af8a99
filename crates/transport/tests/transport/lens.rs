//! Connections through the wall of a lens, a refracting ball with a field inside, which find every
//! ray with certainty. The oracles are a dense fan of rays, the dense search, and estimators that
//! do not connect through the wall.
//!
//! False-alarm rate of the statistical comparisons: 1e-3 for the file.

use crate::common::{
    camera, container, fog, glass, mean, parts, path_tracer, samples, shoot_by, vacuum,
};

use crate::common::fan::Fan;
use crate::common::lens;
use eikonal::connect::Reach;
use eikonal::field::{Gaussian, Luneburg};
use eikonal::{Field, Solver, Tolerance};
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::path::{Connection, ConnectionTarget, Start, Vertex, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::shape::Sphere;
use std::f64::consts::FRAC_PI_2;
use testkit::Rng;
use testkit::moments::Moments;
use testkit::z_test::max_abs_z;

const FAMILY: f64 = 1e-3;
/// Search probability so small that a search for further branches practically never happens.
const NEVER: f64 = 1e-12;
/// Relative tolerance of geometry terms. The tolerance of rays is 1e-6, and caustics amplify it.
const MAX_ERROR: f64 = 1e-3;

fn in_ball(rng: &mut Rng) -> DVec3 {
    DVec3::from_array(rng.direction()) * (lens::RADIUS * rng.next_1d().cbrt())
}

/// The connections from `x` to `y`, each with its weight.
fn connections(
    scene: &Scene,
    [x, y]: [DVec3; 2],
    sampler: &mut Sampler,
    ws: &mut Workspace,
) -> Vec<(Connection, f64)> {
    let vertex = Vertex::end(&Start::point(x, DVec3::Z, scene.medium_at(x)));
    let end = ConnectionEnd::Point {
        position: y,
        surface: None,
    };
    let target = ConnectionTarget::sensor(scene, end);
    let found = Connection::each(scene, &vertex, &target, sampler, ws, |c| Some(*c));
    found.into_iter().collect()
}

fn certain(scene: &Scene, ends: [DVec3; 2]) -> (Vec<Connection>, Workspace) {
    let mut ws = Workspace::new(scene.tolerance());
    ws.search = NEVER;
    let found = connections(scene, ends, &mut Sampler::new(1, 0, 0), &mut ws);
    (found.into_iter().map(|(c, _)| c).collect(), ws)
}

/// Maximum number of field evaluations per pair, in either direction.
const EVALUATIONS: f64 = 60.0;
/// Maximum number of field evaluations per pair that no ray joins.
const IN_VAIN: f64 = 5.0;

#[test]
fn every_pair_that_has_a_ray_is_found_and_others_cost_next_to_nothing() {
    let scene = Scene::new(lens::scene()).unwrap();
    let (fan, eye) = (Fan::new(&lens::ball(), lens::DISTANCE), lens::eye());
    let mut rng = Rng::new(5);
    let (mut seen, mut work) = ([0; 5], [[0; 2]; 2]);
    for _ in 0..600 {
        let x = in_ball(&mut rng);
        let (radius, angle) = (x.length(), x.angle_between(eye));
        let expected = fan.count(radius, angle);
        // Skip points next to a caustic, or where rays graze the wall: there the grid decides.
        let near = [[1.001, 0.0], [0.999, 0.0], [1.0, 2e-3], [1.0, -2e-3]];
        if near
            .iter()
            .any(|[scale, turn]| fan.count(radius * scale, angle + turn) != expected)
        {
            continue;
        }
        seen[expected] += 1;
        for (way, ends) in [[x, eye], [eye, x]].into_iter().enumerate() {
            let (found, ws) = certain(&scene, ends);
            assert_eq!(found.len(), expected, "{ends:?}: {found:?}");
            work[way][usize::from(expected == 0)] += ws.stats().work.evaluations;
        }
    }
    assert!(seen[0] > 50 && seen[1] > 200 && seen[2] > 10, "{seen:?}");
    let pairs: usize = seen.iter().sum();
    for [found, none] in work {
        assert!(
            (found as f64) < EVALUATIONS * (pairs - seen[0]) as f64,
            "{work:?}"
        );
        assert!((none as f64) < IN_VAIN * seen[0] as f64, "{work:?}");
    }
}

/// Compares the connections of a pair with the dense search, which does not use the structure of
/// lenses.
fn check(scene: &Scene, [x, y]: [DVec3; 2]) -> usize {
    let (found, _) = certain(scene, [x, y]);
    let mut dense = Solver::new(Tolerance::new(1e-8));
    let all = dense.all(scene, x, scene.medium_at(x), y, scene.branch_reach());
    let n = scene.n(scene.medium_at(y), y);
    for (_, ray) in &all.branches {
        let same = |l: &&Connection| l.direction.distance(ray.direction_out) < 1e-4;
        let connection = found.iter().find(same).expect("one of the connections");
        let expected = 1.0 / (ray.jacobian * n * n);
        let off = (connection.geometry.geometry_term / expected - 1.0).abs();
        assert!(off < MAX_ERROR, "{x} {y}: {connection:?} {ray:?}");
        assert!(connection.emission.distance(-ray.direction_in) < 1e-4);
        let off = connection.optical_length / ray.optical_length - 1.0;
        assert!(off.abs() < 1e-5, "{x} {y}: {connection:?} {ray:?}");
    }
    assert_eq!(found.len(), all.branches.len(), "{x} {y}: {found:?}");
    found.len()
}

#[test]
fn rays_are_those_of_the_dense_search() {
    let scene = Scene::new(lens::scene()).unwrap();
    let (fan, y) = (Fan::new(&lens::ball(), lens::DISTANCE), lens::eye());
    let mut rng = Rng::new(8);
    // Draw equally many pairs of each kind.
    let mut left = [3, 4, 5].map(|pairs| samples(pairs, 1));
    while left != [0; 3] {
        let x = in_ball(&mut rng);
        let count = fan.count(x.length(), x.angle_between(y));
        if let Some(left @ 1..) = left.get_mut(count) {
            *left -= 1;
            assert_eq!(check(&scene, [x, y]), count);
            check(&scene, [y, x]);
        }
    }
}

/// A lens whose field has another centre than its ball.
fn lopsided() -> Scene {
    let index = Gaussian::new(1.3, 0.08, DVec3::new(0.05, 0.08, -0.04), 0.12).unwrap();
    let ball = Sphere::around(DVec3::ZERO, lens::RADIUS).unwrap();
    Scene::new(parts(
        vec![container(ball, glass())],
        vec![vacuum(), fog(Field::from(index), 0.0, 0.0, 0.0)],
        Vec::new(),
        camera(lens::eye(), DVec3::ZERO),
    ))
    .unwrap()
}

/// Initial guesses miss some rays in a field that is not radial, and random search finds them. Sums
/// of geometry terms equal on average the sums over all rays of the dense search.
#[test]
fn sums_over_rays_of_a_lopsided_lens_are_right_on_average() {
    let scene = lopsided();
    let mut rng = Rng::new(3);
    let (mut zs, mut of) = (Vec::new(), [0, 0]);
    for pair in 0..10 {
        let x = in_ball(&mut rng);
        let y = DVec3::from_array(rng.direction()) * (lens::RADIUS * rng.range(1.2, 3.0));
        // Leave out totally reflected rays, which are so hard to find that no mean would converge.
        let direct = Reach {
            bounces: 0,
            ..*scene.branch_reach()
        };
        let all = Solver::new(Tolerance::new(1e-8)).all(&scene, x, 1, y, &direct);
        let expected: f64 = all.branches.iter().map(|(_, ray)| 1.0 / ray.jacobian).sum();
        of[0] += certain(&scene, [x, y]).0.len();
        of[1] += all.branches.len();
        let mut ws = Workspace::new(scene.tolerance());
        ws.search = 0.5;
        let mut sums = Moments::default();
        for call in 0..300 {
            let mut sampler = Sampler::new(pair, 0, call);
            let found = connections(&scene, [x, y], &mut sampler, &mut ws);
            let direct = found.iter().filter(|(c, _)| c.geometry.reflections == 0);
            sums.push(
                direct
                    .map(|(c, weight)| c.geometry.geometry_term * weight)
                    .sum(),
            );
        }
        let scale = expected.max(1.0);
        // Geometry terms have a further error of 1e-3 of their sum.
        let error = sums.standard_error().hypot(MAX_ERROR * scale / 3.0);
        zs.push((sums.mean() - expected) / error);
    }
    max_abs_z(&zs, FAMILY / 2.0).unwrap();
    assert!(10 * of[0] >= 9 * of[1], "{of:?}");
}

/// For pairs certified to have one ray, the dense search finds no other, totally reflected or not.
/// In an off-centre field, rays are reflected that would not be in a radial one.
#[test]
fn pairs_inside_that_are_certified_have_one_ray() {
    for scene in [Scene::new(lens::scene()).unwrap(), lopsided()] {
        let mut rng = Rng::new(12);
        let (mut certified, mut others, mut checked) = (0, 0, 0);
        for _ in 0..200 {
            let [x, y] = [in_ball(&mut rng), in_ball(&mut rng)];
            let (found, ws) = certain(&scene, [x, y]);
            if ws.stats.connections.certified == 0 {
                others += 1;
                continue;
            }
            certified += 1;
            // The outermost pairs are certified with the smallest margin.
            let inner = x.length().min(y.length());
            if inner > 0.55 * lens::RADIUS && checked < 5 {
                checked += 1;
                let mut dense = Solver::new(Tolerance::new(1e-6));
                let all = dense.all(&scene, x, 1, y, scene.branch_reach()).branches;
                assert_eq!([found.len(), all.len()], [1, 1], "{x} {y}: {all:?}");
            }
        }
        assert!(
            certified > 60 && others > 30 && checked == 5,
            "{certified} {others} {checked}"
        );
    }
}

/// A ball with a field in air, whose surface does not refract.
fn in_air(index: Field, radius: f64) -> Scene {
    let ball = Sphere::around(DVec3::ZERO, radius).unwrap();
    Scene::new(parts(
        vec![container(ball, Bsdf::Null)],
        vec![vacuum(), fog(index, 0.0, 0.0, 0.0)],
        Vec::new(),
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    ))
    .unwrap()
}

fn luneburg() -> Scene {
    in_air(Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into(), 1.0)
}

/// Rays from outside or inside to outside, past the ball and through it, agree with the dense
/// search. The lenses are Luneburg's and a strong one, in which several rays join points on either
/// side.
#[test]
fn rays_through_a_surface_that_does_not_refract_are_all_found() {
    let strong = Gaussian::new(1.0, 0.5, DVec3::ZERO, 0.3).unwrap();
    let scenes = [(luneburg(), 0.3), (in_air(strong.into(), 1.2), 0.1)];
    let mut rng = Rng::new(21);
    let mut seen = [0; 5];
    for (scene, aside) in scenes {
        for pair in 0..12 {
            let y = DVec3::from_array(rng.direction()) * rng.range(1.3, 3.0);
            let direction = DVec3::from_array(rng.direction());
            let x = match pair % 3 {
                // Place points inside, anywhere outside, and on the other side.
                0 => direction * rng.range(0.1, 0.9),
                1 => direction * rng.range(1.3, 3.0),
                _ => (direction * aside - y.normalize()).normalize() * rng.range(1.3, 3.0),
            };
            seen[check(&scene, [x, y])] += 1;
        }
    }
    assert!(seen[1] > 8 && seen[2] + seen[3] > 3, "{seen:?}");
}

/// Maximum number of shots per ray.
const SHOTS: f64 = 1.5;

/// Parallel light reaches every point behind the lens by way of the far pole F, after an optical
/// length of 1 + π/2 from the plane that touches the near pole. It reaches every point outside the
/// shadow directly, too.
#[test]
fn parallel_light_comes_through_luneburgs_lens_in_closed_form() {
    let scene = luneburg();
    let end = ConnectionEnd::Plane {
        through: DVec3::NEG_Z * 2.0,
        direction: DVec3::Z,
        beam: false,
    };
    let target = ConnectionTarget::sensor(&scene, end);
    let mut rng = Rng::new(22);
    let mut ws = Workspace::new(scene.tolerance());
    ws.search = NEVER;
    let mut rays = 0;
    for _ in 0..400 {
        let x = DVec3::from_array(rng.direction()) * rng.range(1.05, 1.9);
        let (off_axis, behind) = (x.truncate().length(), x.z - 1.0);
        // Skip points next to an edge of the shadow, where rays graze the lens.
        if behind.abs() < 0.02 || (off_axis - 1.0).abs() < 0.02 {
            continue;
        }
        let vertex = Vertex::end(&Start::point(x, DVec3::Z, scene.medium_at(x)));
        let mut sampler = Sampler::new(1, 0, 0);
        let found = Connection::each(&scene, &vertex, &target, &mut sampler, &mut ws, |c| {
            Some(*c)
        });
        let mut lengths: Vec<f64> = found.iter().map(|(c, _)| c.optical_length).collect();
        let mut expected = Vec::new();
        if off_axis > 1.0 || x.z < 0.0 {
            expected.push(2.0 + x.z);
        }
        if behind > 0.0 {
            expected.push(1.0 + 1.0 + FRAC_PI_2 + x.distance(DVec3::Z));
        }
        lengths.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        assert_eq!(
            lengths.len(),
            expected.len(),
            "{x}: {lengths:?} {expected:?}"
        );
        for (length, expected) in lengths.iter().zip(&expected) {
            assert!(
                (length / expected - 1.0).abs() < 1e-5,
                "{x}: {length} {expected}"
            );
        }
        rays += expected.len();
    }
    let shots = ws.stats().work.shots as f64 / rays as f64;
    assert!(
        rays > 300 && shots < SHOTS,
        "{rays} rays, {shots} shots for each"
    );
}

/// `path` does not connect through the wall, `particle` connects only to the camera through it, and
/// `bdpt` does both.
#[test]
fn estimators_agree_about_the_light_of_the_lens() {
    let bdpt = Integrator::Bdpt(Bdpt::default());
    let particle = Integrator::Particle(ParticleTracer::default());
    let of = |integrator: Integrator, seed| {
        let rendering = shoot_by(integrator, lens::scene(), 3200, seed);
        mean(&rendering)
    };
    let [path, bdpt, particle] = [of(path_tracer(), 1), of(bdpt, 2), of(particle, 3)];
    let apart = |(a, a_error): (f64, f64), (b, b_error)| (a - b) / a_error.hypot(b_error);
    let zs = [
        apart(path, bdpt),
        apart(path, particle),
        apart(bdpt, particle),
    ];
    max_abs_z(&zs, FAMILY / 2.0).unwrap();
    // Noise is small enough to reveal deviations of a few per cent.
    let noise = [path, bdpt, particle].map(|(mean, error)| error / mean);
    assert!(
        noise[0] < 0.035 && noise[1] < 0.015 && noise[2] < 0.01,
        "{noise:?}"
    );
}
