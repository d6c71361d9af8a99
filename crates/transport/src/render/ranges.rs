//! Which samples have been taken.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Numbers of samples: ranges that neither overlap nor touch, in ascending order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ranges(Vec<Range<u64>>);

impl Ranges {
    /// How many numbers there are.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|r| r.end - r.start).sum()
    }

    /// The ranges.
    pub fn iter(&self) -> impl Iterator<Item = Range<u64>> + Clone + '_ {
        self.0.iter().cloned()
    }

    /// Adds a range.
    pub fn insert(&mut self, range: Range<u64>) {
        if range.is_empty() {
            return;
        }
        let first = self.0.partition_point(|r| r.end < range.start);
        let end = self.0.partition_point(|r| r.start <= range.end);
        let joined = self.0[first..end]
            .iter()
            .fold(range, |a, b| a.start.min(b.start)..a.end.max(b.end));
        self.0.splice(first..end, [joined]);
    }

    /// The first numbers that are also among others.
    pub fn overlap(&self, other: &Ranges) -> Option<Range<u64>> {
        let common = |a: Range<u64>| {
            let within = other
                .iter()
                .map(move |b| a.start.max(b.start)..a.end.min(b.end));
            within.filter(|r| !r.is_empty()).min_by_key(|r| r.start)
        };
        self.iter().find_map(common)
    }

    /// What is missing from a range.
    pub fn gaps(&self, within: Range<u64>) -> Vec<Range<u64>> {
        let mut gaps = Vec::new();
        let mut from = within.start;
        for range in &self.0 {
            gaps.push(from..range.start.min(within.end));
            from = from.max(range.end);
        }
        gaps.push(from..within.end);
        gaps.retain(|gap| !gap.is_empty());
        gaps
    }

    /// Whether ranges are in order, as they are unless they come from a file that lies.
    pub(super) fn are_sound(&self) -> bool {
        let filled = self.0.iter().all(|r| r.start < r.end);
        filled && self.0.windows(2).all(|pair| pair[0].end < pair[1].start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(list: &[(u64, u64)]) -> Ranges {
        let mut ranges = Ranges::default();
        list.iter().for_each(|&(a, b)| ranges.insert(a..b));
        ranges
    }

    /// Against sets of numbers, for all pairs of ranges within ten.
    #[test]
    fn they_are_sets() {
        let pairs = || (0..10).flat_map(|a| (a..10).map(move |b| (a, b)));
        for first in pairs() {
            for second in pairs() {
                let ranges = of(&[(1, 3), first, second]);
                let has = |i| {
                    [(1, 3), first, second]
                        .iter()
                        .any(|&(a, b)| (a..b).contains(&i))
                };
                assert!(ranges.are_sound(), "{ranges:?}");
                let listed: Vec<u64> = ranges.iter().flatten().collect();
                assert_eq!(listed, (0..10).filter(|i| has(*i)).collect::<Vec<_>>());
                assert_eq!(ranges.count(), listed.len() as u64);
                let gaps: Vec<u64> = ranges.gaps(2..8).into_iter().flatten().collect();
                assert_eq!(gaps, (2..8).filter(|i| !has(*i)).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn overlaps_are_found() {
        let ranges = of(&[(0, 4), (8, 12)]);
        assert_eq!(ranges.overlap(&of(&[(4, 8)])), None);
        assert_eq!(ranges.overlap(&of(&[(4, 9), (11, 20)])), Some(8..9));
        assert_eq!(ranges.overlap(&of(&[(2, 3)])), Some(2..3));
    }
}
