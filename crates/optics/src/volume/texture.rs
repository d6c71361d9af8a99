//! Quantities per channel that may vary in space.

use super::grid::VolumeGrid;
use crate::Spectrum;
use glam::DVec3;
use std::sync::Arc;

/// Quantity that is uniform in space or sampled on a grid.
#[derive(Clone, Debug)]
pub enum VolumeTexture {
    /// Uniform value.
    Uniform(Spectrum),
    /// Interpolated samples.
    Grid(Arc<VolumeGrid>),
}

impl VolumeTexture {
    /// Returns the value at `x`.
    pub fn at(&self, x: DVec3) -> Spectrum {
        match self {
            VolumeTexture::Uniform(value) => *value,
            VolumeTexture::Grid(grid) => grid.at(x),
        }
    }

    /// Returns the value if it is uniform.
    pub fn uniform(&self) -> Option<Spectrum> {
        match self {
            VolumeTexture::Uniform(value) => Some(*value),
            VolumeTexture::Grid(_) => None,
        }
    }

    /// Returns true if the value is zero everywhere.
    pub fn is_zero(&self) -> bool {
        match self {
            VolumeTexture::Uniform(value) => value.is_zero(),
            VolumeTexture::Grid(grid) => grid.range().1 == 0.0,
        }
    }

    /// Returns the smallest and largest value over all channels. The unused channels of a uniform
    /// value count, too.
    pub fn range(&self) -> (f64, f64) {
        match self {
            VolumeTexture::Uniform(v) => (v.0.into_iter().fold(f64::INFINITY, f64::min), v.max()),
            VolumeTexture::Grid(grid) => grid.range(),
        }
    }

    /// Returns the memory of the samples in bytes.
    pub fn memory(&self) -> usize {
        match self {
            VolumeTexture::Uniform(_) => 0,
            VolumeTexture::Grid(grid) => grid.memory(),
        }
    }
}
