//! Area light with a radiance that varies over its shape.

use super::table::sampling_table;
use crate::Spectrum;
use crate::sampling::{DistributionError, Grid2};
use crate::shape::{AreaSample, Shape, Site};
use crate::texture::Texture;
use eikonal::Shown;
use std::f64::consts::PI;

/// Reason why a shape cannot emit a texture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TexturedError {
    /// A radiance is negative or not finite.
    #[error("a radiance of the texture is {}; light must be finite and not negative", Shown(*value))]
    Radiance {
        /// The radiance.
        value: f64,
    },
    /// The mesh has no texture coordinates.
    #[error(
        "the mesh has no texture coordinates; give it some, or use the colours of its vertices"
    )]
    NoCoordinates,
    /// The power over an ellipsoid or elliptic cylinder has no closed form.
    #[error(
        "an ellipsoid or elliptic cylinder cannot emit a texture, since its power is not known exactly there; \
         use a sphere, a circular cylinder or a mesh"
    )]
    Uneven,
    /// The texture has too many pixels or fields on the shape.
    #[error(
        "the texture has more than {most} pixels or fields on the shape; use a smaller image or fewer repetitions",
        most = MAX_PIECES
    )]
    TooFine,
    /// The radiances cannot be sampled.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
}

/// Maximum number of pieces of a texture that are integrated; this takes about a minute.
const MAX_PIECES: u64 = 1 << 24;

/// Light from the side of a shape to which its normals point. Each point has the same radiance in
/// all directions.
///
/// Points are sampled by a table over the two numbers of [`Shape::sample_area`].
#[derive(Clone, Debug)]
pub struct TexturedArea {
    object: usize,
    radiance: Texture,
    power: Spectrum,
    table: Grid2,
}

impl TexturedArea {
    /// Creates the light of object `object`, which has the given shape.
    ///
    /// # Errors
    /// Fails if radiances are negative or not finite, or zero all over the shape. Fails if a mesh
    /// lacks the texture coordinates that the texture needs. Fails if the power of the shape is not
    /// known exactly, or if the texture is too fine on it.
    pub fn new(object: usize, shape: &Shape, radiance: Texture) -> Result<Self, TexturedError> {
        let bad = |v: &f64| !(v.is_finite() && *v >= 0.0);
        if let Some(value) = radiance.numbers().find(bad) {
            return Err(TexturedError::Radiance { value });
        }
        let has_uv = !matches!(shape, Shape::Mesh(mesh) if !mesh.has_uvs());
        if radiance.uses_uv() && !has_uv {
            return Err(TexturedError::NoCoordinates);
        }
        Ok(TexturedArea {
            object,
            power: integral(&radiance, shape)? * PI,
            table: table(&radiance, shape)?,
            radiance,
        })
    }

    /// Returns the index of the object whose surface emits.
    pub fn object(&self) -> usize {
        self.object
    }

    /// Returns the radiance over the shape.
    pub fn texture(&self) -> &Texture {
        &self.radiance
    }

    /// Returns the radiance at a point of the shape.
    pub fn radiance(&self, site: &Site) -> Spectrum {
        self.radiance.at(site)
    }

    /// Returns the total power: π times the integral of the radiance over the area, exact to
    /// rounding.
    pub fn power(&self) -> Spectrum {
        self.power
    }

    /// Samples a point of the shape, with density roughly proportional to the sum of the channels
    /// of the radiance.
    pub fn sample(&self, shape: &Shape, u: [f64; 2]) -> AreaSample {
        let (place, density) = self.table.sample(u);
        let sample = shape.sample_area(place);
        AreaSample {
            // Planted error "points of a textured light weighted as if they were spread evenly", found by morgana-transport/transport::panel::irradiance_below_the_panel:
            // pdf: sample.pdf,
            pdf: sample.pdf * density,
            ..sample
        }
    }

    /// Returns the density of [`TexturedArea::sample`] per unit area in scene units.
    pub fn pdf(&self, shape: &Shape, site: &Site) -> f64 {
        let (x, part) = (site.position, site.primitive);
        shape.pdf_area(x, part) * self.table.pdf(shape.inverse_area(x, part))
    }
}

/// Returns ∫ radiance dA.
fn integral(radiance: &Texture, shape: &Shape) -> Result<Spectrum, TexturedError> {
    let mut left = MAX_PIECES;
    let mut sum = Spectrum::ZERO;
    for part in 0..shape.part_count() {
        let chart = shape.chart(part).ok_or(TexturedError::Uneven)?;
        let found = radiance.integral(&chart, &mut left);
        sum += found.map_err(|_| TexturedError::TooFine)?;
    }
    Ok(sum)
}

/// Creates the density over the unit square of the numbers of [`Shape::sample_area`], from the
/// brightness of cells.
fn table(radiance: &Texture, shape: &Shape) -> Result<Grid2, DistributionError> {
    sampling_table(|u| {
        let sample = shape.sample_area(u);
        radiance.at(&shape.site_of(&sample)).sum() / sample.pdf
    })
}
