//! Errors of rays against field evaluations, for several methods of equal steps and for morgana's
//! flow, which chooses its own steps.

use crate::setup::{BALL, acoustic, ball_grid, bump, in_ball, luneburg};
use glam::DVec3;
use morgana_eikonal::ray::{Flow, Node};
use morgana_eikonal::{Field, Tolerance, Work};
use testkit::Rng;

const RAYS: usize = 300;
/// Numbers of field evaluations per ray.
const BUDGETS: [usize; 5] = [12, 24, 48, 96, 192];

/// Splitting method: kicks of the velocity alternate with drifts of the position. It begins and
/// ends with a kick. The last kick of a step and the first of the next share an evaluation.
struct Splitting {
    kicks: Vec<f64>,
    drifts: Vec<f64>,
}

impl Splitting {
    /// Creates a symmetric method from its first kicks and drifts. The last kick and the last drift
    /// follow, because the coefficients of a step add up to one.
    fn symmetric(kicks: &[f64], drifts: &[f64], middle_is_kick: bool) -> Self {
        let half = |c: &[f64], middle: bool| {
            let sum: f64 = c.iter().sum();
            let mut all = c.to_vec();
            all.push(if middle { 1.0 - 2.0 * sum } else { 0.5 - sum });
            let mirrored: Vec<f64> = all
                .iter()
                .rev()
                .skip(usize::from(middle))
                .copied()
                .collect();
            all.extend(mirrored);
            all
        };
        Splitting {
            kicks: half(kicks, middle_is_kick),
            drifts: half(drifts, !middle_is_kick),
        }
    }

    fn shoot(&self, field: &Field, [mut x, mut v]: [DVec3; 2], sigma: f64, steps: usize) -> DVec3 {
        let h = sigma / steps as f64;
        let mut a = field.gradient(x).1 * 0.5;
        for _ in 0..steps {
            v += a * (self.kicks[0] * h);
            for (drift, kick) in self.drifts.iter().zip(&self.kicks[1..]) {
                x += v * (drift * h);
                a = field.gradient(x).1 * 0.5;
                v += a * (kick * h);
            }
        }
        x
    }
}

/// Traces a ray by the classical Runge–Kutta–Nyström method of fourth order, with three evaluations
/// per step.
fn nystrom(field: &Field, [mut x, mut v]: [DVec3; 2], sigma: f64, steps: usize) -> DVec3 {
    let h = sigma / steps as f64;
    let force = |x: DVec3| field.gradient(x).1 * 0.5;
    for _ in 0..steps {
        let a = force(x);
        let b = force(x + v * (0.5 * h) + a * (0.125 * h * h));
        let c = force(x + v * h + b * (0.5 * h * h));
        x += v * h + (a + b * 2.0) * (h * h / 6.0);
        v += (a + b * 4.0 + c) * (h / 6.0);
    }
    x
}

/// Names of the methods, their evaluations per step, and their coefficients. Sources: Yoshida 1990;
/// Blanes and Moan 2002, SRKN₆ᵇ (which the flow uses) and SRKN₁₁ᵇ.
fn methods() -> [(&'static str, usize, Option<Splitting>); 5] {
    let root = 2f64.cbrt();
    let yoshida = 1.0 / (2.0 - root);
    let six = [0.0829844064174052, 0.396309801498368, -0.0390563049223486];
    let eleven = [
        0.0414649985182624,
        0.198128671918067,
        -0.0400061921041533,
        0.0752539843015807,
        -0.0115113874206879,
    ];
    let drifts = [
        0.123229775946271,
        0.290553797799558,
        -0.127049212625417,
        -0.246331761062075,
        0.357208872795928,
    ];
    let split = Splitting::symmetric;
    [
        ("leapfrog, order 2", 1, Some(split(&[], &[], false))),
        (
            "Yoshida, order 4",
            3,
            Some(split(&[0.5 * yoshida], &[yoshida], false)),
        ),
        ("RKN4, order 4", 3, None),
        (
            "SRKN6b, order 4",
            6,
            Some(split(&six, &[0.245298957184271, 0.604872665711080], true)),
        ),
        ("SRKN11b, order 6", 11, Some(split(&eleven, &drifts, false))),
    ]
}

pub fn run() {
    println!("\nwork and precision: rms error of the ends of rays, relative to their length");
    println!("rays between uniform points of a ball, by evaluations of the gradient per ray\n");
    let cases = [
        ("Luneburg", luneburg(), 1.0),
        ("Gaussian", bump(), 1.0),
        ("acoustic, Δn 0.02", acoustic(0.02), 1.0),
        ("grid 64³, Δn 0.1", ball_grid(), BALL),
    ];
    for (name, field, radius) in cases {
        let mut rng = Rng::new(6);
        let rays: Vec<Ray> = (0..RAYS)
            .map(|_| Ray::new(&field, radius, &mut rng))
            .collect();
        table(name, &field, &rays);
    }
}

fn table(name: &str, field: &Field, rays: &[Ray]) {
    println!("{name:22} {}", BUDGETS.map(|n| format!("{n:>9}")).concat());
    for (method, evaluations, splitting) in methods() {
        let row = BUDGETS.map(|budget| {
            let steps = (budget / evaluations).max(1);
            let end = |ray: &Ray| match &splitting {
                Some(method) => method.shoot(field, ray.start, ray.sigma, steps),
                None => nystrom(field, ray.start, ray.sigma, steps),
            };
            format!("{:9.0e}", rms(rays.iter().map(|ray| ray.error(end(ray)))))
        });
        println!("  {method:20} {}", row.concat());
    }
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let mut work = Work::default();
        let error = rms(rays.iter().map(|ray| {
            let end = ray.flow(field, Tolerance::new(tolerance), &mut work);
            ray.error(end)
        }));
        let evaluations = work.evaluations as f64 / rays.len() as f64;
        println!("  flow at {tolerance:.0e}        {evaluations:6.1} evaluations, {error:.0e}");
    }
    println!();
}

struct Ray {
    start: [DVec3; 2],
    sigma: f64,
    length: f64,
    exact: DVec3,
}

impl Ray {
    /// Creates a ray from one uniform point of the ball towards another.
    fn new(field: &Field, radius: f64, rng: &mut Rng) -> Self {
        let [x, y] = [in_ball(rng, radius), in_ball(rng, radius)];
        let (n, length) = (field.n(x), x.distance(y));
        let mut ray = Ray {
            start: [x, (y - x) / length * n],
            sigma: length / n,
            length,
            exact: y,
        };
        ray.exact = ray.flow(field, Tolerance::new(1e-11), &mut Work::default());
        ray
    }

    fn flow(&self, field: &Field, tolerance: Tolerance, work: &mut Work) -> DVec3 {
        let [x, v] = self.start;
        let mut flow = Flow::new(field, Node::new(field, x, v, ()), tolerance);
        let mut left = self.sigma;
        while left > 1e-13 * self.sigma {
            left -= flow.advance(left, work).arc.h();
        }
        flow.node().x
    }

    fn error(&self, end: DVec3) -> f64 {
        end.distance(self.exact) / self.length
    }
}

fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = errors.fold((0.0, 0.0), |(s, n), e| (s + e * e, n + 1.0));
    f64::sqrt(sum / count)
}
