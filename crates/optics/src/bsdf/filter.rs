//! Thin filters of polarised light: what is left passes straight on.
//!
//! Theory: docs/theory.md#polarising-filters.

use super::error::factor;
use super::{BsdfError, PartialTransmission, Surface};
use crate::mueller::PlaneMueller;
use crate::shape::Site;
use crate::texture::Texture;
use glam::{DMat4, DVec3, DVec4};
use num_complex::Complex64;

/// A filter of no thickness, with the same medium on both sides.
///
/// Renders that know no polarisation take the share of unpolarised light.
#[derive(Clone, Debug)]
pub struct PolarizingFilter {
    element: FilterElement,
    transmittance: Texture,
}

/// What a filter does to polarised light. Angles are numbers in degrees between the direction of the first texture coordinate u and an axis
/// in the surface. For who looks at the shape's outward side, u turns to v against the clock.
#[derive(Clone, Debug)]
pub enum FilterElement {
    /// Lets fields along an axis pass.
    Polarizer {
        /// The axis, from u away from v, as in Mitsuba.
        theta: Texture,
    },
    /// Lets circular light pass.
    CircularPolarizer {
        /// Of left-handed light, for who looks at its source.
        left_handed: bool,
    },
    /// Delays fields across an axis.
    Retarder {
        /// The axis, along which light is fast, from u towards v.
        theta: Texture,
        /// The delay of phase, in degrees.
        delta: Texture,
    },
    /// Lets half of the light pass, as it is.
    Neutral,
}

/// A Mueller matrix per what the filter does to unpolarised light, in frames of an axis before and after.
#[derive(Clone, Copy, Debug)]
pub struct FilterMueller {
    /// Unit vector, across which light passes, that the frames share.
    pub axis: DVec3,
    /// The matrix.
    pub matrix: DMat4,
}

impl PolarizingFilter {
    /// `transmittance`, in [0, 1], multiplies what the ideal filter lets pass.
    ///
    /// # Errors
    /// A transmittance outside [0, 1].
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

    /// Unpolarised light that passes at a site.
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

    /// What becomes of light in the unit direction `k`.
    pub(crate) fn mueller(&self, s: &Surface, k: DVec3) -> FilterMueller {
        match &self.element {
            FilterElement::Polarizer { theta } => {
                // What is absorbed is the projection of the absorbing axis: J. Korger et al., Opt. Express 21, 2013.
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

/// The axis in a surface at an angle in degrees.
fn axis(s: &Surface, degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let frame = s.frame();
    frame.s * cos + frame.t * sin
}
