//! Work of fixed rays and connections: the test detects a slow-down on any machine, without a
//! clock.
//!
//! **To update** after a change that is meant to alter the work: run `cargo test -p morgana-eikonal
//! --test eikonal work_counters`, check that every change in the printed tables is an improvement
//! or worth its cost, and paste the tables over the constants.

use glam::DVec3;
use morgana_eikonal::connect::Unbounded;
use morgana_eikonal::field::{
    Acoustic, AcousticMode, Bspline, Constant, Gaussian, Luneburg, Placement,
};
use morgana_eikonal::ray::{Flow, Node, Tangents, perpendicular_basis};
use morgana_eikonal::{Aabb, Field, Solver, Tolerance, Work};
use testkit::Rng;

/// Name, tolerance, and sums over `RAYS` of the work: steps, rejected steps, evaluations, rays
/// traced.
type Row = (&'static str, f64, [u64; 4]);

/// Fraction by which counts may differ, plus two. The arithmetic is IEEE's everywhere, but exp, sin
/// and cos come from the platform's library. A different last bit can turn a step that is just
/// accepted into one that is rejected. Work that grows by less does not count as a slow-down.
const BAND: f64 = 0.02;

const RAYS: usize = 100;

const MARCHES: &[Row] = &[
    ("constant", 1e-4, [100, 0, 0, 0]),
    ("constant", 1e-6, [100, 0, 0, 0]),
    ("constant", 1e-8, [100, 0, 0, 0]),
    ("Luneburg", 1e-4, [147, 0, 882, 0]),
    ("Luneburg", 1e-6, [332, 0, 1992, 0]),
    ("Luneburg", 1e-8, [908, 0, 5448, 0]),
    ("bump", 1e-4, [278, 0, 1668, 0]),
    ("bump", 1e-6, [655, 59, 4284, 0]),
    ("bump", 1e-8, [1891, 56, 11682, 0]),
    ("sound", 1e-4, [261, 0, 1566, 0]),
    ("sound", 1e-6, [598, 46, 3864, 0]),
    ("sound", 1e-8, [1738, 58, 10776, 0]),
    ("grid", 1e-4, [327, 0, 1962, 0]),
    ("grid", 1e-6, [744, 0, 4464, 0]),
    ("grid", 1e-8, [2185, 11, 13176, 0]),
];

const CONNECTIONS: &[Row] = &[
    ("constant", 1e-4, [100, 0, 0, 100]),
    ("constant", 1e-6, [100, 0, 0, 100]),
    ("constant", 1e-8, [100, 0, 0, 100]),
    ("Luneburg", 1e-4, [0, 0, 708, 0]),
    ("Luneburg", 1e-6, [0, 0, 962, 0]),
    ("Luneburg", 1e-8, [0, 0, 1278, 0]),
    ("bump", 1e-4, [0, 0, 1322, 0]),
    ("bump", 1e-6, [86, 20, 2992, 8]),
    ("bump", 1e-8, [2342, 82, 16569, 98]),
    ("sound", 1e-4, [0, 0, 1282, 0]),
    ("sound", 1e-6, [0, 0, 2226, 0]),
    ("sound", 1e-8, [1828, 68, 13486, 78]),
    ("grid", 1e-4, [0, 0, 1332, 0]),
    ("grid", 1e-6, [346, 0, 4125, 32]),
    ("grid", 1e-8, [3427, 12, 22637, 135]),
];

fn fields() -> Vec<(&'static str, Field)> {
    let mode = AcousticMode::new(0.02, 1, 9.0, 0.3).unwrap();
    let bump = Gaussian::new(1.33, 0.1, DVec3::ZERO, 0.3).unwrap();
    let sampled = Field::from(bump);
    let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let grid = Bspline::from_fn([48; 3], cube, Placement::Nodes, |x| sampled.n(x));
    let sound = Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode]);
    vec![
        ("constant", Constant::new(1.5).into()),
        (
            "Luneburg",
            Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into(),
        ),
        ("bump", bump.into()),
        ("sound", sound.unwrap().into()),
        ("grid", grid.unwrap().into()),
    ]
}

/// Pairs of points of the ball of radius 0.9 around the origin.
fn pairs() -> Vec<[DVec3; 2]> {
    let mut rng = Rng::new(41);
    let mut point = || DVec3::from_array(rng.direction()) * (0.9 * rng.next_1d().cbrt());
    (0..RAYS).map(|_| [point(), point()]).collect()
}

/// Traces a ray with tangents over the span of σ in which a straight ray would reach the other
/// point.
fn march(field: &Field, [x, y]: [DVec3; 2], tolerance: Tolerance, work: &mut Work) {
    let direction = (y - x).normalize();
    let n = field.n(x);
    let tangents = Tangents::angular(n, perpendicular_basis(direction));
    let mut flow = Flow::new(field, Node::start(field, x, direction, tangents), tolerance);
    let mut left = x.distance(y) / n;
    while left > 1e-12 {
        left -= flow.advance(left, work).arc.h();
    }
}

fn marches(field: &Field, tolerance: Tolerance) -> Work {
    let mut work = Work::default();
    for pair in pairs() {
        march(field, pair, tolerance, &mut work);
    }
    work
}

fn connections(field: &Field, tolerance: Tolerance) -> Work {
    let mut solver = Solver::new(tolerance);
    for [x, y] in pairs() {
        solver.connect(&Unbounded(field), x, (), y).unwrap();
    }
    solver.work
}

/// Measures all fields and tolerances, prints the table in the form of the constants, and compares.
fn check(name: &str, measure: impl Fn(&Field, Tolerance) -> Work, expected: &[Row]) {
    let mut measured: Vec<Row> = Vec::new();
    for (field_name, field) in fields() {
        for tolerance in [1e-4, 1e-6, 1e-8] {
            let w = measure(&field, Tolerance::new(tolerance));
            let counts = [w.steps, w.rejected, w.evaluations, w.shots];
            measured.push((field_name, tolerance, counts));
        }
    }
    println!("const {name}: &[Row] = &[");
    for (field, tolerance, counts) in &measured {
        println!("    ({field:?}, {tolerance:e}, {counts:?}),");
    }
    println!("];");
    let near = |a: u64, b: u64| a.abs_diff(b) as f64 <= 2.0 + BAND * b as f64;
    let same = |(a, b): (&Row, &Row)| {
        (a.0, a.1) == (b.0, b.1) && a.2.iter().zip(b.2).all(|(&a, b)| near(a, b))
    };
    let differ = measured.iter().zip(expected).find(|&pair| !same(pair));
    assert!(
        differ.is_none() && measured.len() == expected.len(),
        "the work has changed (see above; how to update: top of the file): {differ:?}"
    );
}

#[test]
fn rays_take_as_many_steps_as_before() {
    check("MARCHES", marches, MARCHES);
}

#[test]
fn connections_take_as_many_shots_as_before() {
    check("CONNECTIONS", connections, CONNECTIONS);
}
