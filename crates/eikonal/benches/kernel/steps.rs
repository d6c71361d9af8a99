//! Costs of steps of rays, with and without tangents.

use crate::setup::{acoustic, ball_grid, bump, luneburg};
use crate::timing::{Task, race};
use glam::DVec3;
use morgana_eikonal::ray::{Flow, Node, Tangents, Variation, perpendicular_basis};
use morgana_eikonal::{Field, Tolerance, Work};
use std::hint::black_box;

const RAYS: usize = 64;
const ROUNDS: usize = 31;

pub fn run() {
    println!("\nsteps at tolerance 1e-6, per accepted step\n");
    println!(
        "{:20} {:>12} {:>12} {:>9} {:>16} {:>13}",
        "", "steps/s", "with tangents", "ratio", "step/evaluations", "same, tangents"
    );
    row("grid 64³", &ball_grid(), 0.25);
    row("Luneburg", &luneburg(), 0.8);
    row("Gaussian", &bump(), 0.8);
    row("acoustic, one mode", &acoustic(0.02), 0.8);
}

/// Starts on a sphere of the given radius, aimed close to its centre.
fn starts(radius: f64) -> Vec<(DVec3, DVec3)> {
    let spread = |i: usize| {
        let z = (i as f64 + 0.5) / RAYS as f64 * 2.0 - 1.0;
        let r = (1.0 - z * z).sqrt();
        let phi = i as f64 * 2.399_963;
        DVec3::new(r * phi.cos(), r * phi.sin(), z) * radius
    };
    let aim = |i: usize| (spread((i * 7 + 3) % RAYS) * 0.3 - spread(i)).normalize();
    (0..RAYS).map(|i| (spread(i), aim(i))).collect()
}

/// Traces rays across the ball. Returns the number of accepted steps.
fn rays<V: Variation>(field: &Field, radius: f64, variation: impl Fn(f64, DVec3) -> V) -> u64 {
    let mut work = Work::default();
    for (x, direction) in starts(radius) {
        let v = variation(field.n(x), direction);
        let node = Node::start(field, x, direction, v);
        let mut flow = Flow::new(field, node, Tolerance::default());
        let mut left = 2.0 * radius / field.n(x);
        while left > 1e-12 {
            left -= flow.advance(left, &mut work).arc.h();
        }
        black_box(flow.node().x);
    }
    work.steps
}

fn row(name: &str, field: &Field, radius: f64) {
    let tangents = |n, d| Tangents::angular(n, perpendicular_basis(d));
    let places: Vec<DVec3> = starts(radius)
        .iter()
        .map(|(x, d)| *x + *d * radius)
        .collect();
    // A step takes six evaluations. Its remaining time is its own arithmetic and control.
    let mut tasks: Vec<Task> = vec![
        Box::new(|| rays(field, radius, |_, _| ())),
        Box::new(|| rays(field, radius, tangents)),
        Box::new(|| evaluations(&places, |x| field.gradient(x).1)),
        Box::new(|| evaluations(&places, |x| field.jet(x).hess.x_axis)),
    ];
    let times = race(ROUNDS, &mut tasks);
    println!(
        "{name:20} {:12.3e} {:12.3e} {:9.2} {:16.2} {:13.2}",
        1.0 / times.of(0),
        1.0 / times.of(1),
        times.ratio(1, 0),
        times.ratio(0, 2),
        times.ratio(1, 3),
    );
}

/// Evaluates a function at every position, ninety times. One unit is the six evaluations of a step.
fn evaluations(places: &[DVec3], evaluate: impl Fn(DVec3) -> DVec3) -> u64 {
    let mut sum = DVec3::ZERO;
    for _ in 0..90 {
        for &x in places {
            sum += evaluate(black_box(x));
        }
    }
    black_box(sum);
    90 * places.len() as u64 / 6
}
