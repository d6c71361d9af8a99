//! Time of field evaluations, relative to the smallest number of multiply-adds that they need.

use crate::setup::{BALL, acoustic, ball_grid, bump, bump_grid, in_ball, lumps, luneburg};
use crate::timing::{Task, race};
use glam::DVec3;
use morgana_eikonal::Field;
use std::hint::black_box;
use testkit::Rng;

/// Multiply-adds of a value and a gradient. Contracting 4³ coefficients with the weights of value
/// and derivative takes 2·64 along the first axis, 3·16 along the second (value-value, value-first,
/// first-value), and 4·4 along the last.
const GRADIENT: u64 = 2 * 64 + 3 * 16 + 4 * 4;
/// Multiply-adds of a value, a gradient and a Hessian: three weights along the first axis, then six
/// combinations, then ten sums.
const JET: u64 = 3 * 64 + 6 * 16 + 10 * 4;

const POSITIONS: usize = 4096;
/// Samples along an edge of a grid that is too large for the caches.
const LARGE: usize = 384;
/// Number of positions, so large that the caches do not hold the coefficients that they touch.
const POINTS: usize = 1 << 17;
const ROUNDS: usize = 41;

pub fn run() {
    println!("\nevaluation: time / time of the multiply-adds of a tricubic spline");
    println!("({GRADIENT} for value and gradient, {JET} with the Hessian)\n");
    println!(
        "{:34} {:>9} {:>7} {:>9} {:>7}",
        "", "gradient", "ns", "+Hessian", "ns"
    );
    let mut rng = Rng::new(1);
    let grid = ball_grid();
    let ball = |rng: &mut Rng, r| (0..POSITIONS).map(|_| in_ball(rng, r)).collect::<Vec<_>>();
    let one_cell = vec![DVec3::new(0.011, 0.012, 0.013); POSITIONS];
    let start = DVec3::new(-0.17, 0.05, -0.02);
    let walk = (0..POSITIONS).map(|i| start + DVec3::X * (8e-5 * i as f64));
    row("grid 64³, one place (cached)", &grid, &one_cell);
    row("grid 64³, along a line", &grid, &walk.collect::<Vec<_>>());
    row("grid 64³, random places", &grid, &ball(&mut rng, BALL));
    let unit = ball(&mut rng, 1.0);
    row("Luneburg", &luneburg(), &unit);
    row("Gaussian", &bump(), &unit);
    row("sum of 12 Gaussians", &lumps(0.05, &mut rng), &unit);
    row("acoustic, one mode", &acoustic(0.02), &unit);
    large(&mut rng);
}

/// Times evaluations in a grid that is too large for the caches.
fn large(rng: &mut Rng) {
    let grid = bump_grid(LARGE);
    let spacing = 2.0 / (LARGE - 1) as f64;
    let places: Vec<_> = (0..POINTS).map(|_| in_ball(rng, 1.0)).collect();
    row("grid 384³, random places", &grid, &places);
    for steps in [0.3, 1.0, 4.0] {
        let mut places = Vec::new();
        while places.len() < POINTS {
            let (start, toward) = (in_ball(rng, 1.0), in_ball(rng, 1.0).normalize());
            let line = (0..).map(|i| start + toward * (steps * spacing * i as f64));
            places.extend(line.take_while(|x| x.length() < 1.0));
        }
        row(
            &format!("grid 384³, rays, every {steps} spacings"),
            &grid,
            &places,
        );
    }
}

fn row(name: &str, field: &Field, positions: &[DVec3]) {
    let gradient: Task = Box::new(|| {
        let mut sum = DVec3::ZERO;
        for &x in positions {
            let (n2, grad) = field.gradient(black_box(x));
            sum += grad * n2;
        }
        black_box(sum);
        positions.len() as u64
    });
    let jet: Task = Box::new(|| {
        let mut sum = DVec3::ZERO;
        for &x in positions {
            let jet = field.jet(black_box(x));
            sum += jet.hess * jet.grad * jet.n2;
        }
        black_box(sum);
        positions.len() as u64
    });
    // Try several numbers of accumulators: the one that fills the pipeline best depends on the
    // machine.
    let mut tasks = vec![gradient, jet, bound::<8>(), bound::<16>(), bound::<24>()];
    let times = race(ROUNDS, &mut tasks);
    let best = (2..5).min_by(|&a, &b| times.of(a).total_cmp(&times.of(b)));
    let unit = best.unwrap_or(2);
    println!(
        "{name:34} {:9.2} {:7.1} {:9.2} {:7.1}",
        times.ratio(0, unit) / GRADIENT as f64,
        times.of(0) * 1e9,
        times.ratio(1, unit) / JET as f64,
        times.of(1) * 1e9,
    );
}

/// Returns a task of multiply-adds in registers, on `N` accumulators.
fn bound<const N: usize>() -> Task<'static> {
    Box::new(|| {
        let mut sums = black_box([1.0_f64; N]);
        let (a, b) = (black_box(0.999_999), black_box(1e-6));
        let repeats = 600_000 / N;
        for _ in 0..repeats {
            for s in &mut sums {
                *s = *s * a + b;
            }
        }
        black_box(sums);
        (repeats * N) as u64
    })
}
