//! Branches at the smallest tolerances, where double precision is nearly used up. A coarser search
//! supplies the start for every ray of the tables, from either end; the solver must then find the
//! ray again. Rounding loses a ray at random, so the test tries several starts for each.

use crate::common::tables::tables;
use glam::DVec3;
use morgana_eikonal::connect::{InitialGuess, Pattern, RayFamily, Unbounded};
use morgana_eikonal::{Solver, Tolerance};

/// Tolerances, from the smallest possible.
const TOLERANCES: [f64; 3] = [1e-12, 3e-12, 5e-12];
/// Tolerances of the coarser searches. The long test tries all of them.
const COARSER_TOLERANCES: [f64; 3] = [1e-6, 1e-5, 1e-7];

fn start(x: DVec3, direction: DVec3, optical_length: f64) -> InitialGuess<()> {
    InitialGuess {
        family: RayFamily::Point { x, direction },
        region: (),
        optical_length,
        pattern: Pattern::REFRACT,
    }
}

#[test]
fn no_branch_is_lost_at_the_smallest_tolerances() {
    let coarser = if super::long() {
        &COARSER_TOLERANCES[..]
    } else {
        &COARSER_TOLERANCES[..1]
    };
    let mut tried = 0;
    let mut lost = Vec::new();
    for table in tables() {
        let world = Unbounded(&table.field);
        let branches = table
            .pairs
            .iter()
            .flat_map(|p| p.branches.iter().map(move |b| (p, b)));
        for (pair, branch) in branches {
            let [a, b] = pair.ends;
            let both = [(a, b, branch.direction_out), (b, a, -branch.direction_in)];
            for (x, y, direction) in both {
                for &coarser in coarser {
                    let listed = start(x, direction, branch.optical_length);
                    let mut solver = Solver::new(Tolerance::new(coarser));
                    let rough = solver.solve(&world, &listed, y).unwrap();
                    let again = start(x, rough.direction_out, rough.optical_length);
                    for tolerance in TOLERANCES {
                        let found = Solver::new(Tolerance::new(tolerance)).solve(&world, &again, y);
                        tried += 1;
                        match found {
                            Ok(ray) => assert!(ray.direction_out.distance(direction) < 1e-8),
                            Err(why) => lost.push(format!("{} at {tolerance:e}: {why}", pair.id)),
                        }
                    }
                }
            }
        }
    }
    assert_eq!(tried, 2 * 133 * coarser.len() * TOLERANCES.len());
    assert!(lost.is_empty(), "{} of {tried}: {lost:#?}", lost.len());
}
