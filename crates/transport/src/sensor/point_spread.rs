//! Diffraction at the aperture (docs/theory.md#diffraction-at-the-aperture).

use super::encircled_energy::EncircledEnergy;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The diffraction image of a point in incoherent light of one wavelength: by how much the aperture of a sensor spreads light about
/// where rays say that it belongs. The image is that of rays, convolved with this.
#[derive(Clone, Debug)]
pub struct PointSpread {
    energy: Arc<EncircledEnergy>,
    /// Across and along the image, in its units, for a reduced radius of 1 in vacuum.
    scale: [f64; 2],
}

impl PointSpread {
    /// Of an aperture with an obscuration in [0, 1), where the `scale` is that of a reduced radius of 1.
    pub(super) fn new(obscuration: f64, scale: [f64; 2]) -> Self {
        PointSpread {
            energy: Arc::new(EncircledEnergy::new(obscuration)),
            scale,
        }
    }

    /// How far from its geometric place light arrives, in units of the image, with a density that is the point spread function:
    /// for `u` uniform in [0, 1)², and a sensor in a medium of the given index.
    pub fn offset(&self, index: f64, u: [f64; 2]) -> [f64; 2] {
        let radius = self.energy.radius(u[0]) / index;
        let (sin, cos) = (TAU * u[1]).sin_cos();
        [radius * cos * self.scale[0], radius * sin * self.scale[1]]
    }
}
