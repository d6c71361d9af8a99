//! Two textures that alternate in squares.

use super::Texture;
use crate::Spectrum;
use crate::shape::Site;
use glam::{DAffine2, DVec2};

/// Checkerboard. Every unit square of texture coordinates has two by two fields.
#[derive(Clone, Debug)]
pub struct Checkerboard {
    colours: [Texture; 2],
    to_uv: DAffine2,
}

impl Checkerboard {
    /// Creates the checkerboard. The first texture covers the fields at both ends of the diagonal
    /// of the unit square. `to_uv` is applied to texture coordinates first.
    pub fn new(colours: [Texture; 2], to_uv: DAffine2) -> Self {
        Checkerboard { colours, to_uv }
    }

    /// Returns the map to coordinates that are integers on the lines between fields.
    pub(super) fn cells(&self) -> DAffine2 {
        DAffine2::from_scale(DVec2::splat(2.0)) * self.to_uv
    }

    pub(super) fn at(&self, site: &Site) -> Spectrum {
        self.colours[self.field(site)].at(site)
    }

    /// Returns the index of the texture at a point: 0 or 1.
    pub(super) fn field(&self, site: &Site) -> usize {
        let uv = self.to_uv.transform_point2(site.uv.get().into());
        let late = |x: f64| x - x.floor() > 0.5;
        usize::from(late(uv.x) != late(uv.y))
    }

    pub(super) fn colours(&self) -> &[Texture; 2] {
        &self.colours
    }
}
