//! Quantities that vary over a surface: images, checkerboards, values of vertices, volumes that the surface cuts.

mod bitmap;
mod checkerboard;
mod pieces;
mod scaled;
mod vertices;

pub use bitmap::{Bitmap, BitmapFilter, Wrap};
pub use checkerboard::Checkerboard;
pub use scaled::ScaledTexture;
pub use vertices::VertexColours;

use crate::Spectrum;
use crate::shape::Site;
use crate::volume::VolumeTexture;
use glam::DVec2;
use std::sync::Arc;

/// Why a texture cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TextureError {
    /// The number of values does not fit.
    #[error("expected {expected} values, found {found}")]
    Count {
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A value that is not finite.
    #[error("value {index} is not finite")]
    NotFinite {
        /// Its place among the values.
        index: usize,
    },
    /// An image without pixels, or of more channels than travel together.
    #[error("an image needs pixels of 1 to {channels} channels", channels = Spectrum::CHANNELS)]
    Empty,
}

/// A quantity at every point of a surface.
#[derive(Clone, Debug)]
pub enum Texture {
    /// The same everywhere.
    Uniform(Spectrum),
    /// An image over the texture coordinates.
    Bitmap(Arc<Bitmap>),
    /// Two textures that take turns.
    Checkerboard(Arc<Checkerboard>),
    /// Colours of a mesh's vertices.
    Vertices(Arc<VertexColours>),
    /// What a quantity in space is on the surface.
    Volume(Arc<VolumeTexture>),
    /// Another texture times a factor.
    Scaled(Arc<ScaledTexture>),
}

impl Texture {
    /// The value at a point of a surface.
    pub fn at(&self, site: &Site) -> Spectrum {
        match self {
            Texture::Uniform(value) => *value,
            Texture::Bitmap(t) => t.at(site),
            Texture::Checkerboard(t) => t.at(site),
            Texture::Vertices(t) => t.at(site),
            Texture::Volume(t) => t.at(site.position),
            Texture::Scaled(t) => t.at(site),
        }
    }

    /// Length along each axis of the values that it is linear in: none of one value; rows and columns of an image; vertices or triangles; the
    /// two fields of a checkerboard of two colours. `None` if they are not numbered.
    pub fn shape(&self) -> Option<Vec<usize>> {
        match self {
            Texture::Uniform(_) => Some(Vec::new()),
            Texture::Bitmap(t) => {
                let [x, y] = t.size();
                Some(vec![y, x])
            }
            Texture::Checkerboard(t) => {
                let is_one = |colour: &Texture| matches!(colour, Texture::Uniform(_));
                t.colours().iter().all(is_one).then(|| vec![2])
            }
            Texture::Vertices(t) => Some(vec![t.colours().len()]),
            Texture::Volume(_) => None,
            Texture::Scaled(t) => t.texture().shape(),
        }
    }

    /// Calls `see` with the number of each value that counts at a point, and its weight: the value there is the sum of weights times
    /// [values](Texture::values). One may come several times.
    pub fn weights(&self, site: &Site, mut see: impl FnMut(usize, f64)) {
        match self {
            Texture::Uniform(_) => see(0, 1.0),
            Texture::Bitmap(t) => t.weights(site, see),
            Texture::Checkerboard(t) => see(t.field(site), 1.0),
            Texture::Vertices(t) => t.weights(site, see),
            Texture::Volume(_) => {}
            Texture::Scaled(t) => t.texture().numbered(site, &mut see),
        }
    }

    /// Whether it is the same as another, not only equal.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Texture::Uniform(a), Texture::Uniform(b)) => a == b,
            (Texture::Bitmap(a), Texture::Bitmap(b)) => Arc::ptr_eq(a, b),
            (Texture::Checkerboard(a), Texture::Checkerboard(b)) => Arc::ptr_eq(a, b),
            (Texture::Vertices(a), Texture::Vertices(b)) => Arc::ptr_eq(a, b),
            (Texture::Scaled(a), Texture::Scaled(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// [`Texture::weights`], without a type of its own for each texture within a texture.
    fn numbered(&self, site: &Site, see: &mut dyn FnMut(usize, f64)) {
        self.weights(site, see);
    }

    /// The first channel of the value at a point: that of a texture that stands for one number.
    pub fn number_at(&self, site: &Site) -> f64 {
        self.at(site)[0]
    }

    /// The derivatives of [`Texture::number_at`] with respect to u and v, where they exist: those of bilinear images. Zero elsewhere.
    pub fn gradient_at(&self, site: &Site) -> DVec2 {
        match self {
            Texture::Bitmap(t) => t.gradient(site),
            Texture::Scaled(t) => t.gradient_at(site),
            _ => DVec2::ZERO,
        }
    }

    /// Whether texture coordinates matter.
    pub(crate) fn uses_uv(&self) -> bool {
        match self {
            Texture::Bitmap(_) | Texture::Checkerboard(_) => true,
            Texture::Scaled(t) => t.texture().uses_uv(),
            Texture::Uniform(_) | Texture::Vertices(_) | Texture::Volume(_) => false,
        }
    }

    /// Every number that the texture is made from; its values lie between the least and the largest.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.values().flat_map(|value| value.0)
    }

    /// Every value that the texture is made from.
    pub fn values(&self) -> Box<dyn Iterator<Item = Spectrum> + '_> {
        match self {
            Texture::Uniform(value) => Box::new(std::iter::once(*value)),
            Texture::Bitmap(t) => Box::new(t.values()),
            Texture::Checkerboard(t) => Box::new(t.colours().iter().flat_map(Texture::values)),
            Texture::Vertices(t) => Box::new(t.colours().iter().copied()),
            Texture::Volume(t) => {
                let (least, most) = t.range();
                Box::new([least, most].map(Spectrum::splat).into_iter())
            }
            Texture::Scaled(t) => Box::new(t.values()),
        }
    }
}

impl From<f64> for Texture {
    fn from(value: f64) -> Self {
        Texture::Uniform(Spectrum::splat(value))
    }
}

impl From<Spectrum> for Texture {
    fn from(value: Spectrum) -> Self {
        Texture::Uniform(value)
    }
}
