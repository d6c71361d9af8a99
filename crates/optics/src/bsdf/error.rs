//! Why a BSDF cannot be built.

use super::microfacet;
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use eikonal::Shown;

/// Why a BSDF cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BsdfError {
    /// A normal map over a surface that keeps its true normal.
    #[error(
        "bump and normal maps take no smooth interfaces: light passes these by the true surface"
    )]
    TrueSurface,
    /// A reflectance or transmittance outside [0, 1].
    #[error("{name} must lie in [0, 1] in every channel, got {}", Shown(*value))]
    Factor {
        /// Which parameter.
        name: &'static str,
        /// First offending channel.
        value: f64,
    },
    /// A roughness that the microfacet model cannot take.
    #[error("alpha must be finite and at least {min}, got {}", Shown(*value), min = microfacet::MIN_ALPHA)]
    Alpha {
        /// The roughness given.
        value: f64,
    },
    /// Facets that are rougher in one direction, under a coat.
    #[error("facets of a {outer} must be equally rough in all directions")]
    Anisotropic {
        /// Which surface they are of.
        outer: &'static str,
    },
    /// A complex index with a part that is negative or not finite.
    #[error("{name} must be finite and ≥ 0 in every channel, got {}", Shown(*value))]
    Index {
        /// Which part, `eta` or `k`.
        name: &'static str,
        /// First offending channel.
        value: f64,
    },
    /// A quantity that is negative or not finite.
    #[error("{name} must be finite and ≥ 0, got {}", Shown(*value))]
    Unbounded {
        /// Which parameter.
        name: &'static str,
        /// First offending value.
        value: f64,
    },
    /// A share of diffuse transmission, times 2, outside [0, 2].
    #[error("diff_trans must lie in [0, 2], got {}", Shown(*value))]
    DiffuseTransmission {
        /// The value given.
        value: f64,
    },
    /// A relative index that is none.
    #[error("the relative index must be finite and greater than 0, got {}", Shown(*value))]
    Eta {
        /// The index given.
        value: f64,
    },
    /// A surface that lets light through, nested where that is not possible.
    #[error("a {outer} takes surfaces that let no light through, such as diffuse or conductor")]
    NotOpaque {
        /// Which surface holds it.
        outer: &'static str,
    },
}

/// A texture whose values lie in [0, 1].
pub(super) fn factor(
    name: &'static str,
    texture: impl Into<Texture>,
) -> Result<Texture, BsdfError> {
    let texture = texture.into();
    let outside = texture.numbers().find(|v| !(0.0..=1.0).contains(v));
    match outside {
        Some(value) => Err(BsdfError::Factor { name, value }),
        None => Ok(texture),
    }
}

/// Checks that a texture's values are finite and not negative.
pub(super) fn unbounded(name: &'static str, texture: &Texture) -> Result<(), BsdfError> {
    match texture.numbers().find(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(value) => Err(BsdfError::Unbounded { name, value }),
        None => Ok(()),
    }
}

/// Checks one part of a complex index.
pub(super) fn check_index(name: &'static str, s: Spectrum) -> Result<(), BsdfError> {
    match s.0.into_iter().find(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(value) => Err(BsdfError::Index { name, value }),
        None => Ok(()),
    }
}

/// Checks an index over another one.
pub(super) fn check_eta(value: f64) -> Result<(), BsdfError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(BsdfError::Eta { value })
    }
}
