//! Quantities that vary in space: samples on grids, labels of voxels.

mod blocks;
mod cells;
mod error;
mod gradient;
mod grid;
mod labels;
mod lattice;
mod layers;
mod section;
mod tetrahedra;
mod texture;
mod voxel_media;

pub use blocks::Interval;
pub use error::GridError;
pub use grid::{GridFilter, GridSamples, VolumeGrid};
pub use labels::LabelGrid;
pub use layers::{Leaps, cell_of, number_of, spread};
pub use section::Section;
pub use tetrahedra::{TetrahedraMedia, TetrahedralMesh};
pub use texture::VolumeTexture;
pub use voxel_media::VoxelMedia;
