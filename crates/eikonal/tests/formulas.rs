//! Indices by formula and by table against the fields whose formulas they are, against closed forms of rays, and the refusal
//! of what is no formula.

mod common;

use common::{Random, assert_jets_agree};
use glam::DVec3;
use morgana_eikonal::field::*;
use morgana_eikonal::ray::{Flow, Node};
use morgana_eikonal::{Aabb, Field, Tolerance, Work};
use std::time::Instant;

fn region() -> Aabb {
    Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0))
}

fn with(text: &str, quantity: Quantity, parameters: &[(&str, f64)]) -> Field {
    Formula::new(text, quantity, parameters).unwrap().into()
}

/// The same field as a formula in x, y, z, as one in a distance, and as a type of its own. Both formulas round a few times
/// more than the field does.
fn alike() -> Vec<(&'static str, Field, [Field; 2])> {
    let bump = [("n0", 1.33), ("delta", 0.08), ("w", 0.4)];
    let n = Quantity::Index;
    let square = Quantity::SquaredIndex;
    let o = DVec3::ZERO;
    vec![
        (
            "gaussian",
            Gaussian::new(1.33, 0.08, o, 0.4).unwrap().into(),
            [
                with("n0 + delta*exp(-(x^2 + y^2 + z^2)/(2*w^2))", n, &bump),
                with("n0 + delta*exp(-r^2/(2*w^2))", n, &bump),
            ],
        ),
        (
            "selfoc",
            Selfoc::new(1.6, 0.5, o, DVec3::Z).unwrap().into(),
            [
                with("1.6^2*(1 - 0.25*(x*x + y*y))", square, &[]),
                with("1.6^2*(1 - (rho/2)^2)", square, &[]),
            ],
        ),
        (
            "fisheye",
            Fisheye::new(2.0, o, 0.8).unwrap().into(),
            [
                with("2/(1 + (x^2 + y^2 + z^2)/R^2)", n, &[("R", 0.8)]),
                with("2/(1 + r^2/R^2)", n, &[("R", 0.8)]),
            ],
        ),
    ]
}

#[test]
fn formulas_are_the_fields_that_they_write_out() {
    let mut random = Random(5);
    for (_, field, formulas) in alike() {
        for _ in 0..200 {
            let x = random.point(&region());
            for formula in &formulas {
                assert_jets_agree(field.jet(x), formula.jet(x), 3e-13);
            }
        }
        for formula in &formulas {
            assert_jets_agree(field.jet(DVec3::ZERO), formula.jet(DVec3::ZERO), 3e-13);
        }
    }
}

/// Seconds that `work` takes, at best of several times.
fn seconds(mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..15).map(time).fold(f64::INFINITY, f64::min)
}

/// Time by formula over that of the field of its own, for each way to ask. Run in a release build, by
/// `cargo test --release -p morgana-eikonal --test formulas -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn cost_beside_fields_of_their_own() {
    let mut random = Random(5);
    let points: Vec<DVec3> = (0..20_000).map(|_| random.point(&region())).collect();
    for (name, field, formulas) in alike() {
        let times = |field: &Field| {
            let field = field.prepared(&region());
            let sum = |f: &dyn Fn(DVec3) -> f64| {
                seconds(|| assert!(points.iter().map(|x| f(*x)).sum::<f64>().is_finite()))
            };
            let steps = std::cell::Cell::new(0);
            let rays = || {
                let mut work = Work::default();
                for x in &points[..200] {
                    let node = Node::start(&field, *x * 0.5, DVec3::Y, ());
                    let mut flow = Flow::new(&field, node, Tolerance::default());
                    let mut left = 1.0;
                    while left > 1e-9 {
                        left -= flow.advance(left, &mut work).arc.h();
                    }
                }
                steps.set(work.steps);
            };
            [
                sum(&|x| field.n2(x)),
                sum(&|x| field.gradient(x).1.x),
                sum(&|x| field.jet(x).hess.x_axis.y),
                sum(&|x| field.length_scale(x)),
                seconds(rays),
                1e-6 * f64::from(steps.get() as u32),
            ]
        };
        let own = times(&field);
        let per_point = own.map(|t| (1e10 * t / points.len() as f64).round() / 10.0);
        println!("{name}: {per_point:?} ns (n², gradient, jet, length scale; rays, steps)");
        for formula in &formulas {
            let times = times(formula);
            let ratios: Vec<f64> = times
                .iter()
                .zip(own)
                .map(|(t, own)| (100.0 * t / own).round() / 100.0)
                .collect();
            println!("    by formula: {ratios:?}");
        }
    }
}
