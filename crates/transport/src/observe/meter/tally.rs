//! Sums over particles.
//!
//! The sum of all scores of one particle in one slot is one sample. The visits of a path to the
//! same cell are not independent, and a standard error must not treat them as independent. So the
//! scores of a particle are added up per slot before they are squared. Particles are followed in
//! parallel, in small tasks of fixed size. The sums of tasks are then added slot by slot, in any
//! order.
//!
//! Theory: docs/theory.md#errors-of-meters.

use crate::moments::Moments;
use crate::sparse::Sparse;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Blocks of slots per unit of work when tasks are added up.
const BLOCKS_PER_CHUNK: usize = 1 << 6;
/// Slots per unit of work.
const SLOTS_PER_CHUNK: usize = BLOCKS_PER_CHUNK * Sparse::<Moments>::BLOCK;
/// Marks an empty entry.
const FREE: u32 = u32::MAX;

/// Scores of the particles of one task: a hash table from slots to sums.
#[derive(Clone, Debug)]
pub(crate) struct Scores {
    /// Indices in `entries` by the hash of the first slot, or [`FREE`]. Its length is a power of
    /// two and at least twice the number of entries.
    places: Vec<u32>,
    /// Number of surplus bits of a hash.
    shift: u32,
    entries: Vec<Entry>,
    /// Indices of the entries to which the current particle has added.
    touched: Vec<u32>,
    /// Number of values that were not finite; they are scored as zero.
    pub not_finite: u64,
}

/// Sums in one slot, or in two slots that always receive values together.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Slots; the second is [`FREE`] if there is none.
    slots: [u32; 2],
    /// Sum of the current particle's values; 0 for particles that have not added anything.
    particle: [f64; 2],
    /// Sum, sum of squares, and largest absolute value of the totals of earlier particles.
    sums: [[f64; 3]; 2],
}

impl Default for Scores {
    fn default() -> Self {
        Scores {
            places: vec![FREE; 1 << 8],
            shift: u32::BITS - 8,
            entries: Vec::new(),
            touched: Vec::new(),
            not_finite: 0,
        }
    }
}

impl Scores {
    /// Adds a value of the particle to a slot, which must be below [`Tally::MAX_SLOTS`].
    #[inline]
    pub(crate) fn add(&mut self, slot: usize, value: f64) {
        self.add_both([slot, FREE as usize], [value, 0.0]);
    }

    /// Adds values of the particle to two slots. The first slot must always occur with the second.
    #[inline]
    pub(crate) fn add_both(&mut self, slots: [usize; 2], values: [f64; 2]) {
        let values = values.map(|value| {
            let is_finite = value.is_finite();
            self.not_finite += u64::from(!is_finite);
            if is_finite { value } else { 0.0 }
        });
        if values == [0.0; 2] {
            return;
        }
        let place = self.place(slots.map(|slot| slot as u32));
        let sums = &mut self.entries[place as usize].particle;
        if *sums == [0.0; 2] {
            self.touched.push(place);
        }
        *sums = [sums[0] + values[0], sums[1] + values[1]];
    }

    /// Ends the particle: its total in each slot is one sample.
    pub(crate) fn end_particle(&mut self) {
        for place in self.touched.drain(..) {
            let entry = &mut self.entries[place as usize];
            // The total is 0 if the values cancelled at some point, and the index was recorded
            // twice.
            let totals = std::mem::take(&mut entry.particle);
            for (sums, total) in entry.sums.iter_mut().zip(totals) {
                let [sum, squares, largest] = sums;
                *sum += total;
                *squares += total * total;
                *largest = largest.max(total.abs());
            }
        }
    }

    /// Ends the task and returns its sums.
    #[must_use]
    pub(crate) fn finish(self) -> TaskSums {
        let mut entries = Vec::with_capacity(2 * self.entries.len());
        for entry in &self.entries {
            for (slot, sums) in entry.slots.into_iter().zip(entry.sums) {
                // Skip entries without values, or whose values cancelled.
                if sums[2] > 0.0 {
                    entries.push((slot, sums));
                }
            }
        }
        entries.sort_unstable_by_key(chunk);
        TaskSums { entries }
    }

    /// Returns the index of the slots' entry, which is created if there is none.
    #[inline]
    fn place(&mut self, slots: [u32; 2]) -> u32 {
        let mut at = self.hash(slots[0]);
        loop {
            match self.places[at] {
                FREE => return self.insert(slots, at),
                place if self.entries[place as usize].slots[0] == slots[0] => return place,
                _ => at = (at + 1) & (self.places.len() - 1),
            }
        }
    }

    /// Returns the position at which the search for a slot's entry starts.
    #[inline]
    fn hash(&self, slot: u32) -> usize {
        (slot.wrapping_mul(0x9e37_79b1) >> self.shift) as usize
    }

    /// Creates an entry and enters its index at a free position.
    #[cold]
    fn insert(&mut self, slots: [u32; 2], at: usize) -> u32 {
        let place = self.entries.len() as u32;
        self.places[at] = place;
        self.entries.push(Entry {
            slots,
            particle: [0.0; 2],
            sums: [[0.0; 3]; 2],
        });
        if 2 * self.entries.len() > self.places.len() {
            self.grow();
        }
        place
    }

    fn grow(&mut self) {
        self.places = vec![FREE; 4 * self.places.len()];
        self.shift -= 2;
        for (place, entry) in self.entries.iter().enumerate() {
            let mut at = self.hash(entry.slots[0]);
            while self.places[at] != FREE {
                at = (at + 1) & (self.places.len() - 1);
            }
            self.places[at] = place as u32;
        }
    }
}

/// Sums of one task.
#[derive(Clone, Debug, Default)]
pub(crate) struct TaskSums {
    /// Entries, sorted by chunk: the slot, and the sum, sum of squares, and largest absolute value
    /// of particles' totals.
    entries: Vec<(u32, [f64; 3])>,
}

/// Returns the index of the chunk of an entry's slot.
fn chunk(entry: &(u32, [f64; 3])) -> usize {
    entry.0 as usize / SLOTS_PER_CHUNK
}

impl TaskSums {
    /// Returns the entries of a chunk.
    fn of_chunk(&self, number: usize) -> &[(u32, [f64; 3])] {
        let position = |number: usize| self.entries.partition_point(|e| chunk(e) < number);
        &self.entries[position(number)..position(number + 1)]
    }
}

/// Sums over all particles. Slots take memory only near those in which particles have scored.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Tally {
    slots: Sparse<Moments>,
    particles: u64,
}

impl Tally {
    /// Maximum number of slots.
    pub(crate) const MAX_SLOTS: usize = u32::MAX as usize;

    /// Creates an empty tally. Returns `None` if the system lacks the memory that the tally takes
    /// once particles have scored everywhere.
    pub fn new(slots: usize) -> Option<Self> {
        Vec::<u8>::new()
            .try_reserve_exact(Self::memory(slots))
            .ok()?;
        Some(Tally {
            slots: Sparse::new(slots, Moments::default()),
            particles: 0,
        })
    }

    /// Returns the maximum number of bytes of a tally with `slots` slots.
    pub fn memory(slots: usize) -> usize {
        Sparse::<Moments>::memory(slots)
    }

    /// Returns the number of slots.
    pub fn slots(&self) -> usize {
        self.slots.len()
    }

    /// Adds another tally with the same number of slots.
    pub fn merge(&mut self, other: &Tally) {
        self.particles += other.particles;
        for (slot, sums) in other.slots.written(0..other.slots()) {
            *self.slots.get_mut(slot) += sums;
        }
    }

    /// Adds the sums of tasks, of `particles` particles in total.
    pub(crate) fn add(&mut self, parts: &[&TaskSums], particles: u64) {
        self.particles += particles;
        let slots = &mut self.slots;
        slots.for_each_part(BLOCKS_PER_CHUNK, |first, mut slots| {
            for part in parts {
                for &(slot, sums) in part.of_chunk(first / SLOTS_PER_CHUNK) {
                    slots.get_mut(slot as usize - first).add_sums(sums);
                }
            }
        });
    }

    /// Returns the slots of a range in which particles have scored.
    pub(super) fn lit(&self, range: Range<usize>) -> impl Iterator<Item = usize> {
        let lit = self.slots.written(range);
        lit.filter(|(_, sums)| *sums != Moments::default())
            .map(|(slot, _)| slot)
    }

    /// Clears the sums in a range of slots, and frees nearly all of their memory.
    pub(super) fn clear(&mut self, slots: Range<usize>) {
        self.slots.clear(slots);
    }

    /// Returns the number of particles.
    pub fn particles(&self) -> u64 {
        self.particles
    }

    /// Returns the mean over particles; 0 if there are no particles.
    pub fn mean(&self, slot: usize) -> f64 {
        self.slots[slot].mean(self.particles)
    }

    /// Returns the standard error of the mean; infinite for fewer than two particles.
    pub fn error(&self, slot: usize) -> f64 {
        self.slots[slot].variance_of_mean(self.particles).sqrt()
    }

    /// Returns the standard error of the mean in a slot in which no particle has scored.
    pub(super) fn error_of_nothing(&self) -> f64 {
        Moments::default().variance_of_mean(self.particles).sqrt()
    }

    /// Returns the effective number of particles in a slot: see [`Moments::effective`].
    pub fn effective(&self, slot: usize) -> f64 {
        self.slots[slot].effective()
    }

    /// Returns true if the error in a slot is unreliable: see [`Moments::few`].
    pub fn few(&self, slot: usize) -> bool {
        self.slots[slot].few()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Makes a tally of particles with known totals, in tasks of three.
    fn tally(groups: &[usize]) -> Tally {
        let particles: Vec<[f64; 2]> = (0..12)
            .map(|i| [f64::from(i), 0.1 * f64::from(i)])
            .collect();
        let part = |particles: &[[f64; 2]]| {
            let mut scores = Scores::default();
            for [a, b] in particles {
                scores.add(40_000, *b);
                scores.add(7, 0.5 * a);
                scores.add(7, 0.5 * a);
                scores.end_particle();
            }
            scores.finish()
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
        // The mean square deviation of 0 … 11 is 13, with n − 1 in the denominator.
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

    /// Many slots receive values that may cancel.
    #[test]
    fn slots_keep_apart() {
        let mut scores = Scores::default();
        let slots = (0..3000).map(|i| 37 * i);
        for particle in 1..=3 {
            for slot in slots.clone().chain(slots.clone().rev()) {
                scores.add(slot, (slot + particle) as f64);
            }
            for value in [1.0, -1.0, 0.5] {
                scores.add(1, value);
            }
            scores.end_particle();
        }
        let sums = scores.finish();
        assert_eq!(sums.entries.len(), 3001);
        assert!(sums.entries.is_sorted_by_key(chunk));
        for (slot, found) in &sums.entries {
            let total = |particle: u32| match slot {
                1 => 0.5,
                _ => f64::from(2 * (slot + particle)),
            };
            let totals = [1, 2, 3].map(total);
            let sum = |power: i32| totals.iter().map(|t| t.powi(power)).sum::<f64>();
            assert_eq!(*found, [sum(1), sum(2), totals[2]], "{slot}");
        }
    }

    #[test]
    fn values_that_are_not_finite_are_counted() {
        let mut scores = Scores::default();
        scores.add(1, f64::NAN);
        scores.add(1, f64::INFINITY);
        assert_eq!(scores.not_finite, 2);
        scores.end_particle();
        assert!(scores.finish().entries.is_empty());
    }
}
