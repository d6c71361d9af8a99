//! Volume that emits light isotropically from each of its points.

use crate::Spectrum;
use crate::sampling::{Discrete, DistributionError, TrilinearCell};
use crate::volume::{Interval, VolumeGrid};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::{DAffine3, DVec3};
use smallvec::SmallVec;
use std::f64::consts::PI;

/// Number of values of half the bits of a random number, which is split into two numbers.
const HALF_BITS: f64 = (1u64 << 26) as f64;

/// Quantity with its standard error, in each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: Spectrum,
    /// Standard error; zero if the value is exact.
    pub error: Spectrum,
}

/// Light from all points of a grid: ε in W/(m³ sr) if lengths are in metres, the radiance that a
/// ray gains per length.
#[derive(Clone, Debug)]
pub struct VolumeLight {
    /// Values of ε, up to `scale`. They are zero outside the cube.
    grid: std::sync::Arc<VolumeGrid>,
    /// Medium that emits in place of the grid, if the grid is only an estimate of ε.
    medium: Option<usize>,
    /// Integral ∫ ε dV of the emitted light: of the grid, unless a medium emits.
    emitted: Estimate,
    scale: Spectrum,
    /// Map from the unit cube of the grid to the world.
    to_world: DAffine3,
    /// Intervals along each axis in which the grid is trilinear.
    axes: [Vec<Interval>; 3],
    /// Distribution over the products of these intervals, x fastest, by their emitted light.
    blocks: Discrete,
    /// Integral ∫ ε dV of the grid.
    integral: Spectrum,
}

impl VolumeLight {
    /// Creates the light of `grid` ≥ 0 times a `scale` ≥ 0.
    ///
    /// # Errors
    /// Fails if the power is not a finite number.
    pub fn new(
        grid: impl Into<std::sync::Arc<VolumeGrid>>,
        scale: Spectrum,
    ) -> Result<Self, DistributionError> {
        let grid = grid.into();
        let to_world = grid.to_world();
        let axes = [0, 1, 2].map(|axis| grid.intervals(axis));
        let volume = to_world.matrix3.determinant().abs();
        // Integrate the light of each block.
        let mut integral = Spectrum::ZERO;
        let mut weights = Vec::with_capacity(axes.iter().map(Vec::len).product());
        for block in blocks(&axes) {
            let light = mean(&grid, block) * scale * (volume * size(block));
            integral += light;
            weights.push(light.sum());
        }
        if integral.is_zero() {
            // Make the density of a black light uniform.
            weights = blocks(&axes).map(size).collect();
        }
        Ok(VolumeLight {
            blocks: Discrete::new(&weights)?,
            grid,
            medium: None,
            emitted: Estimate {
                value: integral,
                error: Spectrum::ZERO,
            },
            scale,
            to_world,
            axes,
            integral,
        })
    }

    /// Creates the light of a medium, given by its index in the scene. The grid `guess` estimates
    /// the emission, and must be > 0 wherever the medium emits. Points are sampled in proportion to
    /// the estimate, but the medium determines their light.
    ///
    /// `emitted` is ∫ ε dV of the medium. If it is zero, because its estimation found no light, the
    /// integral of `guess` replaces it.
    ///
    /// # Errors
    /// Fails like [`VolumeLight::new`].
    pub fn of_medium(
        medium: usize,
        guess: VolumeGrid,
        emitted: Estimate,
    ) -> Result<Self, DistributionError> {
        let light = VolumeLight::new(guess, Spectrum::ONE)?;
        let emitted = if emitted.value.is_zero() {
            Estimate {
                value: light.integral,
                error: light.integral,
            }
        } else {
            emitted
        };
        Ok(VolumeLight {
            medium: Some(medium),
            emitted,
            ..light
        })
    }

    /// Returns the index of the medium, if a medium emits.
    pub fn medium(&self) -> Option<usize> {
        self.medium
    }

    /// Returns the light scaled to a total power per channel. Channels in which it is black stay
    /// black.
    ///
    /// # Errors
    /// Fails if the required scale is not a finite number.
    pub fn with_power(self, power: Spectrum) -> Result<Self, DistributionError> {
        let factor = power.zip(
            self.power(),
            |power, own| {
                if own > 0.0 { power / own } else { 0.0 }
            },
        );
        VolumeLight::new(self.grid, self.scale * factor)
    }

    /// Returns the total power.
    pub fn power(&self) -> Spectrum {
        self.emitted.value * (4.0 * PI)
    }

    /// Returns the standard error of [`VolumeLight::power`]. It is zero, unless a medium emits and
    /// its power had to be estimated.
    pub fn power_error(&self) -> Spectrum {
        self.emitted.error * (4.0 * PI)
    }

    /// Returns ε at a point; an estimate, if a medium emits.
    pub fn radiance(&self, x: DVec3) -> Spectrum {
        self.grid.within(x) * self.scale
    }

    /// Returns the numbers of voxels along z, y, x; empty for a single voxel.
    pub(super) fn shape(&self) -> Vec<usize> {
        match self.grid.size() {
            [1, 1, 1] => Vec::new(),
            [x, y, z] => vec![z, y, x],
        }
    }

    /// Returns true if all voxels emit in the first `channels` channels.
    pub(super) fn is_positive(&self, channels: usize) -> bool {
        let scale = self.scale.0[..channels].iter().all(|s| *s > 0.0);
        scale && self.grid.extremes(channels)[0] > 0.0
    }

    /// Calls `see` with each voxel that contributes at a point of the volume, and its weight.
    pub(super) fn weights(&self, x: DVec3, see: impl FnMut(usize, f64)) {
        self.grid.weights(x, see);
    }

    /// Returns a box around the volume.
    pub fn aabb(&self) -> Aabb {
        self.grid.aabb()
    }

    /// Samples a point with density proportional to ε, summed over the channels.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        let pick = self.blocks.sample(u[0]);
        let [nx, ny] = [0, 1].map(|axis| self.axes[axis].len());
        let block = [pick.index % nx, pick.index / nx % ny, pick.index / nx / ny];
        let block = [0, 1, 2].map(|axis| self.axes[axis][block[axis]]);
        let split = u[1] * HALF_BITS;
        let within = self
            .cell(block)
            .sample([pick.u, split.floor() / HALF_BITS, split.fract()]);
        let place = [0, 1, 2].map(|axis| {
            let [begin, end] = block[axis].edges;
            begin + within[axis] * (end - begin)
        });
        self.to_world.transform_point3(DVec3::from_array(place))
    }

    /// Returns the density of [`VolumeLight::sample`] per unit volume; 0 everywhere if the light is
    /// black.
    pub fn pdf(&self, x: DVec3) -> f64 {
        let all = self.integral.sum();
        if all > 0.0 {
            self.radiance(x).sum() / all
        } else {
            0.0
        }
    }

    /// Returns the ranges of θ up to `theta_end` over which an arc is in the volume.
    pub fn parts(&self, arc: &Arc, theta_end: f64) -> SmallVec<[[f64; 2]; 1]> {
        self.grid.parts(arc, theta_end)
    }

    /// Returns ε in a block, summed over the channels.
    fn cell(&self, block: [Interval; 3]) -> TrilinearCell {
        let corner = |k: usize, j: usize, i: usize| {
            (sample(&self.grid, block, [i, j, k]) * self.scale).sum()
        };
        let both = [0, 1];
        TrilinearCell::new(both.map(|k| both.map(|j| both.map(|i| corner(k, j, i)))))
    }
}

/// Returns all blocks, x fastest.
fn blocks(axes: &[Vec<Interval>; 3]) -> impl Iterator<Item = [Interval; 3]> {
    let [xs, ys, zs] = axes;
    let row = move |y: Interval, z: Interval| xs.iter().map(move |x| [*x, y, z]);
    zs.iter()
        .flat_map(move |z| ys.iter().flat_map(move |y| row(*y, *z)))
}

/// Returns the fraction of the unit cube that a block fills.
fn size(block: [Interval; 3]) -> f64 {
    block.map(|i| i.edges[1] - i.edges[0]).iter().product()
}

/// Returns the value at a corner of a block.
fn sample(grid: &VolumeGrid, block: [Interval; 3], corner: [usize; 3]) -> Spectrum {
    grid.sample_at([0, 1, 2].map(|axis| block[axis].samples[corner[axis]]))
}

/// Returns the mean of the values at the corners of a block, which equals the mean over the block.
fn mean(grid: &VolumeGrid, block: [Interval; 3]) -> Spectrum {
    let corner = |c: usize| sample(grid, block, [c & 1, c >> 1 & 1, c >> 2]);
    (0..8).map(corner).fold(Spectrum::ZERO, |a, b| a + b) / 8.0
}
