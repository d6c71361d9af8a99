//! Quantities that vary over a surface: images, checkerboards, values of vertices, and cuts of the
//! surface through a volume.

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

/// Reason why a texture cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TextureError {
    /// The number of values does not match.
    #[error("expected {expected} values, found {found}")]
    Count {
        /// Number of values required.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// A value is not finite.
    #[error("value {index} is not finite")]
    NotFinite {
        /// Index of the value.
        index: usize,
    },
    /// An image has no pixels, or more channels than a [`Spectrum`].
    #[error("an image needs pixels of 1 to {channels} channels", channels = Spectrum::CHANNELS)]
    Empty,
}

/// Quantity at every point of a surface.
#[derive(Clone, Debug)]
pub enum Texture {
    /// Uniform value.
    Uniform(Spectrum),
    /// Image over the texture coordinates.
    Bitmap(Arc<Bitmap>),
    /// Two textures that alternate in squares.
    Checkerboard(Arc<Checkerboard>),
    /// Colours of the vertices or triangles of a mesh.
    Vertices(Arc<VertexColours>),
    /// Values of a quantity in space, at the points of the surface.
    Volume(Arc<VolumeTexture>),
    /// Product of another texture and a factor.
    Scaled(Arc<ScaledTexture>),
}

impl Texture {
    /// Returns the value at a surface point.
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

    /// Returns the length of each axis of the array of values in which the texture is linear. A
    /// uniform texture has no axes. An image has rows and columns. Colours of vertices or triangles
    /// have one axis, and a checkerboard of two colours has one axis of length two. Returns `None`
    /// if the values are not numbered.
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

    /// Calls `see` with the index of each value that contributes at a point, and its weight. The
    /// value at the point is the sum of weights times [values](Texture::values). A value may be
    /// reported several times.
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

    /// Returns true if two textures are identical: one in memory, or equal uniform values.
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

    /// Calls [`Texture::weights`] with a dynamic `see`, which avoids a new closure type for each
    /// level of nested textures.
    fn numbered(&self, site: &Site, see: &mut dyn FnMut(usize, f64)) {
        self.weights(site, see);
    }

    /// Returns the first channel of the value at a point, for a texture that represents one number.
    pub fn number_at(&self, site: &Site) -> f64 {
        self.at(site)[0]
    }

    /// Returns the derivatives of [`Texture::number_at`] with respect to u and v for bilinear
    /// images, and zero for other textures.
    pub fn gradient_at(&self, site: &Site) -> DVec2 {
        match self {
            Texture::Bitmap(t) => t.gradient(site),
            Texture::Scaled(t) => t.gradient_at(site),
            _ => DVec2::ZERO,
        }
    }

    /// Returns true if the texture depends on texture coordinates.
    pub(crate) fn uses_uv(&self) -> bool {
        match self {
            Texture::Bitmap(_) | Texture::Checkerboard(_) => true,
            Texture::Scaled(t) => t.texture().uses_uv(),
            Texture::Uniform(_) | Texture::Vertices(_) | Texture::Volume(_) => false,
        }
    }

    /// Returns every number from which the texture is made. Its values lie between the smallest and
    /// the largest of these numbers.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.values().flat_map(|value| value.0)
    }

    /// Returns every value from which the texture is made.
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
