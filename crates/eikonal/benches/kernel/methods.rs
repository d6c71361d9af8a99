//! Methods that connect two points, side by side: morgana's solver, the plain shooting method,
//! morgana's solver from random directions, and the published method. A last table gives the cost
//! of the search for further branches, which the certificate saves.

use crate::plain::Plain;
use crate::published::{Effort, Method};
use crate::setup::{BALL, acoustic, ball_grid, in_ball, lumps, luneburg};
use crate::timing::{Task, race};
use glam::DVec3;
use morgana_eikonal::certificate::Uniqueness;
use morgana_eikonal::connect::{RayFamily, Reach, Unbounded, random_direction};
use morgana_eikonal::{Aabb, Field, Solver, Tolerance};
use std::hint::black_box;
use testkit::Rng;

const PAIRS: usize = 40;
const ROUNDS: usize = 7;
/// Tolerance of morgana's solver; directions are then good to 1e-5.
const TOLERANCE: f64 = 1e-4;
/// Accepted miss of the other methods, relative to the distance.
pub const MISS: f64 = 1e-5;
/// Steps of the plain shooting method, for directions about as accurate as morgana's.
pub const STEPS: usize = 8;
/// Largest angle in radians between two directions that count as one ray.
const SAME: f64 = 1e-2;
/// Number of runs per round, for the fast methods.
const REPEATS: u64 = 10;
/// Maximum number of random starts until the ray arrives, for the methods that start at random.
const RESTARTS: usize = 10;

/// Results of a method: a direction for each pair, and the work.
pub struct Outcome {
    pub directions: Vec<Option<DVec3>>,
    shots: u64,
    pub evaluations: u64,
}

pub type Pairs = [[DVec3; 2]];

/// A field with the radius of the ball in which pairs are drawn.
pub type Case = (&'static str, Field, f64);

/// The fields in which pairs are connected.
pub fn cases(rng: &mut Rng) -> [Case; 6] {
    [
        ("grid 64³, Δn 0.1", ball_grid(), BALL),
        ("Luneburg", luneburg(), 1.0),
        ("12 Gaussians, Δn ±0.03", lumps(0.03, rng), 1.0),
        ("12 Gaussians, Δn ±0.1", lumps(0.1, rng), 1.0),
        ("acoustic, Δn 1e-3", acoustic(1e-3), 1.0),
        ("acoustic, Δn 1e-2", acoustic(1e-2), 1.0),
    ]
}

/// Draws uniform pairs of points in a ball.
pub fn pairs(rng: &mut Rng, radius: f64, count: usize) -> Vec<[DVec3; 2]> {
    (0..count)
        .map(|_| [in_ball(rng, radius), in_ball(rng, radius)])
        .collect()
}

pub fn run() {
    println!(
        "\nways to connect uniform pairs in a ball, to a miss of {MISS:e}; ours at tolerance {TOLERANCE:e}"
    );
    println!(
        "time relative to the first; error: the largest of directions of the same ray\n\
         one restart = another random direction of the hemisphere about the chord, at most {RESTARTS}\n"
    );
    let mut rng = Rng::new(3);
    for (name, field, radius) in &cases(&mut rng) {
        let pairs = pairs(&mut rng, *radius, PAIRS);
        table(name, field, *radius, &pairs);
    }
}

fn table(name: &str, field: &Field, radius: f64, pairs: &Pairs) {
    let certificate = certificate(field, radius);
    let certified = pairs
        .iter()
        .filter(|p| unique(&certificate, field, p))
        .count();
    println!(
        "{name}: {} % of the pairs are certified",
        100 * certified / pairs.len()
    );
    let ways: [(&str, u64, &dyn Fn() -> Outcome); 6] = [
        ("collocation, else Newton", REPEATS, &|| {
            chord(field, pairs, TOLERANCE)
        }),
        ("chord, RKN4, Newton", REPEATS, &|| {
            plain(field, pairs, STEPS)
        }),
        ("random, Newton", REPEATS, &|| random(field, pairs)),
        ("random, BFGS, fixed step", 1, &|| {
            published(field, radius, pairs)
        }),
        ("chord + 1 random search", REPEATS, &|| {
            searched(field, pairs, None)
        }),
        ("same, if not certified", REPEATS, &|| {
            searched(field, pairs, Some(&certificate))
        }),
    ];
    let mut tasks: Vec<Task> = Vec::new();
    for (_, repeats, way) in &ways {
        tasks.push(Box::new(move || {
            (0..*repeats).for_each(|_| {
                black_box(way());
            });
            repeats * pairs.len() as u64
        }));
    }
    let times = race(ROUNDS, &mut tasks);
    drop(tasks);
    println!(
        "  {:26} {:>8} {:>7} {:>9} {:>14} {:>8} {:>8}",
        "", "found %", "shots", "evals", "connections/s", "time", "error"
    );
    let exact = chord(field, pairs, 1e-9).directions;
    for (i, (way, _, run)) in ways.iter().enumerate() {
        let outcome = run();
        let per = |count: u64| count as f64 / pairs.len() as f64;
        println!(
            "  {way:26} {:8.1} {:7.2} {:9.0} {:14.0} {:8.2} {:8.0e}",
            100.0 * per(outcome.directions.iter().flatten().count() as u64),
            per(outcome.shots),
            per(outcome.evaluations),
            1.0 / times.of(i),
            times.ratio(i, 0),
            worst(&outcome.directions, &exact),
        );
    }
}

/// Returns the largest error among directions that belong to one ray in both lists.
fn worst(directions: &[Option<DVec3>], exact: &[Option<DVec3>]) -> f64 {
    let errors = errors(directions, exact).into_iter();
    errors.filter(|&e| e < SAME).fold(0.0, f64::max)
}

/// Returns the errors of all directions, including those that belong to another ray. The error is
/// infinite where no direction was found.
pub fn errors(directions: &[Option<DVec3>], exact: &[Option<DVec3>]) -> Vec<f64> {
    let pairs = directions.iter().zip(exact);
    let error = |(a, b): (&Option<DVec3>, &Option<DVec3>)| Some((*a)?.distance((*b)?));
    pairs
        .map(|pair| error(pair).unwrap_or(f64::INFINITY))
        .collect()
}

fn certificate(field: &Field, radius: f64) -> Uniqueness {
    let corner = DVec3::splat(1.02 * radius);
    let region = Aabb::new(-corner, corner);
    Uniqueness::new(region, 2.0 * radius, field.bounds(&region))
}

fn unique(certificate: &Uniqueness, field: &Field, [x, y]: &[DVec3; 2]) -> bool {
    certificate.whole_medium() || certificate.pair(field, *x, *y)
}

fn outcome(directions: Vec<Option<DVec3>>, solver: &Solver<()>) -> Outcome {
    Outcome {
        directions,
        shots: solver.work.shots,
        evaluations: solver.work.evaluations,
    }
}

/// Connects the pairs by morgana's solver, from the chord.
pub fn chord(field: &Field, pairs: &Pairs, tolerance: f64) -> Outcome {
    let mut solver = Solver::new(Tolerance::new(tolerance));
    let connect = |[x, y]: &[DVec3; 2]| solver.connect(&Unbounded(field), *x, (), *y);
    let found = pairs.iter().map(connect);
    let directions = found.map(|c| Some(c.ok()?.direction_out)).collect();
    outcome(directions, &solver)
}

/// Connects the pairs by the plain shooting method from the chord, along rays of `steps` steps.
pub fn plain(field: &Field, pairs: &Pairs, steps: usize) -> Outcome {
    let way = Plain {
        steps,
        tolerance: MISS,
    };
    let mut effort = Effort::default();
    let connect = |pair: &[DVec3; 2]| way.connect(field, *pair, &mut effort);
    let directions = pairs.iter().map(connect).collect();
    effort.outcome(directions)
}

impl Effort {
    fn outcome(self, directions: Vec<Option<DVec3>>) -> Outcome {
        Outcome {
            directions,
            shots: self.shots,
            evaluations: self.evaluations,
        }
    }
}

/// Runs Newton's method from the closest approach of the ray in a direction.
fn from(
    solver: &mut Solver<()>,
    field: &Field,
    [x, y]: [DVec3; 2],
    direction: DVec3,
) -> Option<DVec3> {
    let reach = Reach {
        optical_length: 3.0 * x.distance(y) * field.n(x),
        reflections: 0,
        bounces: 0,
    };
    let (world, family) = (Unbounded(field), RayFamily::Point { x, direction });
    let (start, _) = solver.approach(&world, family, (), y, &reach, &mut || 0.0)?;
    Some(solver.solve(&world, &start, y).ok()?.direction_out)
}

/// Draws a uniform direction of the hemisphere about the chord.
fn hemisphere(rng: &mut Rng, [x, y]: [DVec3; 2]) -> DVec3 {
    let d = DVec3::from_array(rng.direction());
    if d.dot(y - x) < 0.0 { -d } else { d }
}

fn random(field: &Field, pairs: &Pairs) -> Outcome {
    let mut solver = Solver::new(Tolerance::new(TOLERANCE));
    let mut rng = Rng::new(4);
    let connect = |&pair: &[DVec3; 2]| {
        (0..RESTARTS).find_map(|_| from(&mut solver, field, pair, hemisphere(&mut rng, pair)))
    };
    let directions = pairs.iter().map(connect).collect();
    outcome(directions, &solver)
}

fn published(field: &Field, radius: f64, pairs: &Pairs) -> Outcome {
    let method = Method {
        step: 1e-3 * 2.0 * radius,
        longest: 6.0 * radius,
        tolerance: MISS,
    };
    let (mut effort, mut rng) = (Effort::default(), Rng::new(4));
    let connect = |&pair: &[DVec3; 2]| {
        (0..RESTARTS).find_map(|_| {
            let direction = hemisphere(&mut rng, pair);
            method.connect(field, pair, direction, &mut effort)
        })
    };
    let directions = pairs.iter().map(connect).collect();
    effort.outcome(directions)
}

/// Finds the primary branch, and starts one search for other branches, unless the certificate
/// excludes them.
fn searched(field: &Field, pairs: &Pairs, certificate: Option<&Uniqueness>) -> Outcome {
    let mut solver = Solver::new(Tolerance::new(TOLERANCE));
    let mut rng = Rng::new(5);
    let connect = |pair: &[DVec3; 2]| {
        let [x, y] = *pair;
        let found = solver.connect(&Unbounded(field), x, (), y).ok();
        if !certificate.is_some_and(|c| unique(c, field, pair)) {
            let u = std::array::from_fn(|_| rng.next_1d());
            black_box(from(&mut solver, field, *pair, random_direction(y - x, u)));
        }
        Some(found?.direction_out)
    };
    let directions = pairs.iter().map(connect).collect();
    outcome(directions, &solver)
}
