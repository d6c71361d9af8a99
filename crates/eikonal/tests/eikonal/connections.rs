//! Primary branches against tables that were computed independently.

use crate::common::tables::tables;
use morgana_eikonal::connect::Unbounded;
use morgana_eikonal::{Failure, Solver, Tolerance};

#[test]
fn primary_branches_match_the_reference_tables() {
    let mut report = String::new();
    let (mut failures, mut outside) = (Vec::new(), Vec::new());
    let (mut pairs, mut listed) = (0, 0);
    for table in tables() {
        let mut solver = Solver::new(Tolerance::new(1e-10));
        for pair in &table.pairs {
            pairs += 1;
            let (id, [x, y]) = (&pair.id, pair.ends);
            let found = match solver.connect(&Unbounded(&table.field), x, (), y) {
                Ok(found) => found,
                Err(failure) => {
                    failures.push((id.as_str().to_owned(), failure));
                    continue;
                }
            };
            let Some(branch) = pair.branches.iter().find(|b| b.is(&found)) else {
                // The tables leave out branches that leave the field's domain: here the graded rod.
                let mut ends = solver.pieces().iter().map(|p| p.arc.position(p.theta_end));
                if ends.any(|p| !table.contains(p)) {
                    outside.push(id.to_owned());
                } else {
                    report += &format!("{id}: branch not listed, {found:?}\n");
                }
                continue;
            };
            listed += 1;
            if !branch.agrees(&found, table.field.n2(x)) {
                report += &format!("{id}: {found:?}\n  expected {branch:?}\n");
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
