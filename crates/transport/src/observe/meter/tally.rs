//! Sums over particles.
//!
//! The sum of all scores of one particle in one slot is one sample. The visits of a path to the
//! same cell are not independent, and a standard error must not treat them as independent. So the
//! scores of a particle are added up per slot before they are squared. Particles are followed in
//! parallel, in small tasks of fixed size. The sums of tasks are then added slot by slot, in any
//! order.
//!
//! Theory: docs/theory.md#errors-of-meters, docs/theory.md#particles-on-a-device.

use crate::moments::{MIN_EFFECTIVE, Moments};
use crate::sparse::Sparse;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Blocks of slots per unit of work when tasks are added up.
const BLOCKS_PER_CHUNK: usize = 1 << 6;
/// Slots per unit of work.
const SLOTS_PER_CHUNK: usize = BLOCKS_PER_CHUNK * Sparse::<Moments>::BLOCK;
/// Marks an empty entry.
const FREE: [u32; 2] = [u32::MAX; 2];

/// Scores of the particles of one task: a hash table from rows of slots to sums. The slots of a row
/// always receive values together.
#[derive(Clone, Debug)]
pub(crate) struct Scores {
    /// First slot and start of the sums of each row, by the hash of the first slot; [`FREE`] where
    /// there is none. Its length is a power of two and at least twice the number of rows.
    places: Vec<[u32; 2]>,
    /// Number of surplus bits of a hash.
    shift: u32,
    rows: Vec<Row>,
    /// Sums of all slots, row by row.
    sums: Vec<SlotSums>,
    /// Start and number of the sums of the rows to which the current particle has added.
    touched: Vec<[u32; 2]>,
    /// Number of values that were not finite; they are scored as zero.
    pub not_finite: u64,
}

/// Slots that always receive values together, at equal distances.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// First slot, and the distance from slot to slot.
    first: u32,
    stride: u32,
    /// Start and number of the row's sums.
    start: u32,
    count: u32,
}

/// Sums in one slot.
#[derive(Clone, Copy, Debug, Default)]
struct SlotSums {
    /// Sum of the current particle's values.
    particle: f64,
    /// Sum, sum of squares, and largest absolute value of the totals of earlier particles.
    totals: [f64; 3],
}

impl Default for Scores {
    fn default() -> Self {
        Scores {
            places: vec![FREE; 1 << 8],
            shift: u32::BITS - 8,
            rows: Vec::new(),
            sums: Vec::new(),
            touched: Vec::new(),
            not_finite: 0,
        }
    }
}

impl Scores {
    /// Adds a value of the particle to a slot, which must be below [`Tally::MAX_SLOTS`].
    #[inline]
    pub(crate) fn add(&mut self, slot: usize, value: f64) {
        self.add_row(slot, 0, &[value]);
    }

    /// Adds values of the particle to the slots `first`, `first` + `stride`, and so on. All rows
    /// with one first slot must have one stride and one number of slots.
    // Callers know the number of values, so that loops over them unroll.
    #[inline(always)]
    pub(crate) fn add_row(&mut self, first: usize, stride: usize, values: &[f64]) {
        self.not_finite += values.iter().filter(|value| !value.is_finite()).count() as u64;
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        if values.iter().all(|value| finite(*value) == 0.0) {
            return;
        }
        let start = self.start(first as u32, stride as u32, values.len());
        let sums = &mut self.sums[start as usize..][..values.len()];
        if sums.iter().all(|slot| slot.particle == 0.0) {
            self.touched.push([start, values.len() as u32]);
        }
        for (slot, value) in sums.iter_mut().zip(values) {
            slot.particle += finite(*value);
        }
    }

    /// Ends the particle: its total in each slot is one sample.
    pub(crate) fn end_particle(&mut self) {
        for [start, count] in self.touched.drain(..) {
            for slot in &mut self.sums[start as usize..][..count as usize] {
                // The total is 0 if the values cancelled at some point, and the index was recorded
                // twice.
                let total = std::mem::take(&mut slot.particle);
                let [sum, squares, largest] = &mut slot.totals;
                *sum += total;
                *squares += total * total;
                *largest = largest.max(total.abs());
            }
        }
    }

    /// Ends the task and returns its sums.
    #[must_use]
    pub(crate) fn finish(self) -> TaskSums {
        let mut rows: Vec<Row> = Vec::with_capacity(self.rows.len());
        self.rows.iter().for_each(|row| row.split(&mut rows));
        rows.sort_unstable_by_key(Row::chunk);
        let mut sums = Vec::with_capacity(self.sums.len());
        for row in &mut rows {
            let of_row = &self.sums[row.start as usize..][..row.count as usize];
            row.start = sums.len() as u32;
            sums.extend(of_row.iter().map(|slot| slot.totals));
        }
        TaskSums { rows, sums }
    }

    /// Returns the start of the sums of the row with a first slot, which is created if there is
    /// none.
    #[inline]
    fn start(&mut self, first: u32, stride: u32, count: usize) -> u32 {
        let mut at = self.hash(first);
        loop {
            match self.places[at] {
                FREE => return self.insert(first, stride, count, at),
                [known, start] if known == first => return start,
                _ => at = (at + 1) & (self.places.len() - 1),
            }
        }
    }

    /// Returns the position at which the search for a row starts.
    #[inline]
    fn hash(&self, first: u32) -> usize {
        (first.wrapping_mul(0x9e37_79b1) >> self.shift) as usize
    }

    /// Creates a row and enters it at a free position. Returns the start of its sums.
    #[cold]
    fn insert(&mut self, first: u32, stride: u32, count: usize, at: usize) -> u32 {
        let start = self.sums.len() as u32;
        self.places[at] = [first, start];
        self.rows.push(Row {
            first,
            stride,
            start,
            count: count as u32,
        });
        self.sums
            .resize(start as usize + count, SlotSums::default());
        if 2 * self.rows.len() > self.places.len() {
            self.grow();
        }
        start
    }

    fn grow(&mut self) {
        self.places = vec![FREE; 4 * self.places.len()];
        self.shift -= 2;
        for row in &self.rows {
            let mut at = self.hash(row.first);
            while self.places[at] != FREE {
                at = (at + 1) & (self.places.len() - 1);
            }
            self.places[at] = [row.first, row.start];
        }
    }
}

impl Row {
    /// Returns the index of the chunk of the first slot.
    fn chunk(&self) -> usize {
        self.first as usize / SLOTS_PER_CHUNK
    }

    /// Appends the parts of the row that lie in one chunk each.
    fn split(&self, parts: &mut Vec<Row>) {
        let mut left = *self;
        while left.count > 0 {
            let end = (left.chunk() + 1) * SLOTS_PER_CHUNK;
            let within = (end - left.first as usize).div_ceil(left.stride.max(1) as usize);
            let count = left.count.min(within as u32);
            parts.push(Row { count, ..left });
            left.count -= count;
            left.start += count;
            left.first = left.first.wrapping_add(count * left.stride);
        }
    }

    /// Returns the slots.
    fn slots(&self) -> impl Iterator<Item = usize> {
        let (first, stride) = (self.first as usize, self.stride as usize);
        (0..self.count as usize).map(move |k| first + k * stride)
    }
}

/// Sums of one task.
#[derive(Clone, Debug, Default)]
pub(crate) struct TaskSums {
    /// Rows within one chunk each, sorted by chunk.
    rows: Vec<Row>,
    /// Sum, sum of squares, and largest absolute value of particles' totals, row by row.
    sums: Vec<[f64; 3]>,
}

impl TaskSums {
    /// Creates the sums of one sample of the slots from 0 on. Chunks of zeros take no memory.
    pub(crate) fn of_sample(slots: usize, value: impl Fn(usize) -> f64) -> Self {
        let mut task = TaskSums::default();
        for first in (0..slots).step_by(SLOTS_PER_CHUNK) {
            let chunk = first..slots.min(first + SLOTS_PER_CHUNK);
            let start = task.sums.len();
            let values = chunk.clone().map(&value);
            task.sums.extend(values.map(|x| [x, x * x, x.abs()]));
            if task.sums[start..]
                .iter()
                .all(|[.., largest]| *largest == 0.0)
            {
                task.sums.truncate(start);
                continue;
            }
            task.rows.push(Row {
                first: first as u32,
                stride: 1,
                start: start as u32,
                count: chunk.len() as u32,
            });
        }
        task
    }

    /// Returns the slots of a chunk, with their sums.
    fn of_chunk(&self, number: usize) -> impl Iterator<Item = (usize, [f64; 3])> {
        let position = |number: usize| self.rows.partition_point(|row| row.chunk() < number);
        let rows = &self.rows[position(number)..position(number + 1)];
        rows.iter().flat_map(|row| {
            let sums = &self.sums[row.start as usize..][..row.count as usize];
            let slots = row.slots().zip(sums.iter().copied());
            slots.filter(|(_, [.., largest])| *largest > 0.0)
        })
    }
}

/// Sums over all particles. Slots take memory only near those in which particles have scored.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Tally {
    slots: Sparse<Moments>,
    /// Number of samples of each mean: particles, or batches of particles.
    samples: u64,
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
            samples: 0,
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
        self.samples += other.samples;
        self.particles += other.particles;
        for (slot, sums) in other.slots.written(0..other.slots()) {
            *self.slots.get_mut(slot) += sums;
        }
    }

    /// Adds the sums of tasks: `samples` samples of `particles` particles in total.
    pub(crate) fn add(&mut self, parts: &[&TaskSums], samples: u64, particles: u64) {
        self.samples += samples;
        self.particles += particles;
        let slots = &mut self.slots;
        slots.for_each_part(BLOCKS_PER_CHUNK, |first, mut slots| {
            for part in parts {
                for (slot, sums) in part.of_chunk(first / SLOTS_PER_CHUNK) {
                    slots.get_mut(slot - first).add_sums(sums);
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
        self.slots[slot].mean(self.samples)
    }

    /// Returns the standard error of the mean; infinite for fewer than two particles.
    pub fn error(&self, slot: usize) -> f64 {
        self.slots[slot].variance_of_mean(self.samples).sqrt()
    }

    /// Returns the standard error of the mean in a slot in which no particle has scored.
    pub(super) fn error_of_nothing(&self) -> f64 {
        Moments::default().variance_of_mean(self.samples).sqrt()
    }

    /// Returns the effective number of particles in a slot: see [`Moments::effective`]. For batches
    /// it follows from the variance of the mean: N m²/(N σ² + m²) for N particles.
    pub fn effective(&self, slot: usize) -> f64 {
        let moments = &self.slots[slot];
        if self.samples == self.particles {
            return moments.effective();
        }
        let square = moments.mean(self.samples).powi(2);
        let n = self.particles as f64;
        if square > 0.0 {
            n * square / (n * moments.variance_of_mean(self.samples) + square)
        } else {
            0.0
        }
    }

    /// Returns true if the error in a slot is unreliable: see [`Moments::few`].
    pub fn few(&self, slot: usize) -> bool {
        let moments = &self.slots[slot];
        let few = moments.few();
        if self.samples == self.particles || few {
            return few;
        }
        *moments != Moments::default() && self.effective(slot) < MIN_EFFECTIVE
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
            tally.add(&rest[..n], 3 * n as u64, 3 * n as u64);
            rest = &rest[n..];
        }
        tally
    }

    /// Returns all slots of a task below 200,000 in which particles have scored, with their sums.
    fn entries(task: &TaskSums) -> Vec<(usize, [f64; 3])> {
        let chunks = 0..200_000usize.div_ceil(SLOTS_PER_CHUNK);
        let of_chunk = |number: usize| {
            let slots = task.of_chunk(number);
            slots.inspect(move |(slot, _)| assert_eq!(slot / SLOTS_PER_CHUNK, number))
        };
        let lit = chunks.flat_map(of_chunk).filter(|(_, sums)| sums[2] > 0.0);
        lit.collect()
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
        let entries = entries(&scores.finish());
        assert_eq!(entries.len(), 3001);
        for (slot, found) in entries {
            let total = |particle: usize| match slot {
                1 => 0.5,
                _ => (2 * (slot + particle)) as f64,
            };
            let totals = [1, 2, 3].map(total);
            let sum = |power: i32| totals.iter().map(|t| t.powi(power)).sum::<f64>();
            assert_eq!(found, [sum(1), sum(2), totals[2]], "{slot}");
        }
    }

    #[test]
    fn values_that_are_not_finite_are_counted() {
        let mut scores = Scores::default();
        scores.add(1, f64::NAN);
        scores.add(1, f64::INFINITY);
        assert_eq!(scores.not_finite, 2);
        scores.end_particle();
        assert!(entries(&scores.finish()).is_empty());
    }

    /// Values of rows of different shapes, which lie among one another, reach their slots.
    #[test]
    fn rows_have_their_slots() {
        let mut scores = Scores::default();
        let mut expected = vec![0.0; 100_000];
        for first in (0..10_000).rev().step_by(3) {
            scores.add_row(first, 10_000, &[1.0, 0.0, 3.0]);
            scores.add_row(30_000 + first, 15_000, &[4.0, f64::NAN, 6.0, 7.0]);
            for (slot, value) in [(0, 1.0), (20_000, 3.0), (30_000, 4.0), (60_000, 6.0)] {
                expected[slot + first] += value;
            }
            expected[75_000 + first] += 7.0;
        }
        assert_eq!(scores.not_finite, 3334);
        scores.end_particle();
        let mut found = vec![0.0; 100_000];
        for (slot, sums) in entries(&scores.finish()) {
            found[slot] += sums[0];
        }
        assert_eq!(found, expected);
    }
}
