//! Sets of sample numbers.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Set of sample numbers: ranges that neither overlap nor touch, in ascending order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Range<u64>>")]
pub struct Ranges(Vec<Range<u64>>);

/// Error for a list of ranges that is not a valid [`Ranges`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("ranges of samples are empty, overlap, or are not in order")]
pub struct UnsoundRanges;

impl TryFrom<Vec<Range<u64>>> for Ranges {
    type Error = UnsoundRanges;

    fn try_from(ranges: Vec<Range<u64>>) -> Result<Self, UnsoundRanges> {
        let filled = ranges.iter().all(|r| r.start < r.end);
        let apart = ranges.windows(2).all(|pair| pair[0].end < pair[1].start);
        if filled && apart {
            Ok(Ranges(ranges))
        } else {
            Err(UnsoundRanges)
        }
    }
}

impl Ranges {
    /// Returns the number of samples in the set.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|r| r.end - r.start).sum()
    }

    /// Returns the ranges in ascending order.
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

    /// Returns the first range of numbers that both sets contain.
    pub fn overlap(&self, other: &Ranges) -> Option<Range<u64>> {
        let common = |a: Range<u64>| {
            let within = other
                .iter()
                .map(move |b| a.start.max(b.start)..a.end.min(b.end));
            within.filter(|r| !r.is_empty()).min_by_key(|r| r.start)
        };
        self.iter().find_map(common)
    }

    /// Returns the parts of a range that are missing from the set.
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
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(list: &[(u64, u64)]) -> Ranges {
        let mut ranges = Ranges::default();
        list.iter().for_each(|&(a, b)| ranges.insert(a..b));
        ranges
    }

    /// Compares with sets of numbers, for all pairs of ranges within ten.
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
                assert_eq!(Ranges::try_from(ranges.0.clone()), Ok(ranges.clone()));
                let listed: Vec<u64> = ranges.iter().flatten().collect();
                assert_eq!(listed, (0..10).filter(|i| has(*i)).collect::<Vec<_>>());
                assert_eq!(ranges.count(), listed.len() as u64);
                let gaps: Vec<u64> = ranges.gaps(2..8).into_iter().flatten().collect();
                assert_eq!(gaps, (2..8).filter(|i| !has(*i)).collect::<Vec<_>>());
            }
        }
    }

    /// Corrupted files with such ranges are rejected.
    #[test]
    fn ranges_are_in_order() {
        for text in [
            r#"[{"start": 2, "end": 1}]"#,
            r#"[{"start": 2, "end": 2}]"#,
            r#"[{"start": 2, "end": 4}, {"start": 4, "end": 6}]"#,
            r#"[{"start": 5, "end": 6}, {"start": 0, "end": 1}]"#,
        ] {
            assert!(serde_json::from_str::<Ranges>(text).is_err(), "{text}");
        }
        let text = serde_json::to_string(&of(&[(0, 4), (8, 12)])).unwrap();
        assert_eq!(serde_json::from_str::<Ranges>(&text).unwrap().count(), 8);
    }

    #[test]
    fn overlaps_are_found() {
        let ranges = of(&[(0, 4), (8, 12)]);
        assert_eq!(ranges.overlap(&of(&[(4, 8)])), None);
        assert_eq!(ranges.overlap(&of(&[(4, 9), (11, 20)])), Some(8..9));
        assert_eq!(ranges.overlap(&of(&[(2, 3)])), Some(2..3));
    }
}
