//! Labels of which a medium is made.

use super::Velocity;
use crate::Spectrum;
use crate::volume::LabelGrid;
use glam::DVec3;
use std::sync::Arc;

/// Cubes of voxels of one label through which a way is followed.
const MOST_STEPS: usize = 16;

/// Labels of which a medium is made: records of detected light tell them apart, and within a label light needs no look at voxels.
#[derive(Clone, Debug)]
pub struct MediumLabels {
    grid: Arc<LabelGrid>,
    list: Vec<MediumLabel>,
}

/// One of the labels of a medium.
#[derive(Clone, Debug)]
pub struct MediumLabel {
    /// Name used in records.
    pub name: String,
    /// Extinction coefficient σ_t per unit length.
    pub extinction: Spectrum,
    /// Absorption coefficient μ_a per unit length.
    pub absorption: Spectrum,
    /// How fast what scatters light flows; `None` if it rests.
    pub velocity: Option<Velocity>,
}

impl MediumLabel {
    /// Albedo σ_s/σ_t.
    #[inline]
    pub fn albedo(&self) -> Spectrum {
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
    pub fn grid(&self) -> &Arc<LabelGrid> {
        &self.grid
    }

    /// The labels.
    pub fn list(&self) -> &[MediumLabel] {
        &self.list
    }

    /// The number of the label at a place.
    pub fn at(&self, x: DVec3) -> usize {
        usize::from(self.grid.at(x)).min(self.list.len() - 1)
    }

    /// The label at the start of a straight line from `x` in a unit direction, if it does not end before an optical depth in a channel.
    #[inline]
    pub(super) fn along(
        &self,
        x: DVec3,
        direction: DVec3,
        channel: usize,
        depth: f64,
    ) -> Option<&MediumLabel> {
        let mut line = self.grid.along(x, direction);
        let first = self.grid.labels()[line.cell()?];
        let label = self.numbered(first);
        let length = depth / label.extinction[channel];
        for _ in 0..MOST_STEPS {
            let voxel = line.cell()?;
            if self.grid.labels()[voxel] != first {
                return None;
            }
            if line.stays(voxel, length) {
                return Some(label);
            }
            line.leap(voxel);
        }
        None
    }

    /// The label with a number in the grid.
    fn numbered(&self, number: u8) -> &MediumLabel {
        &self.list[usize::from(number).min(self.list.len() - 1)]
    }
}
