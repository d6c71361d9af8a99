//! Costs of connections where nothing bends rays: closed forms, compared with the solver's
//! shooting.
//!
//! ```text
//! cargo bench -p morgana-transport --bench straight
//! ```
//!
//! Times are medians over rounds, for pairs of points inside a cube of fog and across its
//! index-matched boundary. A whole connection includes the optical depth and the visibility of the
//! ray; the solver's time includes the ray alone.

#[path = "../tests/transport/common/mod.rs"]
mod common;

use common::{camera, container, fog, parts, sky, vacuum};
use eikonal::Solver;
use eikonal::connect::{InitialGuess, Pattern, RayFamily};
use eikonal::field::Constant;
use glam::{DAffine3, DVec3};
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::path::{Connection, ConnectionTarget, Vertex, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::scene::MediumId;
use morgana_transport::shape::Cube;
use std::hint::black_box;
use std::time::Instant;

const ROUNDS: usize = 21;
const PAIRS: u64 = 20_000;

fn main() {
    let scene = scene();
    println!(
        "{:24} {:>14} {:>14} {:>8}",
        "", "closed form", "shot alone", "ratio"
    );
    row(&scene, "within the fog", 1.0);
    row(&scene, "across its boundary", 3.0);
}

fn scene() -> Scene {
    let cube = Cube::new(DAffine3::IDENTITY).expect("the identity can be inverted");
    let fog = fog(Constant::new(1.0), 1.0, 0.9, 0.5);
    let parts = parts(
        vec![container(cube, Bsdf::Null)],
        vec![vacuum(), fog],
        vec![sky()],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    );
    Scene::new(parts).expect("the scene is valid")
}

/// Prints a row for pairs of points in the cube, the second point moved away from the centre by a
/// factor.
fn row(scene: &Scene, name: &str, factor: f64) {
    let mut ws = Workspace::new(scene.tolerance());
    let mut solver = Solver::new(scene.tolerance());
    let mut times = Vec::new();
    for round in 0..=ROUNDS {
        let pair = [
            nanoseconds(factor, |x, y| connect(scene, &mut ws, x, y)),
            nanoseconds(factor, |x, y| shoot(scene, &mut solver, x, y)),
        ];
        // The first round warms up.
        if round > 0 {
            times.push(pair);
        }
    }
    println!(
        "{name:24} {:11.0} ns {:11.0} ns {:8.2}",
        median(times.iter().map(|t| t[0])),
        median(times.iter().map(|t| t[1])),
        median(times.iter().map(|t| t[1] / t[0])),
    );
}

fn nanoseconds(factor: f64, mut work: impl FnMut(DVec3, DVec3)) -> f64 {
    let start = Instant::now();
    for pair in 0..PAIRS {
        let mut sampler = Sampler::new(1, 0, pair);
        let mut point = || DVec3::from_array([(); 3].map(|()| 2.0 * sampler.next_1d() - 1.0));
        work(point(), point() * factor);
    }
    1e9 * start.elapsed().as_secs_f64() / PAIRS as f64
}

fn connect(scene: &Scene, ws: &mut Workspace, x: DVec3, y: DVec3) {
    let vertex = Vertex::Volume {
        x,
        direction: DVec3::Z,
        medium: 1,
    };
    let end = ConnectionEnd::Point {
        position: y,
        surface: None,
    };
    let target = ConnectionTarget::emitter(scene, 0, end);
    let mut sampler = Sampler::new(0, 0, 0);
    let found = Connection::each(scene, &vertex, &target, &mut sampler, ws, |connection| {
        Some(connection.geometry.geometry_term)
    });
    black_box(found);
}

fn shoot(scene: &Scene, solver: &mut Solver<MediumId>, x: DVec3, y: DVec3) {
    let start = InitialGuess {
        family: RayFamily::Point {
            x,
            direction: (y - x).normalize(),
        },
        region: 1,
        optical_length: x.distance(y),
        pattern: Pattern::REFRACT,
    };
    let ray = solver.solve(scene, &start, y);
    black_box(ray.is_ok());
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
