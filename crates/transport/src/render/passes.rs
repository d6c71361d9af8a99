//! Passes of a run. Between passes, progress is reported and the run can end.

use std::ops::Range;
use std::time::{Duration, Instant};

/// Target duration of a pass. It is short enough to report progress and to cancel quickly. It is
/// long enough to make waiting for the last thread cheap.
pub(super) const PASS: Duration = Duration::from_millis(500);

/// Passes over the missing numbers of a range of samples, or of particles. Results do not depend on
/// the division into passes.
#[derive(Debug)]
pub(super) struct Passes {
    /// Missing ranges, the last one first.
    gaps: Vec<Range<u64>>,
    /// Number of samples of the next pass.
    next: u64,
    started: Instant,
}

impl Passes {
    /// Creates passes over ranges in ascending order. The first pass takes one sample, or as few as
    /// possible.
    pub(super) fn over(gaps: impl IntoIterator<Item = Range<u64>>) -> Self {
        let mut gaps: Vec<Range<u64>> = gaps.into_iter().filter(|gap| !gap.is_empty()).collect();
        gaps.reverse();
        Passes {
            gaps,
            next: 1,
            started: Instant::now(),
        }
    }

    /// Returns the number of the first sample of the next pass, if there is one.
    pub(super) fn at(&self) -> Option<u64> {
        self.gaps.last().map(|gap| gap.start)
    }

    /// Begins the next pass and returns its samples. `size` receives the number of samples that
    /// should take the target duration and returns the number wanted; fewer are taken at the end of
    /// a gap. The range is empty if no samples are missing.
    pub(super) fn begin(&mut self, size: impl FnOnce(u64) -> u64) -> Range<u64> {
        self.started = Instant::now();
        let Some(gap) = self.gaps.last() else {
            return 0..0;
        };
        self.next = size(self.next).min(gap.end - gap.start);
        gap.start..gap.start + self.next
    }

    /// Ends the pass. Returns its duration.
    pub(super) fn end(&mut self) -> Duration {
        let elapsed = self.started.elapsed();
        if let Some(gap) = self.gaps.last_mut() {
            gap.start += self.next;
            if gap.is_empty() {
                self.gaps.pop();
            }
        }
        self.next = longer_or_shorter(self.next, elapsed);
        elapsed
    }
}

/// Returns the number of samples for the next pass after a pass of `samples` that took `elapsed`.
fn longer_or_shorter(samples: u64, elapsed: Duration) -> u64 {
    if 2 * elapsed <= PASS {
        samples.saturating_mul(2)
    } else if elapsed >= 2 * PASS {
        (samples / 2).max(1)
    } else {
        samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_cover_what_is_missing_once_and_in_order() {
        let mut passes = Passes::over([3..10, 12..12, 20..150]);
        let mut covered = Vec::new();
        while let Some(at) = passes.at() {
            let pass = passes.begin(|next| next.min(50));
            assert_eq!(pass.start, at);
            assert!(!pass.is_empty() && pass.end - pass.start <= 50);
            covered.extend(pass);
            passes.end();
        }
        assert!(covered.into_iter().eq((3..10).chain(20..150)));
        assert!(passes.begin(|next| next).is_empty());
    }
}
