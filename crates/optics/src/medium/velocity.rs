//! How fast what scatters light flows (docs/theory.md#flow).

use crate::Spectrum;
use crate::volume::VolumeTexture;
use glam::DVec3;

/// The velocity of what scatters light in a medium, in scene units per second.
#[derive(Clone, Debug)]
pub struct Velocity(VolumeTexture);

impl Velocity {
    /// The same everywhere.
    ///
    /// ```
    /// use glam::DVec3;
    /// use morgana_optics::medium::Velocity;
    ///
    /// let flow = Velocity::uniform(DVec3::new(0.0, 0.0, 2.5));
    /// assert_eq!(flow.at(DVec3::ONE).z, 2.5);
    /// ```
    pub fn uniform(velocity: DVec3) -> Self {
        let DVec3 { x, y, z } = velocity;
        Velocity(VolumeTexture::Uniform(Spectrum([x, y, z, 0.0])))
    }

    /// Of samples with three channels, its components along x, y, z of the world; beyond their grid as at its edge.
    pub fn sampled(samples: VolumeTexture) -> Self {
        Velocity(samples)
    }

    /// The velocity at `x`.
    pub fn at(&self, x: DVec3) -> DVec3 {
        let [x, y, z, _] = self.0.at(x).0;
        DVec3::new(x, y, z)
    }

    /// The largest |(v·∇)v|/|v|, per second: how fast what flows changes its velocity on its way, by differences of a voxel along the flow at
    /// each sample. Straight flows have none.
    ///
    /// ```
    /// use glam::DVec3;
    /// use morgana_optics::medium::Velocity;
    ///
    /// assert_eq!(Velocity::uniform(DVec3::X).change(), 0.0);
    /// ```
    pub fn change(&self) -> f64 {
        let VolumeTexture::Grid(grid) = &self.0 else {
            return 0.0;
        };
        let step = grid.voxel();
        let at = |x: DVec3| {
            let here = self.at(x);
            let on = here.try_normalize().map(|way| x + step * way);
            on.map_or(0.0, |on| (self.at(on) - here).length() / step)
        };
        grid.sample_positions().map(at).fold(0.0, f64::max)
    }

    /// Bytes held by samples.
    pub(super) fn memory(&self) -> usize {
        self.0.memory()
    }
}
