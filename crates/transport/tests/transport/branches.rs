//! Sums over all rays between two points. Rays found at random must count once on average.
//!
//! An exhaustive search lists the rays between two points on either side of a strong lens. Their
//! geometry terms add up to the exact result. Connections find one of the rays with certainty, and
//! search for others with some probability. Their mean must equal the exact sum for any probability
//! of searching. False-alarm rate: 1e-3 for the file.

use crate::common::{camera, container, fog, parts, samples, vacuum};
use eikonal::field::Gaussian;
use glam::{DAffine3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::path::{Connection, ConnectionTarget, Start, Vertex, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::shape::Cube;
use morgana_transport::{Scene, Spectrum};
use testkit::moments::Moments;
use testkit::z_test::{max_abs_z, threshold};

const RATE: f64 = 1e-3;
const PAIRS: [[DVec3; 2]; 3] = [
    [DVec3::new(0.1, 0.05, 2.0), DVec3::new(-0.1, 0.02, -2.0)],
    [DVec3::new(0.05, -0.1, 1.6), DVec3::new(0.02, 0.12, -2.2)],
    [DVec3::new(0.0, 0.2, 2.2), DVec3::new(0.1, -0.15, -1.7)],
];

/// Number of connections for each pair.
fn calls() -> u64 {
    samples(6_000, 2_000)
}

fn lens([_, y]: [DVec3; 2]) -> Scene {
    let index = Gaussian::new(1.0, 0.5, DVec3::ZERO, 0.3).unwrap();
    // Use a cube: in a ball all rays would be found with certainty.
    let cube = Cube::new(DAffine3::from_scale(DVec3::splat(1.2))).unwrap();
    let light = Emitter::Point {
        position: y,
        intensity: Spectrum::ONE,
    };
    let media = vec![vacuum(), fog(index, 0.0, 0.0, 0.0)];
    let sensor = camera(DVec3::Z * 4.0, DVec3::ZERO);
    let objects = vec![container(cube, Bsdf::Null)];
    Scene::new(parts(objects, media, vec![light], sensor)).unwrap()
}

/// Connects a pair once per call. Passes every connection with its weight to `each`.
fn connect(pair: [DVec3; 2], search: f64, seed: u64, mut each: impl FnMut(u64, &Connection, f64)) {
    let scene = lens(pair);
    let mut ws = Workspace::new(scene.tolerance());
    ws.search = search;
    let vertex = Vertex::end(&Start::point(pair[0], DVec3::Z, 0));
    for call in 0..calls() {
        let mut sampler = Sampler::new(seed, 0, call);
        let sampled = scene.emitters()[0].sample_end(scene.around(), |_| unreachable!(), [0.5; 2]);
        let target = ConnectionTarget::emitter(&scene, 0, sampled.end);
        let found = Connection::each(
            &scene,
            &vertex,
            &target,
            &mut sampler,
            &mut ws,
            |connection| Some(*connection),
        );
        for (connection, weight) in found {
            each(call, &connection, weight);
        }
    }
    assert_eq!(ws.stats.connections.capped, 0);
}

#[test]
fn branches_are_summed() {
    let mut zs = Vec::new();
    for (k, pair) in PAIRS.into_iter().enumerate() {
        let mut rays: Vec<Connection> = Vec::new();
        connect(pair, 1.0, 1 + k as u64, |_, connection, _| {
            if rays
                .iter()
                .all(|r| r.direction.distance(connection.direction) > 1e-3)
            {
                rays.push(*connection);
            }
        });
        assert!(rays.len() >= 3, "{} rays", rays.len());
        let exact: f64 = rays.iter().map(|r| r.geometry.geometry_term).sum();
        let found_for_certain = rays.iter().filter(|r| r.discovery == 1.0);
        let certain: f64 = found_for_certain.map(|r| r.geometry.geometry_term).sum();
        for search in [1.0, 0.25] {
            let mut sums = vec![0.0; calls() as usize];
            connect(pair, search, 100 + k as u64, |call, connection, weight| {
                sums[call as usize] += connection.geometry.geometry_term * weight;
            });
            let mut moments = Moments::default();
            sums.iter().for_each(|s| moments.push(*s));
            let (mean, error) = (moments.mean(), moments.standard_error());
            println!(
                "{} rays: {mean} ± {error}, exact {exact}, certain {certain}, q = {search}",
                rays.len()
            );
            // Check the power of the test: without the rays found at random, the sum would fail it.
            assert!(error * threshold(RATE, 6) < exact - certain);
            zs.push(moments.z(exact));
        }
    }
    max_abs_z(&zs, RATE).unwrap();
}
