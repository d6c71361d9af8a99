//! Connections between random pairs of points: connections per second, and the work of each.

use crate::setup::{BALL, acoustic, ball_grid, in_ball, lumps, luneburg, strong_sound};
use crate::timing::{Task, race};
use glam::DVec3;
use morgana_eikonal::connect::Unbounded;
use morgana_eikonal::{Field, Solver, Tolerance, Work};
use std::hint::black_box;
use testkit::Rng;

const PAIRS: usize = 400;
const ROUNDS: usize = 11;

pub fn run() {
    println!(
        "\nconnections of uniform pairs in a ball; cost in evaluations (gradients of starts among them), and"
    );
    println!("relative to as many bare evaluations with Hessian at random places\n");
    println!(
        "{:26} {:>9} {:>8} {:>6} {:>7} {:>6} {:>12} {:>10}",
        "", "tolerance", "found %", "shots", "steps", "evals", "connections/s", "time ratio"
    );
    let mut rng = Rng::new(2);
    let pairs = |rng: &mut Rng, r| {
        (0..PAIRS)
            .map(|_| [in_ball(rng, r), in_ball(rng, r)])
            .collect::<Vec<_>>()
    };
    let (small, unit) = (pairs(&mut rng, BALL), pairs(&mut rng, 1.0));
    let cases = [
        ("grid 64³, Δn 0.1", ball_grid(), &small),
        ("Luneburg", luneburg(), &unit),
        ("12 Gaussians, Δn ±0.03", lumps(0.03, &mut rng), &unit),
        ("12 Gaussians, Δn ±0.1", lumps(0.1, &mut rng), &unit),
        ("acoustic, Δn 1e-3", acoustic(1e-3), &unit),
        ("acoustic, Δn 1e-2", acoustic(1e-2), &unit),
        ("acoustic, Δn 0.05, k 30", strong_sound(), &unit),
    ];
    for (name, field, pairs) in &cases {
        for tolerance in [1e-5, 1e-6] {
            row(name, field, pairs, Tolerance::new(tolerance));
        }
    }
}

fn row(name: &str, field: &Field, pairs: &[[DVec3; 2]], tolerance: Tolerance) {
    let (found, work) = connect(field, pairs, tolerance);
    let per = |count: u64| count as f64 / pairs.len() as f64;
    let bare: Task = Box::new(|| {
        let mut sum = DVec3::ZERO;
        for i in 0..work.evaluations as usize {
            let x = pairs[i % pairs.len()][i / pairs.len() % 2];
            sum += field.jet(black_box(x)).hess.x_axis;
        }
        black_box(sum);
        pairs.len() as u64
    });
    let connections: Task = Box::new(|| {
        black_box(connect(field, pairs, tolerance));
        pairs.len() as u64
    });
    let times = race(ROUNDS, &mut [connections, bare]);
    println!(
        "{name:26} {:9.0e} {:8.1} {:6.2} {:7.1} {:6.1} {:12.0} {:10.2}",
        tolerance.get(),
        100.0 * per(found),
        per(work.shots),
        per(work.steps),
        per(work.evaluations),
        1.0 / times.of(0),
        times.ratio(0, 1),
    );
}

/// Connects every pair. Returns the number of rays found, and the work.
fn connect(field: &Field, pairs: &[[DVec3; 2]], tolerance: Tolerance) -> (u64, Work) {
    let mut solver = Solver::new(tolerance);
    let world = Unbounded(field);
    let found = pairs
        .iter()
        .filter(|[x, y]| solver.connect(&world, *x, (), *y).is_ok());
    (found.count() as u64, solver.work)
}
