//! Connections within one unbounded field.

use crate::clock::{median, race};
use crate::common::lens;
use eikonal::connect::Unbounded;
use eikonal::field::{Acoustic, AcousticMode};
use eikonal::ray::Work;
use eikonal::{Field, Solver, Tolerance};
use glam::DVec3;
use std::hint::black_box;
use testkit::Rng;

const ROUNDS: usize = 101;
const PAIRS: usize = 4000;

/// A field, the radius of the ball in which it is used, and the tolerance of rays.
struct Case {
    name: &'static str,
    field: Field,
    radius: f64,
    tolerance: Tolerance,
}

pub fn table() {
    let grid = lens::field();
    let lens = |name, tolerance| Case {
        name,
        field: grid.clone(),
        radius: lens::RADIUS,
        tolerance,
    };
    let mode = AcousticMode::new(0.05, 0, 30.0, 0.0).expect("the mode is valid");
    let sound = Acoustic::new(1.33, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode]);
    let cases = [
        lens("lens, default tolerance", Tolerance::default()),
        lens("lens, 1e-4", Tolerance::new(1e-4)),
        lens("lens, 1e-5", Tolerance::new(1e-5)),
        lens("lens, 1e-3", Tolerance::new(1e-3)),
        Case {
            name: "sound, Δn 0.05, k = 30, 1e-5",
            field: sound.expect("the field is valid").into(),
            radius: 0.3,
            tolerance: Tolerance::new(1e-5),
        },
    ];
    println!("\nconnections within one field, per pair");
    println!(
        "{:30} {:>8} {:>8} {:>8} {:>8}",
        "", "µs", "shots", "evals", "found"
    );
    let pairs = cases.each_ref().map(|case| pairs(case.radius));
    let mut counts = [(); 5].map(|()| (Work::default(), 0));
    let mut tasks: Vec<_> = cases
        .iter()
        .zip(&pairs)
        .zip(&mut counts)
        .map(|((case, pairs), counts)| move || *counts = connect(case, pairs))
        .collect();
    let mut turns: Vec<&mut dyn FnMut()> = Vec::new();
    turns.extend(tasks.iter_mut().map(|task| task as &mut dyn FnMut()));
    let times = race(ROUNDS, &mut turns);
    for ((case, (work, found)), times) in cases.iter().zip(counts).zip(times) {
        let per = |count: u64| count as f64 / PAIRS as f64;
        println!(
            "{:30} {:8.2} {:8.2} {:8.1} {:7.1}%",
            case.name,
            1e6 * median(times) / PAIRS as f64,
            per(work.shots),
            per(work.evaluations),
            100.0 * per(found)
        );
    }
}

/// Pairs of points that are spread evenly over a ball around the origin.
fn pairs(radius: f64) -> Vec<[DVec3; 2]> {
    let mut rng = Rng::new(28);
    let mut point = || DVec3::from_array(rng.direction()) * (radius * rng.next_1d().cbrt());
    (0..PAIRS).map(|_| [point(), point()]).collect()
}

fn connect(case: &Case, pairs: &[[DVec3; 2]]) -> (Work, u64) {
    let mut solver = Solver::new(case.tolerance);
    let world = Unbounded(&case.field);
    let mut found = 0;
    for [x, y] in pairs {
        let ray = black_box(solver.connect(&world, *x, (), *y));
        found += u64::from(ray.is_ok());
    }
    (solver.work, found)
}
