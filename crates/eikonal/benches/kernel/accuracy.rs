//! Cost of a given accuracy of directions, for morgana's solver and for the plain shooting method.
//! Each method runs at the cheapest setting that reaches the accuracy.

use crate::methods::{self, MISS, Outcome, Pairs, cases, chord, errors, pairs, plain};
use crate::timing::{Task, race};
use morgana_eikonal::Field;
use std::hint::black_box;
use testkit::Rng;

/// Required accuracy of directions, in radians. A fraction [`EXCEPT`] of the pairs may exceed it.
const ACCURACY: f64 = 1e-5;
/// Fraction of the pairs that may exceed [`ACCURACY`]: next to foci errors have no bound.
const EXCEPT: f64 = 0.01;
const PAIRS: usize = 1000;
const ROUNDS: usize = 15;
/// Tolerances of morgana's solver, loosest first.
const TOLERANCES: [f64; 8] = [1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6];
/// Numbers of steps of the plain shooting method, fewest first.
const STEPS: std::ops::RangeInclusive<usize> = 3..=40;

pub fn run() {
    println!(
        "\ndirections of {PAIRS} uniform pairs in a ball, {} % good to {ACCURACY:e}: ours at the loosest tolerance that does\n\
         it, beside Newton's method from the chord to a miss of {MISS:e}, by rays of the fewest steps that do it and of {}\n",
        100.0 * (1.0 - EXCEPT),
        methods::STEPS
    );
    println!(
        "  {:24} {:>9} {:>6} {:>14} {:>6} {:>6} {:>6} {:>6} {:>6}",
        "", "tolerance", "evals", "connections/s", "steps", "evals", "time", "evals", "time"
    );
    let mut rng = Rng::new(6);
    for (name, field, radius) in &cases(&mut rng) {
        row(name, field, &pairs(&mut rng, *radius, PAIRS));
    }
}

fn row(name: &str, field: &Field, pairs: &Pairs) {
    let exact = chord(field, pairs, 1e-9).directions;
    let good = |outcome: Outcome| {
        let mut errors = errors(&outcome.directions, &exact);
        errors.sort_by(f64::total_cmp);
        errors[((1.0 - EXCEPT) * pairs.len() as f64) as usize] <= ACCURACY
    };
    let ours = TOLERANCES.iter().find(|t| good(chord(field, pairs, **t)));
    let fewest = STEPS.into_iter().find(|s| good(plain(field, pairs, *s)));
    let (Some(&tolerance), Some(fewest)) = (ours, fewest) else {
        println!("  {name:24} not reached");
        return;
    };
    let ways: [&dyn Fn() -> Outcome; 3] = [
        &|| chord(field, pairs, tolerance),
        &|| plain(field, pairs, fewest),
        &|| plain(field, pairs, methods::STEPS),
    ];
    let mut tasks: Vec<Task> = Vec::new();
    for way in ways {
        tasks.push(Box::new(move || black_box(way()).directions.len() as u64));
    }
    let times = race(ROUNDS, &mut tasks);
    let [own, least, usual] = ways.map(|way| way().evaluations as f64 / pairs.len() as f64);
    println!(
        "  {name:24} {tolerance:9.0e} {own:6.1} {:14.0} {fewest:6} {least:6.1} {:6.2} {usual:6.1} {:6.2}",
        1.0 / times.of(0),
        times.ratio(1, 0),
        times.ratio(2, 0),
    );
}
