//! Labels that compose a medium.

use super::{Fluorescence, Velocity};
use crate::Spectrum;
use crate::volume::LabelGrid;
use glam::DVec3;
use std::sync::Arc;

/// Maximum number of cubes of voxels through which a line is followed.
const MAX_STEPS: usize = 16;

/// Labels that compose a medium. Records of detected light distinguish them. Within one label,
/// light is traced without visiting each voxel.
#[derive(Clone, Debug)]
pub struct MediumLabels {
    grid: Arc<LabelGrid>,
    list: Vec<MediumLabel>,
}

/// Label of a medium, with its optical properties.
#[derive(Clone, Debug)]
pub struct MediumLabel {
    /// Name used in records.
    pub name: String,
    /// Extinction coefficient σ_t per unit length.
    pub extinction: Spectrum,
    /// Absorption coefficient μ_a per unit length.
    pub absorption: Spectrum,
    /// Velocity of the scatterers; `None` if they rest.
    pub velocity: Option<Velocity>,
    /// Fluorescence; `None` if the label does not fluoresce.
    pub fluorescence: Option<Fluorescence>,
}

impl MediumLabel {
    /// Returns the albedo σ_s/σ_t.
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
    /// Creates the labels from a grid of indices into `list`; indices beyond its end stand for the
    /// last label. The coefficients must equal the coefficients of the medium at these places,
    /// including its `scale`. Returns `None` if the list is empty.
    pub fn new(grid: Arc<LabelGrid>, list: Vec<MediumLabel>) -> Option<Self> {
        (!list.is_empty()).then_some(MediumLabels { grid, list })
    }

    /// Returns the grid of labels.
    pub fn grid(&self) -> &Arc<LabelGrid> {
        &self.grid
    }

    /// Returns the list of labels.
    pub fn list(&self) -> &[MediumLabel] {
        &self.list
    }

    /// Returns the index of the label at a position.
    pub fn at(&self, x: DVec3) -> usize {
        usize::from(self.grid.at(x)).min(self.list.len() - 1)
    }

    /// Returns the label at the start of a straight line from `x` along a unit direction. Returns
    /// `None` if the line is not known to stay in the label up to an optical depth in a channel.
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
        for _ in 0..MAX_STEPS {
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

    /// Returns the label for a value of the grid.
    fn numbered(&self, number: u8) -> &MediumLabel {
        &self.list[usize::from(number).min(self.list.len() - 1)]
    }
}
