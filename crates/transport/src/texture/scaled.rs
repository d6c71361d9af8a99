//! A texture times a factor.

use super::Texture;
use crate::Spectrum;
use crate::shape::Site;
use glam::DVec2;

/// A texture times a factor of its own for each channel.
#[derive(Clone, Debug)]
pub struct ScaledTexture {
    texture: Texture,
    factor: Spectrum,
}

impl ScaledTexture {
    /// `texture` times `factor`.
    pub fn new(texture: Texture, factor: Spectrum) -> Self {
        ScaledTexture { texture, factor }
    }

    pub(super) fn at(&self, site: &Site) -> Spectrum {
        self.texture.at(site) * self.factor
    }

    pub(super) fn gradient_at(&self, site: &Site) -> DVec2 {
        self.texture.gradient_at(site) * self.factor[0]
    }

    pub(super) fn texture(&self) -> &Texture {
        &self.texture
    }

    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        let factors = self.factor.0;
        let numbers = self.texture.numbers();
        numbers.flat_map(move |v| factors.map(|factor| v * factor))
    }
}
