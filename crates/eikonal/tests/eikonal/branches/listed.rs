//! All branches, compared with independently computed tables.

use crate::common::tables::{Table, tables};
use glam::DVec3;
use morgana_eikonal::connect::{InitialGuess, Piece, RayFamily, Reach, Unbounded};
use morgana_eikonal::{ConnectingRay, Solver, Tolerance};

/// Longest optical path of the search, relative to the longest listed ray of a table. The tables
/// were searched up to σ = 40. Beyond this multiple no ray stays in a domain. The graded rod
/// continues outside its domain: rays beyond this multiple are so numerous that the search takes
/// minutes.
const REACH: f64 = 1.2;

/// Allowed relative difference of J/n² between both directions. Rays at the tolerance of 1e-12 are
/// reciprocal to about 1e-11.
const RECIPROCITY: f64 = 1e-9;

/// Numbers of branches that the search finds, over all pairs of a table.
#[derive(Default)]
struct Count {
    listed: usize,
    /// Branches found but not listed, because they leave the domain.
    outside: usize,
}

/// Searches every pair of a table, and compares the branches with the listed ones.
fn search(table: &Table, report: &mut String) -> Count {
    let world = Unbounded(&table.field);
    let reach = Reach {
        optical_length: REACH * table.longest(),
        reflections: 0,
        bounces: u32::MAX,
    };
    let mut solver = Solver::new(Tolerance::new(1e-10));
    let mut count = Count::default();
    for pair in &table.pairs {
        let [x, y] = pair.ends;
        let found = solver.all(&world, x, (), y, &reach).branches;
        for branch in &pair.branches {
            let agrees =
                |f: &&(InitialGuess<()>, ConnectingRay)| branch.agrees(&f.1, table.field.n2(x));
            match found.iter().filter(agrees).count() {
                1 => count.listed += 1,
                n => *report += &format!("{}: found {n} times: {branch:?}\n", pair.id),
            }
        }
        for (start, branch) in &found {
            let again = solver.solve(&world, start, y).unwrap();
            assert_eq!(again.shots, 1);
            assert!(again.same_branch(branch, 1e-9, 1e-9));
            let listed = pair.branches.iter().any(|b| b.is(branch));
            let stays = points(solver.pieces()).all(|p| table.contains(p));
            if stays != listed {
                *report += &format!("{}: not listed: {branch:?}\n", pair.id);
            }
            count.outside += usize::from(!stays);
            // Skip rays outside the domains on which the index approaches zero: they cannot be
            // computed to this accuracy.
            if points(solver.pieces()).all(|p| table.field.n2(p) > 0.5) {
                let asymmetry = asymmetry(&world, start, y);
                if asymmetry > RECIPROCITY {
                    *report += &format!("{}: {asymmetry:e}: {branch:?}\n", pair.id);
                }
            }
        }
    }
    count
}

/// Returns points along a ray.
fn points(pieces: &[Piece<()>]) -> impl Iterator<Item = DVec3> {
    pieces
        .iter()
        .flat_map(|piece| (0..=8).map(|k| piece.arc.position(piece.theta_end * f64::from(k) / 8.0)))
}

/// Searches a third of the pairs, or all of them in the long test.
#[test]
fn every_listed_branch_is_found_and_no_other_that_stays_in_the_domain() {
    let every = if super::long() { 1 } else { 3 };
    let mut report = String::new();
    let mut outside = Vec::new();
    for mut table in tables() {
        let mut number = 0..;
        table
            .pairs
            .retain(|_| number.next().is_some_and(|i| i % every == 0));
        let count = search(&table, &mut report);
        let listed: usize = table.pairs.iter().map(|p| p.branches.len()).sum();
        assert_eq!(count.listed, listed, "{}: {report}", table.name);
        if count.outside > 0 {
            outside.push(table.name);
        }
    }
    assert!(report.is_empty(), "{report}");
    // Outside their domains, the lens and the rod continue as fields that no glass has.
    assert_eq!(outside, ["F2", "F3"]);
}

/// Returns the relative difference of J/n² between a branch and the reverse ray from its end.
fn asymmetry(world: &Unbounded, start: &InitialGuess<()>, y: DVec3) -> f64 {
    let mut solver = Solver::new(Tolerance::new(1e-12));
    let there = solver.solve(world, start, y).unwrap();
    let back = InitialGuess {
        family: RayFamily::Point {
            x: y,
            direction: -there.direction_in,
        },
        ..*start
    };
    let x = start.family.x();
    let back = solver.solve(world, &back, x).unwrap();
    assert!(back.direction_in.distance(-there.direction_out) < 1e-9);
    let [forth, back] = [(there, x), (back, y)].map(|(c, from)| c.jacobian / world.0.n2(from));
    (forth / back - 1.0).abs()
}
