//! A smooth ball as the only object that bends rays. Connections through its surface find every ray
//! with certainty, each by one shot. The oracle is the dense search, which does not use the ball's
//! closed form.

use crate::common::{camera, container, fog, glass, parts, vacuum};
use eikonal::field::Constant;
use eikonal::{Solver, Tolerance};
use glam::DVec3;
use morgana_transport::emitter::Emitter;
use morgana_transport::path::{Connection, ConnectionTarget, Start, Vertex, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use testkit::Rng;

const RADIUS: f64 = 1.2;
/// Relative tolerance of geometry terms. The tolerance of rays is 1e-6, and caustics amplify it.
const MAX_ERROR: f64 = 1e-3;

fn scene(light: DVec3) -> Scene {
    let ball = Sphere::around(DVec3::new(0.3, -0.2, 0.1), RADIUS).unwrap();
    let light = Emitter::Point {
        position: light,
        intensity: Spectrum::ONE,
    };
    let media = vec![vacuum(), fog(Constant::new(1.5), 0.0, 0.0, 0.0)];
    let sensor = camera(DVec3::Z * 5.0, DVec3::ZERO);
    Scene::new(parts(
        vec![container(ball, glass())],
        media,
        vec![light],
        sensor,
    ))
    .unwrap()
}

/// Returns all connections from `x` to the emitter, and the workspace with its counts.
fn connections(scene: &Scene, x: DVec3) -> (Vec<Connection>, Workspace) {
    let mut ws = Workspace::new(scene.tolerance());
    ws.search = 1.0;
    let vertex = Vertex::end(&Start::point(x, DVec3::Z, scene.medium_at(x)));
    let sampled = scene.emitters()[0].sample_end(scene.around(), |_| unreachable!(), [0.5; 2]);
    let target = ConnectionTarget::emitter(scene, 0, sampled.end);
    let mut sampler = Sampler::new(1, 0, 0);
    let found = Connection::each(
        scene,
        &vertex,
        &target,
        &mut sampler,
        &mut ws,
        |connection| Some(*connection),
    );
    assert!(found.iter().all(|(_, weight)| *weight == 1.0));
    (
        found
            .into_iter()
            .map(|(connection, _)| connection)
            .collect(),
        ws,
    )
}

/// Compares connections with the dense search. Returns the number of rays.
fn check(x: DVec3, y: DVec3) -> usize {
    let scene = scene(y);
    let (found, ws) = connections(&scene, x);
    assert_eq!(ws.stats.connections.searches, 0);
    // Allow a few more shots where rays lie close together at a caustic.
    let shots = ws.stats().work.shots;
    assert!(shots <= 2 * found.len() as u64, "{x} {y}: {shots}");
    let mut dense = Solver::new(Tolerance::new(1e-8));
    let all = dense.all(&scene, x, scene.medium_at(x), y, scene.branch_reach());
    let all = all.branches;
    assert_eq!(found.len(), all.len(), "{x} {y}: {found:?} {all:?}");
    let n = scene.n(scene.medium_at(y), y);
    for (_, ray) in &all {
        let same = |l: &&Connection| l.direction.distance(ray.direction_out) < 1e-4;
        let connection = found.iter().find(same).expect("one of the connections");
        let expected = 1.0 / (ray.jacobian * n * n);
        let off = (connection.geometry.geometry_term / expected - 1.0).abs();
        assert!(off < MAX_ERROR, "{x} {y}: {connection:?} {ray:?}");
    }
    found.len()
}

#[test]
fn every_ray_through_the_surface_is_found_for_certain() {
    let center = DVec3::new(0.3, -0.2, 0.1);
    let mut rng = Rng::new(71);
    let mut seen = [0; 5];
    for i in 0..24 {
        let mut direction = || DVec3::from_array(rng.direction());
        let inner = direction();
        let outer = (direction() - inner * [0.0, 4.0][i % 2]).normalize();
        let x = center + inner * (RADIUS * rng.range(0.3, 0.99));
        let y = center + outer * (RADIUS * rng.range(1.1, 3.0));
        seen[check(x, y)] += 1;
        check(y, x);
    }
    assert!(
        seen[0] > 0 && seen[1] > 0 && seen[2] + seen[3] > 0,
        "{seen:?}"
    );
}
