//! Thin filters of polarised light, which transmit light undeflected.
//!
//! Theory: docs/theory.md#polarising-filters.

use super::error::factor;
use super::{BsdfError, PartialTransmission, Surface};
use crate::mueller::PlaneMueller;
use crate::shape::Site;
use crate::texture::Texture;
use glam::{DMat4, DVec3, DVec4};
use num_complex::Complex64;

/// Filter without thickness, with the same medium on both sides.
///
/// Scalar renders use the transmittance for unpolarised light.
#[derive(Clone, Debug)]
pub struct PolarizingFilter {
    element: FilterElement,
    transmittance: Texture,
}

/// Effect of a filter on polarised light. Angles are in degrees, between the direction of the first
/// texture coordinate u and an axis in the surface. Seen from the outward side of the shape, u
/// turns to v counter-clockwise.
#[derive(Clone, Debug)]
pub enum FilterElement {
    /// Transmits fields along an axis.
    Polarizer {
        /// Angle of the axis, from u away from v, as in Mitsuba.
        theta: Texture,
    },
    /// Transmits circularly polarised light.
    CircularPolarizer {
        /// True for left-handed light, as seen by an observer who faces the source.
        left_handed: bool,
    },
    /// Delays fields across an axis.
    Retarder {
        /// Angle of the fast axis, from u towards v.
        theta: Texture,
        /// Phase delay in degrees.
        delta: Texture,
    },
    /// Transmits half of the light, with unchanged polarisation.
    Neutral,
}

/// Mueller matrix of a filter, relative to its transmittance of unpolarised light. Both frames
/// share an axis.
#[derive(Clone, Copy, Debug)]
pub struct FilterMueller {
    /// First axis of both frames: a unit vector perpendicular to the light.
    pub axis: DVec3,
    /// Mueller matrix.
    pub matrix: DMat4,
}

impl PolarizingFilter {
    /// Creates the filter. `transmittance`, in [0, 1], multiplies the transmittance of the ideal
    /// filter.
    ///
    /// # Errors
    /// Fails if the transmittance lies outside [0, 1].
    pub fn new(
        element: FilterElement,
        transmittance: impl Into<Texture>,
    ) -> Result<Self, BsdfError> {
        Ok(PolarizingFilter {
            element,
            transmittance: factor("transmittance", transmittance)?,
        })
    }

    pub(super) fn transmittance(&self) -> &Texture {
        &self.transmittance
    }

    /// Returns the transmission of unpolarised light at a site.
    pub(super) fn through(&self, site: &Site) -> PartialTransmission {
        let share = match self.element {
            FilterElement::Retarder { .. } => 1.0,
            _ => 0.5,
        };
        PartialTransmission {
            probability: 1.0,
            factor: self.transmittance.at(site) * share,
        }
    }

    /// Returns the matrix for light along the unit direction `k`.
    pub(crate) fn mueller(&self, s: &Surface, k: DVec3) -> FilterMueller {
        match &self.element {
            FilterElement::Polarizer { theta } => {
                // The filter absorbs the field along the projection of the absorbing axis: J.
                // Korger et al., Opt. Express 21, 2013.
                let absorbing = axis(s, 90.0 - theta.number_at(&s.site));
                let across = absorbing.cross(k).try_normalize();
                FilterMueller {
                    axis: across.unwrap_or_else(|| k.any_orthonormal_vector()),
                    matrix: PlaneMueller::of_real_amplitudes(1.0, 0.0).then(DMat4::IDENTITY),
                }
            }
            FilterElement::CircularPolarizer { left_handed } => {
                let v = if *left_handed { -1.0 } else { 1.0 };
                FilterMueller {
                    axis: k.any_orthonormal_vector(),
                    matrix: DMat4::from_cols(
                        DVec4::new(1.0, 0.0, 0.0, v),
                        DVec4::ZERO,
                        DVec4::ZERO,
                        DVec4::new(v, 0.0, 0.0, 1.0),
                    ),
                }
            }
            FilterElement::Retarder { theta, delta } => {
                let fast = axis(s, theta.number_at(&s.site));
                let across = fast.reject_from_normalized(k).try_normalize();
                // Planted error "retarders whose fast axis is slow", found by morgana-transport/transport::polarization::filters::filters_do_what_those_of_mitsuba_do:
                // let delay = Complex64::cis(-delta.number_at(&s.site).to_radians());
                let delay = Complex64::cis(delta.number_at(&s.site).to_radians());
                FilterMueller {
                    axis: across.unwrap_or_else(|| k.any_orthonormal_vector()),
                    matrix: PlaneMueller::of_amplitudes(1.0.into(), delay).then(DMat4::IDENTITY),
                }
            }
            FilterElement::Neutral => FilterMueller {
                axis: k.any_orthonormal_vector(),
                matrix: DMat4::IDENTITY,
            },
        }
    }
}

/// Returns the axis in a surface at an angle in degrees.
fn axis(s: &Surface, degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let frame = s.frame();
    frame.s * cos + frame.t * sin
}
