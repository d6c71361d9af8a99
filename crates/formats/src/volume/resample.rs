//! Resampling of volumes to another number of samples in the same box.

use glam::{DMat3, DVec3};

use super::{Sample, Volume, VolumeFrame, layout};
use crate::error::Problem;

impl<T: Sample> Volume<T> {
    /// Resamples the volume to `size` samples that fill the box. They lie at centres or nodes of
    /// cells like the original samples, or at centres if the file does not state it. Values are
    /// trilinear between samples, and constant beyond the outermost samples. Values of a coarser
    /// volume are not averages of the original samples. An equal size gives equal values.
    ///
    /// # Errors
    ///
    /// A size of zero, or a size that exceeds the memory.
    pub fn resampled(&self, size: [usize; 3]) -> Result<Self, Problem> {
        let count = layout::check(size, self.channels)?;
        let mut data = Vec::new();
        let too_large = |_| {
            let [x, y, z] = size;
            Problem::TooLarge(format!("no memory for {x} x {y} x {z} voxels"))
        };
        data.try_reserve_exact(count).map_err(too_large)?;
        let nodes = self.place().nodes;
        let axis = |i: usize| {
            let (old, new) = (self.size[i], size[i]);
            (0..new).map(move |at| Between::of(at, new, old, nodes))
        };
        let (along_x, along_y): (Vec<_>, Vec<_>) = (axis(0).collect(), axis(1).collect());
        for z in axis(2) {
            for y in &along_y {
                for x in &along_x {
                    let value = |c| self.between(x, y, &z, c);
                    data.extend((0..self.channels).map(|c| T::nearest(value(c))));
                }
            }
        }
        let mut volume = Self::new(size, self.channels, data)?.with_element(self.element.float());
        volume.bbox = self.bbox;
        volume.bbox_of_cells = self.bbox_of_cells;
        volume.unit.clone_from(&self.unit);
        volume.frame = self.frame.map(|frame| frame.divided(self.size, size));
        volume.mentioned = (self.mentioned).map(|frame| frame.divided(self.size, size));
        Ok(volume)
    }

    fn between(&self, x: &Between, y: &Between, z: &Between, channel: usize) -> f64 {
        let [nx, ny, _] = self.size;
        let at = |i: usize, j: usize, k: usize| {
            self.data[((k * ny + j) * nx + i) * self.channels + channel].wide()
        };
        let row = |j: usize, k: usize| x.mix(at(x.low, j, k), at(x.high, j, k));
        let layer = |k: usize| y.mix(row(y.low, k), row(y.high, k));
        z.mix(layer(z.low), layer(z.high))
    }
}

/// Neighbouring samples of a position on an axis, and the fraction of the distance to the second.
struct Between {
    low: usize,
    high: usize,
    part: f64,
}

impl Between {
    /// Returns the neighbours of sample `at` of `new` samples, among `old` samples on the same
    /// length. Integer arithmetic makes coinciding positions exactly equal.
    fn of(at: usize, new: usize, old: usize, nodes: bool) -> Self {
        let (at, new, old) = (at as i128, new as i128, old as i128);
        // Compute the position in units of the old spacing, from the first old sample.
        let (numerator, denominator) = if nodes && new > 1 && old > 1 {
            (at * (old - 1), new - 1)
        } else {
            ((2 * at + 1) * old - new, 2 * new)
        };
        let most = (old - 1) * denominator;
        let numerator = numerator.clamp(0, most);
        let low = numerator / denominator;
        Between {
            low: low as usize,
            high: (low + 1).min(old - 1) as usize,
            part: (numerator % denominator) as f64 / denominator as f64,
        }
    }

    fn mix(&self, low: f64, high: f64) -> f64 {
        low + self.part * (high - low)
    }
}

impl VolumeFrame {
    /// Returns the position of `new` samples in the box of `old` samples.
    fn divided(&self, old: [usize; 3], new: [usize; 3]) -> Self {
        if old == new {
            return *self;
        }
        let cube = self.to_file(old);
        let axis = |n: usize| {
            if self.nodes && n > 1 {
                (0.0, 1.0 / (n - 1) as f64)
            } else {
                (0.5 / n as f64, 1.0 / n as f64)
            }
        };
        let first = DVec3::from_array(new.map(|n| axis(n).0));
        let step = DVec3::from_array(new.map(|n| axis(n).1));
        VolumeFrame {
            first: cube.transform_point3(first),
            steps: cube.matrix3 * DMat3::from_diagonal(step),
            nodes: self.nodes,
        }
    }
}
