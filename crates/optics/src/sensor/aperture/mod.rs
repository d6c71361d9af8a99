//! Apertures: open part of a lens or stop, and its diffraction.

mod encircled_energy;
mod iris;
mod mask;
mod mask_pattern;
mod point_spread;
mod sharpen;

pub use iris::Iris;
pub use point_spread::PointSpread;

use crate::sampling::DistributionError;
use crate::sampling::disc::{disc_to_ring, uniform_disc_sample};
use glam::DVec2;
use mask::Mask;
use std::f64::consts::PI;
use std::sync::Arc;

/// Shape of an aperture of radius one, in the local axes of its sensor: a ring, or cells that
/// transmit part of the light.
///
/// Copies are cheap and share the diffraction pattern. For shapes other than rings, computing the
/// pattern takes a fraction of a second.
#[derive(Clone, Debug)]
pub struct ApertureShape(Shape);

#[derive(Clone, Debug)]
enum Shape {
    /// Disc whose centre is covered up to a fraction of its radius, in [0, 1).
    Ring(f64),
    Mask(Arc<Mask>),
}

/// Reason why an aperture cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ApertureError {
    /// The obscuration, as a fraction of the radius, is out of range.
    #[error("the obscuration must be in [0, 1), but it is {0}")]
    Obscuration(f64),
    /// The number of blades of an iris is out of range.
    #[error("an iris has 3 to {MAX_EDGES} blades, or 0 where it is round, not {0}")]
    Blades(u32),
    /// There are too many vanes.
    #[error("there may be up to {MAX_EDGES} vanes, not {0}")]
    Vanes(u32),
    /// The width of vanes is out of range.
    #[error(
        "the width of the vanes must be above 0 and at most 1, as a fraction of the radius, but it is {0}"
    )]
    VaneWidth(f64),
    /// An angle is not finite.
    #[error("angles must be finite, but one is {0}")]
    Angle(f64),
    /// The number of cells along a side of a mask is out of range.
    #[error(
        "a picture of an aperture has 1 to {MAX_CELLS} pixels along each side, not {0}: scale it"
    )]
    Cells(usize),
    /// The number of values of a mask does not match its size.
    #[error("a picture of {expected} pixels has {found} values")]
    Length {
        /// Square of the number of cells along a side.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// The transmittance of a cell is out of range.
    #[error("pixels of an aperture must be fractions of power in [0, 1], but one is {0}")]
    Transmittance(f64),
    /// The aperture has no open part.
    #[error(
        "the aperture is completely covered by blades, vanes, an obscuration or a picture: open a part of it"
    )]
    Closed,
}

/// Maximum number of blades, and of vanes.
const MAX_EDGES: u32 = 100;
/// Maximum number of cells along a side of a mask.
const MAX_CELLS: usize = 512;

impl From<DistributionError> for ApertureError {
    /// Converts the error. Values have been checked before, so only a sum of zero remains.
    fn from(_: DistributionError) -> Self {
        ApertureError::Closed
    }
}

impl Default for ApertureShape {
    /// Returns a disc.
    fn default() -> Self {
        ApertureShape(Shape::Ring(0.0))
    }
}

impl ApertureShape {
    /// Creates the opening of an iris. It is exact without blades and vanes. Otherwise it has 256 ×
    /// 256 cells, which transmit the open fraction of their area.
    ///
    /// # Errors
    /// Fails if a number is out of range, or if nothing is open: see [`ApertureError`].
    pub fn new(iris: Iris) -> Result<Self, ApertureError> {
        iris.check()?;
        if iris.is_ring() {
            return Ok(ApertureShape(Shape::Ring(iris.obscuration)));
        }
        let open = iris.open_shares();
        ApertureShape::mask(Mask::new(iris::CELLS, iris::amplitudes(&open), &open))
    }

    /// Creates an aperture from a picture of the square around the disc. The picture has `side` ×
    /// `side` cells, with `side` from 1 to 512. `transmittances` holds the fraction in [0, 1] of
    /// the power that each cell transmits, row by row from the top left, as seen from behind the
    /// sensor. The phase is equal in all cells.
    ///
    /// # Errors
    /// Fails if the number of cells does not match, if values are out of range, or if nothing is
    /// open. See [`ApertureError`].
    pub fn picture(side: usize, transmittances: &[f64]) -> Result<Self, ApertureError> {
        if !(1..=MAX_CELLS).contains(&side) {
            return Err(ApertureError::Cells(side));
        }
        let (expected, found) = (side * side, transmittances.len());
        if expected != found {
            return Err(ApertureError::Length { expected, found });
        }
        if let Some(t) = transmittances.iter().find(|t| !(0.0..=1.0).contains(*t)) {
            return Err(ApertureError::Transmittance(*t));
        }
        // Planted error "pictures of apertures whose fields are their powers", found by morgana-transport/transport::apertures::pictures_diffract_by_the_roots_of_what_they_let_pass:
        // let amplitudes = transmittances.to_vec();
        let amplitudes = transmittances.iter().map(|t| t.sqrt()).collect();
        ApertureShape::mask(Mask::new(side, amplitudes, transmittances))
    }

    fn mask(mask: Result<Mask, ApertureError>) -> Result<Self, ApertureError> {
        mask.map(|mask| ApertureShape(Shape::Mask(Arc::new(mask))))
    }

    /// Samples a point of the aperture, uniformly by transmitted power.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec2 {
        match &self.0 {
            Shape::Ring(obscuration) => disc_to_ring(*obscuration, uniform_disc_sample(u)),
            Shape::Mask(mask) => mask.sample(u),
        }
    }

    /// Returns the open area: the integral of the transmitted fraction of the power.
    pub(super) fn area(&self) -> f64 {
        match &self.0 {
            Shape::Ring(obscuration) => PI * (1.0 - obscuration * obscuration),
            Shape::Mask(mask) => mask.area(),
        }
    }
}
