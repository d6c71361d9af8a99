//! Connections against tables that were computed independently.
//!
//! `data/connections.json` lists, for eight fields, pairs of points and every ray between them, found
//! by dense multistart with scipy's DOP853 at rtol = atol = 1e-12 and the variational equations.

use eikonal::connect::Unbounded;
use eikonal::field::{Acoustic, AcousticMode, Fisheye, Gaussian, LinearIndex, Luneburg, Selfoc};
use eikonal::{Failure, Field, Solver, Tolerance};
use glam::DVec3;
use serde_json::Value;
use std::f64::consts::TAU;

/// The reference is good to about 1e-11; rays here keep 1e-10 per unit length, over a few units.
const DIRECTION: f64 = 1e-8;
/// The claim of the validation table: J to a relative 1e-6.
const JACOBIAN: f64 = 1e-6;
const LENGTH: f64 = 1e-8;

fn fields() -> Vec<(&'static str, Field)> {
    let mode = |order| AcousticMode::new(0.02, order, TAU / 0.6, 0.0).unwrap();
    // φ = atan2(y, z) about the x axis: φ = 0 along +z, and +y at φ = 90°.
    let acoustic =
        |order| Acoustic::new(1.3333, DVec3::ZERO, -DVec3::X, DVec3::Z, vec![mode(order)]).unwrap();
    let bump = Gaussian::new(1.33, 0.15, DVec3::ZERO, 0.25).unwrap();
    vec![
        (
            "F1",
            LinearIndex::new(1.3, DVec3::Y * 0.15, -DVec3::Y)
                .unwrap()
                .into(),
        ),
        ("F2", Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into()),
        (
            "F3",
            Selfoc::new(1.5, 0.4f64.sqrt(), DVec3::ZERO, DVec3::Z)
                .unwrap()
                .into(),
        ),
        ("F4", Fisheye::new(2.0, DVec3::ZERO, 1.0).unwrap().into()),
        ("F5", bump.into()),
        ("F5X", bump.into()),
        ("F6", acoustic(0).into()),
        ("F7", acoustic(3).into()),
    ]
}

fn vector(v: &Value) -> DVec3 {
    let c = |i: usize| v[i].as_f64().unwrap();
    DVec3::new(c(0), c(1), c(2))
}

#[test]
fn primary_branches_match_the_reference_tables() {
    let data: Value = serde_json::from_str(include_str!("data/connections.json")).unwrap();
    let mut report = String::new();
    let (mut failures, mut outside) = (Vec::new(), Vec::new());
    let (mut pairs, mut listed) = (0, 0);
    for (name, field) in fields() {
        let mut solver = Solver::new(Tolerance::new(1e-10));
        for pair in data["fields"][name]["pairs"].as_array().unwrap() {
            pairs += 1;
            let (x, y) = (vector(&pair["x"]), vector(&pair["y"]));
            assert!(
                (field.n(x) - pair["n_x"].as_f64().unwrap()).abs() < 1e-12,
                "{name}"
            );
            let id = pair["id"].as_str().unwrap();
            let found = match solver.connect(&Unbounded(&field), (x, ()), y) {
                Ok(found) => found,
                Err(failure) => {
                    failures.push((id.to_owned(), failure));
                    continue;
                }
            };
            let branches = pair["branches"].as_array().unwrap();
            let Some(branch) = branches
                .iter()
                .find(|b| vector(&b["direction_x"]).distance(found.direction_out) < DIRECTION)
            else {
                // The tables leave out branches that leave the field's domain: here the graded rod.
                let radius = |p: DVec3| p.truncate().length();
                let points = solver
                    .pieces()
                    .iter()
                    .map(|p| radius(p.arc.position(p.theta_end)));
                let leaves = name == "F3" && points.fold(0.0, f64::max) > 1.0;
                if leaves {
                    outside.push(id.to_owned());
                } else {
                    report += &format!("{id}: branch not listed, {found:?}\n");
                }
                continue;
            };
            listed += 1;
            let number = |key: &str| branch[key].as_f64().unwrap();
            let close = |a: f64, b: f64, tolerance: f64| (a - b).abs() <= tolerance * b.abs();
            let ok = vector(&branch["direction_y"]).distance(found.direction_in) < DIRECTION
                && close(found.arc_length, number("arc_length"), LENGTH)
                && close(found.optical_length, number("opl"), LENGTH)
                && close(found.sigma, number("sigma"), LENGTH)
                && close(found.jacobian, number("J"), JACOBIAN);
            if !ok {
                report += &format!("{id}: {found:?}\n  expected {branch}\n");
            }
        }
    }
    assert!(report.is_empty(), "{report}");
    // From the chord, the iteration comes to a local minimum of the miss for these two pairs, which
    // lie most of a pitch apart in the graded rod: a typed failure, not a wrong ray.
    let stuck = ["F3-p-08", "F3-p-09"].map(|id| (id.to_owned(), Failure::NotConverged));
    assert_eq!(failures, stuck);
    assert_eq!(outside, ["F3-p-11"]);
    assert_eq!(listed, pairs - stuck.len() - outside.len());
}
