//! A volume that emits light, the same in all directions from each of its points.

use crate::Spectrum;
use crate::sampling::{Discrete, DistributionError, TrilinearCell};
use crate::volume::{Interval, VolumeGrid};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::{DAffine3, DVec3};
use smallvec::SmallVec;
use std::f64::consts::PI;

/// Half the bits of a random number: one makes two.
const HALF_BITS: f64 = (1u64 << 26) as f64;

/// A quantity with its standard error, in each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: Spectrum,
    /// Its standard error; zero if the value is exact.
    pub error: Spectrum,
}

/// Light from all points of a grid: ε = W/(m³ sr) if lengths are in metres, the radiance that a ray gathers per length.
#[derive(Clone, Debug)]
pub struct VolumeLight {
    /// ε, up to `scale`. Zero outside of the cube.
    grid: std::sync::Arc<VolumeGrid>,
    /// The medium that emits in its place, where the grid is a guess of ε.
    medium: Option<usize>,
    /// ∫ ε dV of the light that leaves: the grid's, unless a medium emits.
    emitted: Estimate,
    scale: Spectrum,
    /// From the grid's unit cube.
    to_world: DAffine3,
    /// Where the grid is trilinear, along each axis.
    axes: [Vec<Interval>; 3],
    /// Products of these intervals, x fastest, by the light that they emit.
    blocks: Discrete,
    /// ∫ ε dV.
    integral: Spectrum,
}

impl VolumeLight {
    /// The light of `grid` ≥ 0 times a `scale` ≥ 0.
    ///
    /// # Errors
    /// Its power is no finite number.
    pub fn new(
        grid: impl Into<std::sync::Arc<VolumeGrid>>,
        scale: Spectrum,
    ) -> Result<Self, DistributionError> {
        let grid = grid.into();
        let to_world = grid.to_world();
        let axes = [0, 1, 2].map(|axis| grid.intervals(axis));
        let volume = to_world.matrix3.determinant().abs();
        let mut integral = Spectrum::ZERO;
        let mut weights = Vec::with_capacity(axes.iter().map(Vec::len).product());
        for block in blocks(&axes) {
            let light = mean(&grid, block) * scale * (volume * size(block));
            integral += light;
            weights.push(light.sum());
        }
        if integral.is_zero() {
            // A black light has no preferences.
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

    /// The light of a medium, by its number in the scene. The grid guesses what it emits, > 0 wherever it does: points are chosen in
    /// proportion to the guess, and what leaves them is what the medium says.
    ///
    /// `emitted` is ∫ ε dV of the medium; the guess stands for it where the estimate found no light.
    ///
    /// # Errors
    /// As [`VolumeLight::new`].
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

    /// The number of the medium that emits, if it is one.
    pub fn medium(&self) -> Option<usize> {
        self.medium
    }

    /// The same light, with a total power of these channels; none in those in which it is black.
    ///
    /// # Errors
    /// The light that it takes is no finite number.
    pub fn with_power(self, power: Spectrum) -> Result<Self, DistributionError> {
        let factor = power.zip(
            self.power(),
            |power, own| {
                if own > 0.0 { power / own } else { 0.0 }
            },
        );
        VolumeLight::new(self.grid, self.scale * factor)
    }

    /// Total power.
    pub fn power(&self) -> Spectrum {
        self.emitted.value * (4.0 * PI)
    }

    /// Standard error of [`VolumeLight::power`]; zero unless a medium emits whose power had to be estimated.
    pub fn power_error(&self) -> Spectrum {
        self.emitted.error * (4.0 * PI)
    }

    /// ε at a point; the guess of it, if a medium emits.
    pub fn radiance(&self, x: DVec3) -> Spectrum {
        self.grid.within(x) * self.scale
    }

    /// Numbers of voxels along z, y, x; none if there is just one.
    pub(super) fn shape(&self) -> Vec<usize> {
        match self.grid.size() {
            [1, 1, 1] => Vec::new(),
            [x, y, z] => vec![z, y, x],
        }
    }

    /// Whether all voxels emit in the first `channels` channels.
    pub(super) fn is_positive(&self, channels: usize) -> bool {
        let scale = self.scale.0[..channels].iter().all(|s| *s > 0.0);
        scale && self.grid.extremes(channels)[0] > 0.0
    }

    /// Calls `see` with each voxel that counts at a point of the volume, and its weight.
    pub(super) fn weights(&self, x: DVec3, see: impl FnMut(usize, f64)) {
        self.grid.weights(x, see);
    }

    /// A box around it.
    pub fn aabb(&self) -> Aabb {
        self.grid.aabb()
    }

    /// A point in proportion to ε, summed over the channels.
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

    /// Density of [`VolumeLight::sample`] per unit volume; 0 for all points if it is black.
    pub fn pdf(&self, x: DVec3) -> f64 {
        let all = self.integral.sum();
        if all > 0.0 {
            self.radiance(x).sum() / all
        } else {
            0.0
        }
    }

    /// The ranges of θ up to `theta_end` over which an arc is in the volume.
    pub fn parts(&self, arc: &Arc, theta_end: f64) -> SmallVec<[[f64; 2]; 1]> {
        self.grid.parts(arc, theta_end)
    }

    /// ε in a block, summed over the channels.
    fn cell(&self, block: [Interval; 3]) -> TrilinearCell {
        let corner = |k: usize, j: usize, i: usize| {
            (sample(&self.grid, block, [i, j, k]) * self.scale).sum()
        };
        let both = [0, 1];
        TrilinearCell::new(both.map(|k| both.map(|j| both.map(|i| corner(k, j, i)))))
    }
}

/// All blocks, x fastest.
fn blocks(axes: &[Vec<Interval>; 3]) -> impl Iterator<Item = [Interval; 3]> {
    let [xs, ys, zs] = axes;
    let row = move |y: Interval, z: Interval| xs.iter().map(move |x| [*x, y, z]);
    zs.iter()
        .flat_map(move |z| ys.iter().flat_map(move |y| row(*y, *z)))
}

/// Share of the unit cube that a block fills.
fn size(block: [Interval; 3]) -> f64 {
    block.map(|i| i.edges[1] - i.edges[0]).iter().product()
}

/// The value at a corner of a block.
fn sample(grid: &VolumeGrid, block: [Interval; 3], corner: [usize; 3]) -> Spectrum {
    grid.sample_at([0, 1, 2].map(|axis| block[axis].samples[corner[axis]]))
}

/// Mean of the values at the corners of a block, which is that in the block.
fn mean(grid: &VolumeGrid, block: [Interval; 3]) -> Spectrum {
    let corner = |c: usize| sample(grid, block, [c & 1, c >> 1 & 1, c >> 2]);
    (0..8).map(corner).fold(Spectrum::ZERO, |a, b| a + b) / 8.0
}
