//! Labels of which a medium is made.

use crate::Spectrum;
use crate::volume::LabelGrid;
use eikonal::ray::Arc as RayArc;
use glam::DVec3;
use std::sync::Arc;

/// Balls in a label through which a way is followed,
const MOST_BALLS: usize = 6;
/// as long as their radius is not less than this share of a voxel.
const LEAST: f64 = 0.2;

/// Labels of which a medium is made: records of detected light tell them apart, and within a label light needs no look at voxels.
#[derive(Clone, Debug)]
pub struct MediumLabels {
    grid: Arc<LabelGrid>,
    list: Vec<MediumLabel>,
}

/// One of the labels of a medium.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumLabel {
    /// Name used in records.
    pub name: String,
    /// Extinction coefficient σ_t per unit length.
    pub extinction: Spectrum,
    /// Absorption coefficient μ_a per unit length.
    pub absorption: Spectrum,
}

impl MediumLabel {
    /// Albedo σ_s/σ_t.
    #[inline]
    pub(crate) fn albedo(&self) -> Spectrum {
        let scattering = self.extinction - self.absorption;
        Spectrum(std::array::from_fn(|c| {
            if self.extinction[c] > 0.0 {
                scattering[c] / self.extinction[c]
            } else {
                0.0
            }
        }))
    }
}

impl MediumLabels {
    /// A grid that has for each place the number of one of the labels in a list; numbers beyond it are those of the last. Their coefficients
    /// must be those of the medium at such places, its `scale` included. `None` if there are no labels.
    pub fn new(grid: Arc<LabelGrid>, list: Vec<MediumLabel>) -> Option<Self> {
        (!list.is_empty()).then_some(MediumLabels { grid, list })
    }

    /// The grid.
    pub fn grid(&self) -> &LabelGrid {
        &self.grid
    }

    /// The labels.
    pub fn list(&self) -> &[MediumLabel] {
        &self.list
    }

    /// The number of the label at a place.
    pub(crate) fn at(&self, x: DVec3) -> usize {
        usize::from(self.grid.at(x)).min(self.list.len() - 1)
    }

    /// The label at the start of a straight arc, if the arc is known to stay in it for an optical depth in a channel: it goes from ball to ball
    /// that is in the label, a few times.
    #[inline]
    pub(crate) fn along(&self, arc: &RayArc, channel: usize, depth: f64) -> Option<&MediumLabel> {
        let (number, mut free) = self.grid.around(arc.start());
        let label = &self.list[usize::from(number).min(self.list.len() - 1)];
        let (length, whole) = (depth / label.extinction[channel], arc.arc_length(1.0));
        let mut gone = 0.0;
        for _ in 0..MOST_BALLS {
            let next = gone + free;
            if length < next {
                return Some(label);
            }
            if free < LEAST * self.grid.pitch() {
                return None;
            }
            let (there, around) = self.grid.around(arc.position(next / whole));
            if there != number {
                return None;
            }
            (gone, free) = (next, around);
        }
        None
    }
}
