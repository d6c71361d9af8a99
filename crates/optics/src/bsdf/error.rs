//! Errors of BSDFs.

use super::microfacet;
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use eikonal::Shown;

/// Reason why a BSDF cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BsdfError {
    /// A normal map is applied to a surface that ignores shading normals.
    #[error(
        "bump and normal maps do not support smooth interfaces, where light follows the true surface"
    )]
    TrueSurface,
    /// A reflectance or transmittance lies outside [0, 1].
    #[error("{name} must lie in [0, 1] in every channel, got {}", Shown(*value))]
    Factor {
        /// Name of the parameter.
        name: &'static str,
        /// First offending channel.
        value: f64,
    },
    /// A roughness lies outside the range of the microfacet model.
    #[error("alpha must be finite and at least {min}, got {}", Shown(*value), min = microfacet::MIN_ALPHA)]
    Alpha {
        /// The roughness given.
        value: f64,
    },
    /// Facets under a coat have anisotropic roughness.
    #[error("facets of a {outer} must be equally rough in all directions")]
    Anisotropic {
        /// Name of the surface with the facets.
        outer: &'static str,
    },
    /// A complex index has a part that is negative or not finite.
    #[error("{name} must be finite and ≥ 0 in every channel, got {}", Shown(*value))]
    Index {
        /// Name of the part, `eta` or `k`.
        name: &'static str,
        /// First offending channel.
        value: f64,
    },
    /// A quantity is negative or not finite.
    #[error("{name} must be finite and ≥ 0, got {}", Shown(*value))]
    Unbounded {
        /// Name of the parameter.
        name: &'static str,
        /// First offending value.
        value: f64,
    },
    /// The fraction of diffuse transmission, times 2, lies outside [0, 2].
    #[error("diff_trans must lie in [0, 2], got {}", Shown(*value))]
    DiffuseTransmission {
        /// The value given.
        value: f64,
    },
    /// A relative index is not finite or not positive.
    #[error("the relative index must be finite and greater than 0, got {}", Shown(*value))]
    Eta {
        /// The index given.
        value: f64,
    },
    /// A surface that transmits light is nested in a surface that requires opaque ones.
    #[error("a {outer} takes surfaces that let no light through, such as diffuse or conductor")]
    NotOpaque {
        /// Name of the outer surface.
        outer: &'static str,
    },
}

/// Checks that the values of a texture lie in [0, 1].
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

/// Checks that the values of a texture are finite and not negative.
pub(super) fn unbounded(name: &'static str, texture: &Texture) -> Result<(), BsdfError> {
    match texture.numbers().find(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(value) => Err(BsdfError::Unbounded { name, value }),
        None => Ok(()),
    }
}

/// Checks a part of a complex index.
pub(super) fn check_index(name: &'static str, s: Spectrum) -> Result<(), BsdfError> {
    match s.0.into_iter().find(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(value) => Err(BsdfError::Index { name, value }),
        None => Ok(()),
    }
}

/// Checks a relative index.
pub(super) fn check_eta(value: f64) -> Result<(), BsdfError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(BsdfError::Eta { value })
    }
}
