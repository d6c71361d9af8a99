//! A quantity per channel that may vary in space.

use super::grid::VolumeGrid;
use crate::Spectrum;
use glam::DVec3;
use std::sync::Arc;

/// A spatially uniform or gridded quantity.
#[derive(Clone, Debug)]
pub enum VolumeTexture {
    /// The same everywhere.
    Uniform(Spectrum),
    /// Interpolated from samples.
    Grid(Arc<VolumeGrid>),
}

impl VolumeTexture {
    /// The value at `x`.
    pub fn at(&self, x: DVec3) -> Spectrum {
        match self {
            VolumeTexture::Uniform(value) => *value,
            VolumeTexture::Grid(grid) => grid.at(x),
        }
    }

    /// The value, if it is the same everywhere.
    pub fn uniform(&self) -> Option<Spectrum> {
        match self {
            VolumeTexture::Uniform(value) => Some(*value),
            VolumeTexture::Grid(_) => None,
        }
    }

    /// Whether it is zero everywhere.
    pub fn is_zero(&self) -> bool {
        match self {
            VolumeTexture::Uniform(value) => value.is_zero(),
            VolumeTexture::Grid(grid) => grid.range().1 == 0.0,
        }
    }

    /// Smallest and largest value over all channels in use; uniform values are returned whole.
    pub fn range(&self) -> (f64, f64) {
        match self {
            VolumeTexture::Uniform(v) => (v.0.into_iter().fold(f64::INFINITY, f64::min), v.max()),
            VolumeTexture::Grid(grid) => grid.range(),
        }
    }

    /// Bytes held by the samples.
    pub fn memory(&self) -> usize {
        match self {
            VolumeTexture::Uniform(_) => 0,
            VolumeTexture::Grid(grid) => grid.memory(),
        }
    }
}
