//! Velocity of scatterers (docs/theory.md#flow).

use crate::Spectrum;
use crate::volume::VolumeTexture;
use glam::DVec3;

/// Velocity of the scatterers in a medium, in scene units per second.
#[derive(Clone, Debug)]
pub struct Velocity(VolumeTexture);

impl Velocity {
    /// Creates a uniform velocity.
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

    /// Creates a velocity from samples with three channels, its components along x, y, z of the
    /// world. Outside the grid, the values at its edge continue.
    pub fn sampled(samples: VolumeTexture) -> Self {
        Velocity(samples)
    }

    /// Returns the velocity at `x`.
    pub fn at(&self, x: DVec3) -> DVec3 {
        let [x, y, z, _] = self.0.at(x).0;
        DVec3::new(x, y, z)
    }

    /// Returns the largest |(v·∇)v|/|v| per second: the rate at which the scatterers change their
    /// velocity along their paths. It is computed at each sample from differences over a voxel
    /// along the flow. It is zero for straight, uniform flow.
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

    /// Returns the memory of samples in bytes.
    pub(super) fn memory(&self) -> usize {
        self.0.memory()
    }
}
