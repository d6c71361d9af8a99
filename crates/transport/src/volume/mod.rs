//! Quantities that vary in space: samples on grids, labels of voxels.

mod cells;
mod grid;
mod labels;
mod section;
mod texture;

pub use grid::{GridError, GridFilter, GridSamples, VolumeGrid};
pub use labels::LabelGrid;
pub(crate) use section::Section;
pub use texture::VolumeTexture;
