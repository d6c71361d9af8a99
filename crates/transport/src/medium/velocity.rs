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
    /// use morgana_transport::medium::Velocity;
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

    /// Bytes held by samples.
    pub(super) fn memory(&self) -> usize {
        self.0.memory()
    }
}
