//! All scenes of the matrix, and the few that are always rendered.

use crate::agreement::case::{Case, Index, Light, Matter, View, Wall};
use std::collections::HashSet;

/// Every combination of index, light and matter; walls and views alternate.
pub fn whole() -> Vec<Case> {
    let mut cases = Vec::new();
    for (i, &index) in Index::ALL.iter().enumerate() {
        for (l, &light) in Light::ALL.iter().enumerate() {
            for (m, &matter) in Matter::ALL.iter().enumerate() {
                cases.push(Case {
                    index,
                    light,
                    matter,
                    wall: Wall::ALL[(i + l + m) % 2],
                    view: View::ALL[(i + 3 * l + 2 * m + i / 4) % 4],
                });
            }
        }
    }
    cases
}

/// Levels of a case's factors. Equal names belong to different factors.
pub fn levels(case: &Case) -> [String; 5] {
    [
        format!("index {:?}", case.index),
        format!("light {:?}", case.light),
        format!("matter {:?}", case.matter),
        format!("wall {:?}", case.wall),
        format!("view {:?}", case.view),
    ]
}

/// Pairs of levels of different factors that occur in a case.
pub fn pairs(case: &Case) -> Vec<String> {
    let levels = levels(case);
    let mut pairs = Vec::new();
    for a in 0..levels.len() {
        for b in 0..a {
            pairs.push(format!("{}, {}", levels[b], levels[a]));
        }
    }
    pairs
}

/// Selects one case for each index, and one for each light that is still missing. Each case adds as
/// many new pairs of levels as possible.
pub fn covering() -> Vec<Case> {
    let mut seen = HashSet::new();
    let mut chosen: Vec<Case> = Vec::new();
    let all = whole();
    for &index in Index::ALL {
        let news = |c: &&Case| pairs(c).iter().filter(|p| !seen.contains(*p)).count();
        let candidates = all.iter().filter(|c| c.index == index);
        if let Some(best) = candidates.max_by_key(news) {
            seen.extend(pairs(best));
            chosen.push(*best);
        }
    }
    chosen
}
