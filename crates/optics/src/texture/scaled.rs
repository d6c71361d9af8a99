//! Product of a texture and a factor.

use super::Texture;
use crate::Spectrum;
use crate::shape::Site;
use glam::DVec2;

/// Product of a texture and a factor per channel.
#[derive(Clone, Debug)]
pub struct ScaledTexture {
    texture: Texture,
    factor: Spectrum,
}

impl ScaledTexture {
    /// Creates the product of `texture` and `factor`.
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

    /// Returns the values of the texture times the factor, channel by channel.
    pub(super) fn values(&self) -> impl Iterator<Item = Spectrum> {
        self.texture.values().map(|value| value * self.factor)
    }
}
