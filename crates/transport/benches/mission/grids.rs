//! The index of the lens from grids of increasing size: evaluations along rays, and connections.

use crate::clock::{median, race};
use crate::common::lens;
use eikonal::connect::Unbounded;
use eikonal::{Field, Solver, Tolerance};
use glam::DVec3;
use std::hint::black_box;
use testkit::Rng;

/// Samples along an edge. The last two rows are condensed grids, as scenes hold them.
const SAMPLES: [usize; 6] = [64, 128, 384, 512, 384, 512];
const CONDENSED: std::ops::Range<usize> = 4..6;
/// Rows between which the exponents of growth are taken: with all samples, and with condensed ones.
const GROWTH: [[usize; 2]; 2] = [[1, 2], [1, 4]];
const ROUNDS: usize = 11;
/// Number of positions, so large that the caches do not hold the coefficients that they touch.
const PLACES: usize = 1 << 16;
const PAIRS: usize = 4000;

pub fn table() {
    println!("\nthe lens from grids of more samples");
    println!(
        "{:>12} {:>24} {:>24} {:>16} {:>10}",
        "samples", "jet every spacing, ns", "every 2 % of radius, ns", "connection, µs", "evals"
    );
    let rows: [usize; SAMPLES.len()] = std::array::from_fn(|row| row);
    let fields = rows.map(|row| match (CONDENSED.contains(&row), SAMPLES[row]) {
        (false, samples) => (lens::field_of(samples), format!("{samples}³")),
        (true, samples) => {
            let (field, held) = lens::condensed(samples);
            (field, format!("{samples}³ by {held}³"))
        }
    });
    let mut rng = Rng::new(29);
    let pairs: Vec<[DVec3; 2]> = (0..PAIRS)
        .map(|_| [inside(&mut rng), inside(&mut rng)])
        .collect();
    let places = SAMPLES.map(|samples| {
        let spacing = 2.04 * lens::RADIUS / (samples - 1) as f64;
        [spacing, 0.02 * lens::RADIUS].map(|step| along_rays(&mut rng, step))
    });
    let mut evaluations = [0; SAMPLES.len()];
    let rows = fields.iter().zip(&places).zip(&mut evaluations);
    let mut tasks: Vec<Box<dyn FnMut() + '_>> = Vec::new();
    for (((field, _), [fine, coarse]), evaluations) in rows {
        tasks.push(Box::new(|| jets(field, fine)));
        tasks.push(Box::new(|| jets(field, coarse)));
        tasks.push(Box::new(|| *evaluations = connect(field, &pairs)));
    }
    let mut turns: Vec<&mut dyn FnMut()> = Vec::new();
    turns.extend(tasks.iter_mut().map(|task| task as &mut dyn FnMut()));
    let times: Vec<f64> = race(ROUNDS, &mut turns).into_iter().map(median).collect();
    drop(turns);
    drop(tasks);
    for (((_, name), times), evaluations) in fields.iter().zip(times.chunks(3)).zip(evaluations) {
        println!(
            "{name:>12} {:24.0} {:24.0} {:16.2} {:10.1}",
            1e9 * times[0] / PLACES as f64,
            1e9 * times[1] / PLACES as f64,
            1e6 * times[2] / PAIRS as f64,
            evaluations as f64 / PAIRS as f64,
        );
    }
    for rows in GROWTH {
        let [from, to] = rows.map(|row| SAMPLES[row] as f64);
        let ratio = |values: [f64; 2]| (values[1] / values[0]).ln() / (to / from).ln();
        let time = |column: usize| ratio(rows.map(|row| times[3 * row + column]));
        println!(
            "exponents from {} to {}: {:.2}, {:.2}, {:.2}, {:.2}",
            fields[rows[0]].1,
            fields[rows[1]].1,
            time(0),
            time(1),
            time(2),
            ratio(rows.map(|row| evaluations[row] as f64)),
        );
    }
}

/// Draws a uniform point of the ball.
fn inside(rng: &mut Rng) -> DVec3 {
    DVec3::from_array(rng.direction()) * (lens::RADIUS * rng.next_1d().cbrt())
}

/// Returns positions along lines through the ball, a step apart.
fn along_rays(rng: &mut Rng, step: f64) -> Vec<DVec3> {
    let mut places = Vec::new();
    while places.len() < PLACES {
        let (start, direction) = (inside(rng), DVec3::from_array(rng.direction()));
        let line = (0..).map(|i| start + direction * (step * f64::from(i)));
        places.extend(line.take_while(|x| x.length() < lens::RADIUS));
    }
    places.truncate(PLACES);
    places
}

/// Evaluates value, gradient and Hessian at each position.
fn jets(field: &Field, places: &[DVec3]) {
    let mut sum = DVec3::ZERO;
    for &x in places {
        let jet = field.jet(black_box(x));
        sum += jet.hess * jet.grad * jet.n2;
    }
    black_box(sum);
}

/// Connects pairs at the default tolerance. Returns the number of evaluations.
fn connect(field: &Field, pairs: &[[DVec3; 2]]) -> u64 {
    let mut solver = Solver::new(Tolerance::default());
    let world = Unbounded(field);
    for [x, y] in pairs {
        let _ray = black_box(solver.connect(&world, *x, (), *y));
    }
    solver.work.evaluations
}
