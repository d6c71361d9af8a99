//! Sums over particles.
//!
//! What one particle leaves in one slot, over its whole way, is one sample: the visits of a path to the
//! same place are anything but independent, and a standard error must not take them for that. So the
//! scores of a particle are added up per slot before they are squared. Particles are followed in small
//! tasks of fixed size, in parallel; the sums of tasks are then added slot by slot, in any order.
//!
//! Theory: docs/theory.md#errors-of-meters.

use crate::moments::Moments;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Slots of which it is known where in the list of scores they are.
const RECENT: usize = 64;
/// Slots per unit of work when tasks are added up.
const SLOTS_PER_CHUNK: usize = 1 << 14;

/// What one particle has left so far: slots and values, in any order.
#[derive(Clone, Debug)]
pub(crate) struct Scores {
    list: Vec<(u32, f64)>,
    /// Where in the list slots were added, by [`scattered`] numbers of theirs.
    recent: [u32; RECENT],
    /// Values that were not finite: counted, and scored zero.
    pub not_finite: u64,
}

/// A number below [`RECENT`] for a slot: different ones for slots that are near, or are those of two quantities in a cell.
fn scattered(slot: u32) -> usize {
    slot.wrapping_mul(0x9e37_79b1) as usize >> (u32::BITS - RECENT.ilog2())
}

impl Default for Scores {
    fn default() -> Self {
        Scores {
            list: Vec::new(),
            recent: [u32::MAX; RECENT],
            not_finite: 0,
        }
    }
}

impl Scores {
    /// Adds a value to a slot, which must be below [`Tally::MOST_SLOTS`].
    pub(crate) fn add(&mut self, slot: usize, value: f64) {
        if !value.is_finite() {
            self.not_finite += 1;
        } else if value != 0.0 {
            // A particle often comes back to the same cells.
            let slot = slot as u32;
            let place = &mut self.recent[scattered(slot)];
            match self.list.get_mut(*place as usize) {
                Some((known, sum)) if *known == slot => *sum += value,
                _ => {
                    *place = self.list.len() as u32;
                    self.list.push((slot, value));
                }
            }
        }
    }
}

/// The sums of one task, in the order of slots.
#[derive(Clone, Debug, Default)]
pub(crate) struct TaskSums {
    /// Slot; sum, sum of squares, and largest absolute value of particles' totals.
    entries: Vec<(u32, [f64; 3])>,
}

impl TaskSums {
    /// Takes the scores of a particle that has come to its end.
    pub(crate) fn take(&mut self, scores: &mut Scores) {
        // Stable: equal slots keep their order, and sums their bits.
        scores.list.sort_by_key(|(slot, _)| *slot);
        for same in scores.list.chunk_by(|a, b| a.0 == b.0) {
            let total: f64 = same.iter().map(|(_, value)| value).sum();
            self.entries
                .push((same[0].0, [total, total * total, total.abs()]));
        }
        scores.list.clear();
    }

    /// Ends the task: adds up the particles.
    #[must_use]
    pub(crate) fn finish(mut self) -> Self {
        self.entries.sort_by_key(|(slot, ..)| *slot);
        self.entries.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                let ([sum, squares, largest], more) = (kept.1, next.1);
                kept.1 = [sum + more[0], squares + more[1], largest.max(more[2])];
            }
            same
        });
        self
    }

    /// The entries whose slots lie in `from..to`.
    fn within(&self, from: usize, to: usize) -> &[(u32, [f64; 3])] {
        let position = |slot: usize| self.entries.partition_point(|e| (e.0 as usize) < slot);
        &self.entries[position(from)..position(to)]
    }
}

/// Sums over all particles.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Tally {
    slots: Vec<Moments>,
    particles: u64,
}

impl Tally {
    /// Most slots that a tally can have.
    pub(crate) const MOST_SLOTS: usize = u32::MAX as usize;

    /// An empty tally; `None` if there is not enough memory for it.
    pub fn new(slots: usize) -> Option<Self> {
        let mut empty = Vec::new();
        empty.try_reserve_exact(slots).ok()?;
        empty.resize(slots, Moments::default());
        Some(Tally {
            slots: empty,
            particles: 0,
        })
    }

    /// Bytes that a tally of so many slots needs.
    pub fn memory(slots: usize) -> usize {
        slots.saturating_mul(size_of::<Moments>())
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.slots.len()
    }

    /// Adds another tally of as many slots.
    pub fn merge(&mut self, other: &Tally) {
        self.particles += other.particles;
        for (kept, sums) in self.slots.iter_mut().zip(&other.slots) {
            *kept += *sums;
        }
    }

    /// Adds tasks, of `particles` particles in all.
    pub(crate) fn add(&mut self, parts: &[&TaskSums], particles: u64) {
        self.particles += particles;
        let chunks = self.slots.par_chunks_mut(SLOTS_PER_CHUNK).enumerate();
        chunks.for_each(|(i, slots)| {
            let first = i * SLOTS_PER_CHUNK;
            for part in parts {
                for &(slot, sums) in part.within(first, first + slots.len()) {
                    slots[slot as usize - first].add_sums(sums);
                }
            }
        });
    }

    /// Number of particles.
    pub fn particles(&self) -> u64 {
        self.particles
    }

    /// Mean over particles; 0 if there are none.
    pub fn mean(&self, slot: usize) -> f64 {
        self.slots[slot].mean(self.particles)
    }

    /// Standard error of the mean; infinite for less than two particles.
    pub fn error(&self, slot: usize) -> f64 {
        self.slots[slot].variance_of_mean(self.particles).sqrt()
    }

    /// Effective number of particles in a slot: see [`Moments::effective`].
    pub fn effective(&self, slot: usize) -> f64 {
        self.slots[slot].effective()
    }

    /// Whether the error in a slot is not to be trusted: see [`Moments::few`].
    pub fn few(&self, slot: usize) -> bool {
        self.slots[slot].few()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Particles of known totals, in tasks of three.
    fn tally(groups: &[usize]) -> Tally {
        let particles: Vec<[f64; 2]> = (0..12)
            .map(|i| [f64::from(i), 0.1 * f64::from(i)])
            .collect();
        let part = |particles: &[[f64; 2]]| {
            let (mut part, mut scores) = (TaskSums::default(), Scores::default());
            for [a, b] in particles {
                scores.add(40_000, *b);
                scores.add(7, 0.5 * a);
                scores.add(7, 0.5 * a);
                part.take(&mut scores);
            }
            part.finish()
        };
        let parts: Vec<TaskSums> = particles.chunks(3).map(part).collect();
        let parts: Vec<&TaskSums> = parts.iter().collect();
        let mut tally = Tally::new(40_001).unwrap();
        let mut rest = &parts[..];
        for &n in groups {
            tally.add(&rest[..n], 3 * n as u64);
            rest = &rest[n..];
        }
        tally
    }

    #[test]
    fn a_particle_is_one_sample() {
        let tally = tally(&[4]);
        assert_eq!(tally.particles(), 12);
        assert!((tally.mean(7) - 5.5).abs() < 1e-14);
        // The variance of 0 … 11 is 13, about a sample mean.
        assert!((tally.error(7) - (13.0f64 / 12.0).sqrt()).abs() < 1e-14);
        assert_eq!(tally.mean(8), 0.0);
        assert_eq!(tally.error(8), 0.0);
    }

    #[test]
    fn bits_do_not_depend_on_how_tasks_are_grouped() {
        let (all, some) = (tally(&[4]), tally(&[1, 2, 1]));
        for slot in [7, 40_000] {
            assert_eq!(all.mean(slot).to_bits(), some.mean(slot).to_bits());
            assert_eq!(all.error(slot).to_bits(), some.error(slot).to_bits());
        }
    }

    #[test]
    fn values_that_are_not_finite_are_counted() {
        let mut scores = Scores::default();
        scores.add(1, f64::NAN);
        scores.add(1, f64::INFINITY);
        assert_eq!(scores.not_finite, 2);
        assert!(scores.list.is_empty());
    }
}
