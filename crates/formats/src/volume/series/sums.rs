//! Summation of samples.

use super::{FrameSums, MAX_SUMS, Plan, Series, SeriesShape};
use crate::error::Problem;
use crate::volume::{Volume, place};
use std::ops::Range;

/// Sums over the samples of a series, in any order.
pub(in crate::volume) struct Adder {
    size: [usize; 3],
    shape: SeriesShape,
    wanted: FrameSums,
    /// Sums; those at a voxel are adjacent.
    sums: Vec<f64>,
    squares: f64,
    /// Frame of the previous sample, and its weights.
    frame: usize,
    weights: [f64; MAX_SUMS],
    /// Index of the first value that is not finite, and the value.
    bad: Option<(usize, f64)>,
}

impl Adder {
    /// Prepares the requested sums. `permit` checks a number of voxels, and the bytes for each.
    pub(in crate::volume) fn new(
        size: [usize; 3],
        shape: SeriesShape,
        plan: &mut Plan,
        permit: impl FnOnce(u64, u64) -> Result<(), Problem>,
    ) -> Result<Self, Problem> {
        let wanted = plan(shape)?;
        let places: usize = size.iter().product();
        let each = wanted.count * size_of::<f64>();
        permit(places as u64, each as u64)?;
        Ok(Adder {
            size,
            shape,
            sums: vec![0.0; places * wanted.count],
            squares: 0.0,
            frame: wanted.used.start,
            weights: (wanted.weights)(wanted.used.start),
            wanted,
            bad: None,
        })
    }

    /// Returns the range of the frames to use.
    pub(in crate::volume) fn used(&self) -> Range<usize> {
        self.wanted.used.clone()
    }

    /// Adds a value, given its index in the data of a volume whose channels are the frames.
    pub(in crate::volume) fn add(&mut self, index: usize, v: f64) {
        let (place, frame) = (index / self.shape.frames, index % self.shape.frames);
        if !self.wanted.used.contains(&frame) {
            return;
        }
        if !v.is_finite() {
            self.bad = self.bad.or(Some((index, v)));
        }
        if frame != self.frame {
            self.frame = frame;
            self.weights = (self.wanted.weights)(frame);
        }
        self.squares += v * v;
        let count = self.wanted.count;
        let sums = &mut self.sums[place * count..][..count];
        for (sum, weight) in sums.iter_mut().zip(&self.weights) {
            *sum += weight * v;
        }
    }

    /// Returns the sums.
    pub(in crate::volume) fn finish(self) -> Result<Series, Problem> {
        if let Some((index, value)) = self.bad {
            let place = place(self.size, self.shape.frames, index);
            return Err(Problem::NotFinite { place, value });
        }
        Ok(Series {
            sums: Volume::new(self.size, self.wanted.count, self.sums)?,
            squares: self.squares,
            shape: self.shape,
        })
    }
}
