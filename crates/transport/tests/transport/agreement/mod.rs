//! Agreement of estimators (docs/theory.md#estimators). They share a scene and little else.
//!
//! The path tracer starts from the sensor, the particle tracer from the light, and bidirectional
//! path tracing weighs both with all strategies between. An error of one estimator in a geometry
//! term, a density, a factor of an index or a branch shows as a difference of means.
//!
//! False-alarm rate: 1e-3 for each of the tests below, over all its comparisons, with fixed seeds.
//!
//! The whole matrix, with its table in `docs/agreement.md` (without `MORGANA_LONG_TESTS`: the few
//! scenes that are always rendered): `MORGANA_LONG_TESTS=1 MORGANA_WRITE_DOCS=1 cargo test
//! --release -p morgana-transport --test transport agreement`

mod branches;
mod case;
pub mod compare;
mod matrix;
mod pooled;
mod shading;
mod steep;
mod surfaces;

pub use case::cloud;
use case::{Index, Light, Matter, View, Wall};
use compare::{Effort, Row, compare, detectable, judge, table};
use matrix::{covering, levels, pairs, whole};
use pooled::{Pooled, pool};
use std::collections::HashSet;
use testkit::z_test::threshold;

const RATE: f64 = 1e-3;

fn long() -> bool {
    std::env::var_os("MORGANA_LONG_TESTS").is_some()
}

fn rows(cases: &[case::Case], effort: Effort) -> Vec<Row> {
    let all = whole();
    cases
        .iter()
        .map(|case| {
            let seed = all.iter().position(|c| c == case).unwrap() as u64;
            let name = format!(
                "{:?}, {:?}, {:?}, {:?}, {:?}",
                case.index, case.light, case.matter, case.wall, case.view
            );
            let particles = case.particle_effort(effort);
            let started = std::time::Instant::now();
            let row = compare(&name, &case.parts(), effort, seed, particles);
            print!("{:.1} s ", started.elapsed().as_secs_f64());
            println!(
                "{}",
                table(std::slice::from_ref(&row), RATE, effort)
                    .lines()
                    .nth(2)
                    .unwrap()
            );
            row
        })
        .collect()
}

/// Compares estimators in one cheap scene that reveals planted errors: an emitter that only
/// connections find, through a thin lens, with a reconstruction filter wider than a pixel.
#[test]
fn estimators_agree_quickly() {
    let effort = Effort {
        batches: 12,
        work: 1_500_000,
    };
    let case = case::Case {
        index: Index::LinearSquare,
        light: Light::Point,
        matter: Matter::Fog,
        wall: Wall::Matched,
        view: View::Lens,
    };
    let row = compare("quick", &case.parts(), effort, 5001, Some(effort));
    println!("{}", table(std::slice::from_ref(&row), RATE, effort));
    judge(&[row], &[], RATE).unwrap();
}

#[test]
fn estimators_agree() {
    let (cases, effort) = if long() {
        (
            whole(),
            Effort {
                batches: 24,
                work: 600_000,
            },
        )
    } else {
        (
            covering(),
            Effort {
                batches: 12,
                work: 75_000,
            },
        )
    };
    let rows = rows(&cases, effort);
    let pooled = by_level(&cases, &rows);
    println!("{}", pooled::table(&pooled, 1.0));
    if std::env::var_os("MORGANA_WRITE_DOCS").is_some() {
        let text = document(&rows, &pooled, effort);
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/agreement.md");
        std::fs::write(path, text).unwrap();
    }
    judge(&rows, &pooled, RATE).unwrap();
}

/// Deviations pooled over all scenes, and over the scenes of each level.
fn by_level(cases: &[case::Case], rows: &[Row]) -> Vec<Pooled> {
    let mut names: Vec<String> = Vec::new();
    for level in cases.iter().flat_map(levels) {
        if !names.contains(&level) {
            names.push(level);
        }
    }
    names.sort();
    let of = |name: &String| {
        let with = cases.iter().zip(rows);
        let with = with.filter(|(case, _)| levels(case).contains(name));
        pool(name, &with.map(|(_, row)| row).collect::<Vec<_>>())
    };
    let every = pool("all", &rows.iter().collect::<Vec<_>>());
    std::iter::once(every)
        .chain(names.iter().map(of))
        .filter(|p| p.scenes > 1)
        .collect()
}

/// The matrix contains every pair of levels of two factors, and the few cases contain every level.
#[test]
fn the_matrix_covers_all_pairs() {
    let all: HashSet<String> = whole().iter().flat_map(pairs).collect();
    let levels = [
        Index::ALL.len(),
        Light::ALL.len(),
        Matter::ALL.len(),
        Wall::ALL.len(),
        View::ALL.len(),
    ];
    let expected: usize = (0..5)
        .map(|a| (0..a).map(|b| levels[a] * levels[b]).sum::<usize>())
        .sum();
    assert_eq!(all.len(), expected);
    let few = covering();
    let shown: HashSet<String> = few.iter().flat_map(pairs).collect();
    println!("the few show {} of {expected} pairs", shown.len());
    for case in whole() {
        assert!(few.iter().any(|c| c.index == case.index));
        assert!(few.iter().any(|c| c.light == case.light));
        assert!(few.iter().any(|c| c.matter == case.matter));
        assert!(few.iter().any(|c| c.view == case.view));
    }
}

/// Formats the result of the family as a whole.
fn verdict(rows: &[Row], pooled: &[Pooled]) -> String {
    match judge(rows, pooled, RATE) {
        Ok(()) => "All of them agree.".into(),
        Err(which) => which,
    }
}

fn document(rows: &[Row], pooled: &[Pooled], effort: Effort) -> String {
    let single = rows.iter().map(|r| r.p_values.len()).sum::<usize>();
    let comparisons = single + pooled.iter().flat_map(Pooled::p_values).count();
    // Deviation in standard errors that is found with a probability of 95 %.
    let sigmas = threshold(RATE, comparisons) + threshold(0.1, 1);
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| rows[b].error.total_cmp(&rows[a].error));
    let found = |rank: usize| {
        let deviation = detectable(&rows[order[rank]], single, RATE, effort);
        format!("{:.0}", 100.0 * deviation)
    };
    include_str!("document.md")
        .replace("{scenes}", &rows.len().to_string())
        .replace("{comparisons}", &comparisons.to_string())
        .replace("{batches}", &effort.batches.to_string())
        .replace("{rate}", &format!("{RATE:e}"))
        .replace("{pooled}", &pooled::table(pooled, sigmas))
        .replace("{median}", &found(rows.len() / 2))
        .replace("{quartile}", &found(rows.len() / 4))
        .replace("{verdict}", &verdict(rows, pooled))
}
