//! Connections through the wall of the lens, between the camera and uniform points inside.

use crate::clock::{median, race};
use crate::common::fan::Fan;
use crate::common::lens;
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::path::{Connection, ConnectionTarget, Start, Vertex, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::stats::Stats;
use testkit::Rng;

const ROUNDS: usize = 5;
const PAIRS: usize = 3000;
/// Smallest probability of a search for further branches in renders.
const MIN_SEARCH: f64 = 1.0 / 16.0;

pub fn table() {
    let scene = Scene::new(lens::scene()).expect("the scene is valid");
    let mut rng = Rng::new(27);
    let points: Vec<DVec3> = (0..PAIRS)
        .map(|_| DVec3::from_array(rng.direction()) * (lens::RADIUS * rng.next_1d().cbrt()))
        .collect();
    println!("connections through the wall of the lens, per pair");
    println!(
        "{:26} {:>8} {:>8} {:>8} {:>8} {:>9} {:>9} {:>9}",
        "", "µs", "shots", "evals", "found", "branches", "searched", "certified"
    );
    oracle(&points);
    for (name, from_camera) in [
        ("from inside", false),
        ("from the camera", true),
        ("from inside, to the light", false),
    ] {
        let end = if name.ends_with("light") {
            scene.point_end()
        } else {
            lens::eye()
        };
        row(&scene, name, &points, end, from_camera);
    }
}

trait PointEnd {
    fn point_end(&self) -> DVec3;
}

impl PointEnd for Scene {
    fn point_end(&self) -> DVec3 {
        match self.emitters()[0] {
            morgana_transport::emitter::Emitter::Point { position, .. } => position,
            _ => unreachable!("the lens is lit by a point"),
        }
    }
}

/// Prints the number of branches that a dense fan of rays from the camera finds.
fn oracle(points: &[DVec3]) {
    let fan = Fan::new(&lens::ball(), lens::DISTANCE);
    let count = |x: &DVec3| fan.count(x.length(), x.angle_between(lens::eye()));
    let counts: Vec<usize> = points.iter().map(count).collect();
    let share = counts.iter().filter(|n| **n > 0).count() as f64 / counts.len() as f64;
    let mean = counts.iter().sum::<usize>() as f64 / counts.len() as f64;
    println!(
        "{:26} {:>8} {:>8} {:>8} {:7.1}% {mean:9.3}",
        "a fan of rays (oracle)",
        "",
        "",
        "",
        100.0 * share
    );
}

/// Results of connecting all pairs.
struct Outcome {
    stats: Stats,
    /// Number of pairs with at least one branch.
    found: usize,
    /// Sum of the weights.
    branches: f64,
}

fn row(scene: &Scene, name: &str, points: &[DVec3], other: DVec3, from_other: bool) {
    let all = |search: f64| connect(scene, points, other, from_other, search);
    // Choose the search probability as the pilot of a render would.
    let counts = all(1.0).stats.connections;
    let search = (counts.secondary as f64 / counts.searches.max(1) as f64).clamp(MIN_SEARCH, 1.0);
    let outcome = all(search);
    let times = race(
        ROUNDS,
        &mut [&mut || {
            std::hint::black_box(all(search).found);
        }],
    );
    let per = |count: u64| count as f64 / points.len() as f64;
    println!(
        "{name:26} {:8.2} {:8.2} {:8.1} {:7.1}% {:9.3} {:9.3} {:9.3}",
        1e6 * median(times[0].iter().copied()) / points.len() as f64,
        per(outcome.stats.work.shots),
        per(outcome.stats.work.evaluations),
        100.0 * outcome.found as f64 / points.len() as f64,
        outcome.branches / points.len() as f64,
        per(outcome.stats.connections.searches),
        per(outcome.stats.connections.certified),
    );
}

fn connect(
    scene: &Scene,
    points: &[DVec3],
    other: DVec3,
    from_other: bool,
    search: f64,
) -> Outcome {
    let mut ws = Workspace::new(scene.tolerance());
    ws.search = search;
    let (mut found, mut branches) = (0, 0.0);
    for (i, point) in points.iter().enumerate() {
        let (x, y) = if from_other {
            (other, *point)
        } else {
            (*point, other)
        };
        let vertex = Vertex::end(&Start::point(x, DVec3::Z, scene.medium_at(x)));
        let end = ConnectionEnd::Point {
            position: y,
            surface: None,
        };
        let target = ConnectionTarget::sensor(scene, end);
        let mut sampler = Sampler::new(1, 0, i as u64);
        let values = Connection::each(scene, &vertex, &target, &mut sampler, &mut ws, |_| Some(()));
        found += usize::from(!values.is_empty());
        branches += values.iter().map(|((), weight)| weight).sum::<f64>();
    }
    Outcome {
        stats: ws.stats(),
        found,
        branches,
    }
}
