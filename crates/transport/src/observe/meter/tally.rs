//! Sums over particles.
//!
//! What one particle leaves in one slot, over its whole way, is one sample: the visits of a path to the
//! same place are anything but independent, and a standard error must not take them for that. So the
//! scores of a particle are added up per slot before they are squared. Particles are followed in small
//! tasks of fixed size, in parallel; the sums of tasks are then added slot by slot, in any order.
//!
//! Theory: docs/theory.md#errors-of-meters.

use crate::moments::Moments;
use crate::sparse::Sparse;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Blocks of slots per unit of work when tasks are added up.
const BLOCKS_PER_CHUNK: usize = 1 << 6;
/// Slots in these.
const SLOTS_PER_CHUNK: usize = BLOCKS_PER_CHUNK * Sparse::<Moments>::BLOCK;
/// Stands for no entry.
const FREE: u32 = u32::MAX;

/// What the particles of one task leave in slots: a hash table from slots to their sums.
#[derive(Clone, Debug)]
pub(crate) struct Scores {
    /// Places in `entries` by the hash of the first slot, or [`FREE`]: at least twice as many as entries, a power of two.
    places: Vec<u32>,
    /// Bits of a hash that are too many.
    shift: u32,
    entries: Vec<Entry>,
    /// Places of the entries in which the particle has left something.
    touched: Vec<u32>,
    /// Values that were not finite: counted, and scored zero.
    pub not_finite: u64,
}

/// What is in two slots that are always added to together, or in one.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// The slots; the second is [`FREE`] if there is none.
    slots: [u32; 2],
    /// What the particle has left so far; 0 for others.
    particle: [f64; 2],
    /// Sum, sum of squares, and largest absolute value of the totals of the particles before it.
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
    /// Adds a value that the particle leaves in a slot, which must be below [`Tally::MOST_SLOTS`].
    #[inline]
    pub(crate) fn add(&mut self, slot: usize, value: f64) {
        self.add_both([slot, FREE as usize], [value, 0.0]);
    }

    /// Adds the values that the particle leaves in two slots, of which the first always goes with the second.
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

    /// Ends the particle: what it has left in each slot is one sample.
    pub(crate) fn end_particle(&mut self) {
        for place in self.touched.drain(..) {
            let entry = &mut self.entries[place as usize];
            // 0 if its values have once cancelled, so that its place is known twice.
            let totals = std::mem::take(&mut entry.particle);
            for (sums, total) in entry.sums.iter_mut().zip(totals) {
                let [sum, squares, largest] = sums;
                *sum += total;
                *squares += total * total;
                *largest = largest.max(total.abs());
            }
        }
    }

    /// Ends the task.
    #[must_use]
    pub(crate) fn finish(self) -> TaskSums {
        let mut entries = Vec::with_capacity(2 * self.entries.len());
        for entry in &self.entries {
            for (slot, sums) in entry.slots.into_iter().zip(entry.sums) {
                // Nothing, or values that have cancelled.
                if sums[2] > 0.0 {
                    entries.push((slot, sums));
                }
            }
        }
        entries.sort_unstable_by_key(chunk);
        TaskSums { entries }
    }

    /// The place of the slots' entry, which is made if there is none.
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

    /// Where a slot's entry is looked for first.
    #[inline]
    fn hash(&self, slot: u32) -> usize {
        (slot.wrapping_mul(0x9e37_79b1) >> self.shift) as usize
    }

    /// Makes an entry, whose place is noted at a free one.
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

/// The sums of one task.
#[derive(Clone, Debug, Default)]
pub(crate) struct TaskSums {
    /// Slot; sum, sum of squares, and largest absolute value of particles' totals. In the order of chunks.
    entries: Vec<(u32, [f64; 3])>,
}

/// The chunk of an entry's slot.
fn chunk(entry: &(u32, [f64; 3])) -> usize {
    entry.0 as usize / SLOTS_PER_CHUNK
}

impl TaskSums {
    /// The entries of a chunk.
    fn of_chunk(&self, number: usize) -> &[(u32, [f64; 3])] {
        let position = |number: usize| self.entries.partition_point(|e| chunk(e) < number);
        &self.entries[position(number)..position(number + 1)]
    }
}

/// Sums over all particles. Slots take memory only near those in which particles have left something.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Tally {
    slots: Sparse<Moments>,
    particles: u64,
}

impl Tally {
    /// Most slots that a tally can have.
    pub(crate) const MOST_SLOTS: usize = u32::MAX as usize;

    /// An empty tally; `None` if the system does not have the memory that it takes once particles have left something everywhere.
    pub fn new(slots: usize) -> Option<Self> {
        Vec::<u8>::new()
            .try_reserve_exact(Self::memory(slots))
            .ok()?;
        Some(Tally {
            slots: Sparse::new(slots, Moments::default()),
            particles: 0,
        })
    }

    /// Bytes that a tally of `slots` slots takes at most.
    pub fn memory(slots: usize) -> usize {
        Sparse::<Moments>::memory(slots)
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.slots.len()
    }

    /// Adds another tally of as many slots.
    pub fn merge(&mut self, other: &Tally) {
        self.particles += other.particles;
        for (slot, sums) in other.slots.written(0..other.slots()) {
            *self.slots.get_mut(slot) += sums;
        }
    }

    /// Adds tasks, of `particles` particles in all.
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

    /// Slots of a range in which particles may have left something.
    pub(super) fn lit(&self, range: Range<usize>) -> impl Iterator<Item = usize> {
        let lit = self.slots.written(range);
        lit.filter(|(_, sums)| *sums != Moments::default())
            .map(|(slot, _)| slot)
    }

    /// Forgets the sums in a range of slots, nearly all of whose memory is free then.
    pub(super) fn forget(&mut self, slots: Range<usize>) {
        self.slots.forget(slots);
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

    /// Standard error of the mean in a slot in which no particle has left anything.
    pub(super) fn error_of_nothing(&self) -> f64 {
        Moments::default().variance_of_mean(self.particles).sqrt()
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

    /// Many slots, in which particles leave values that may cancel.
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
