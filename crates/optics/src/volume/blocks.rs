//! Blocks of a grid, in which its values are trilinear between the values at the corners.

use super::grid::{GridFilter, VolumeGrid};
use super::lattice::to_samples;
use eikonal::ray::Arc;
use smallvec::{SmallVec, smallvec};

/// Interval along an axis of a grid's unit cube, in which values are linear between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Start and end, in [0, 1].
    pub edges: [f64; 2],
    /// Indices of the samples whose values the ends have.
    pub samples: [usize; 2],
}

impl VolumeGrid {
    /// Returns the intervals along an axis. They fill [0, 1], and the blocks are their products.
    pub fn intervals(&self, axis: usize) -> Vec<Interval> {
        let n = self.size()[axis];
        let from_unit = to_samples(self.size(), self.placement());
        let (scale, shift) = (
            from_unit.matrix3.col(axis)[axis],
            from_unit.translation[axis],
        );
        let offset = match self.filter() {
            GridFilter::Trilinear => 0.0,
            GridFilter::Nearest => -0.5,
        };
        let planes = (0..=n).map(|k| (k as f64 + offset - shift) / scale);
        let inner = planes.filter(|u| *u > 0.0 && *u < 1.0);
        let ends: Vec<f64> = std::iter::once(0.0).chain(inner).chain([1.0]).collect();
        let interval = |pair: &[f64]| {
            let middle = 0.5 * (pair[0] + pair[1]) * scale + shift;
            let nearest = |place: f64| place.clamp(0.0, (n - 1) as f64) as usize;
            let samples = match self.filter() {
                GridFilter::Trilinear => [middle.floor(), middle.floor() + 1.0],
                GridFilter::Nearest => [middle.round(); 2],
            };
            Interval {
                edges: [pair[0], pair[1]],
                samples: samples.map(nearest),
            }
        };
        ends.windows(2).map(interval).collect()
    }

    /// Returns the ranges of θ up to `theta_end` over which an arc is in the cube.
    pub(crate) fn parts(&self, arc: &Arc, theta_end: f64) -> SmallVec<[[f64; 2]; 1]> {
        if !arc.is_straight() {
            return self.bent_parts(arc, theta_end);
        }
        let [from, to] = self.straight_part(arc).map(|theta| theta.min(theta_end));
        if from < to {
            smallvec![[from, to]]
        } else {
            SmallVec::new()
        }
    }
}
