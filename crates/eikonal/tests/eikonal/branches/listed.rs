//! All branches against tables that were computed independently.

use crate::common::tables::{Table, tables};
use glam::DVec3;
use morgana_eikonal::connect::{InitialGuess, Piece, RayFamily, Reach, Unbounded};
use morgana_eikonal::{ConnectingRay, Solver, Tolerance};

/// The tables were searched up to σ = 40. Beyond this multiple of the longest ray that they list there is
/// none that stays in a domain, and so many in the graded rod, which goes on outside, that the search
/// takes minutes.
const REACH: f64 = 1.2;

/// J/n² in both directions, relative. Rays at the tolerance of 1e-12 are reciprocal to some 1e-11.
const RECIPROCITY: f64 = 1e-9;

/// What the search finds, over all pairs of a table.
#[derive(Default)]
struct Count {
    listed: usize,
    /// Found, but not listed: they leave the domain.
    outside: usize,
}

/// Searches every pair of a table and compares.
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
            // Where the index goes to zero, outside the domains, nothing can be computed to such digits.
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

/// Points all along a ray.
fn points(pieces: &[Piece<()>]) -> impl Iterator<Item = DVec3> {
    pieces
        .iter()
        .flat_map(|piece| (0..=8).map(|k| piece.arc.position(piece.theta_end * f64::from(k) / 8.0)))
}

/// A third of the pairs, or all of them.
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
    // Outside their domains the lens and the rod are followed into fields that no glass has.
    assert_eq!(outside, ["F2", "F3"]);
}

/// The relative difference of J/n² between a branch and the ray back from its end.
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
