//! Objects of a scene that is being built.

use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::scene::Object;
use crate::shape::Shape;

/// An object of a scene that is being built: a shape, its surface, and the names of the media on
/// its two sides.
#[derive(Clone, Debug)]
pub struct ObjectBuilder {
    pub(super) name: String,
    pub(super) shape: Shape,
    pub(super) bsdf: Option<Bsdf>,
    pub(super) interior: Option<String>,
    pub(super) exterior: Option<String>,
    pub(super) emission: Option<Spectrum>,
}

impl Object {
    /// Starts an object for a [`SceneBuilder`](super::SceneBuilder). [`bsdf`](ObjectBuilder::bsdf)
    /// sets the surface. By default an emitter is black, and other objects with an interior medium
    /// have a null surface. All others are diffuse with a reflectance of 0.5.
    pub fn builder(name: impl Into<String>, shape: impl Into<Shape>) -> ObjectBuilder {
        ObjectBuilder {
            name: name.into(),
            shape: shape.into(),
            bsdf: None,
            interior: None,
            exterior: None,
            emission: None,
        }
    }
}

impl ObjectBuilder {
    /// Sets the bsdf of the surface.
    pub fn bsdf(self, bsdf: Bsdf) -> Self {
        ObjectBuilder {
            bsdf: Some(bsdf),
            ..self
        }
    }

    /// Sets the interior [medium](super::SceneBuilder::medium) by name.
    pub fn interior(self, medium: impl Into<String>) -> Self {
        ObjectBuilder {
            interior: Some(medium.into()),
            ..self
        }
    }

    /// Sets the exterior [medium](super::SceneBuilder::medium) by name, if it is not the ambient
    /// medium.
    pub fn exterior(self, medium: impl Into<String>) -> Self {
        ObjectBuilder {
            exterior: Some(medium.into()),
            ..self
        }
    }

    /// Makes the surface emit this radiance from the side to which its normals point, in W/(m² sr)
    /// if lengths are in metres.
    pub fn emission(self, radiance: impl Into<Spectrum>) -> Self {
        ObjectBuilder {
            emission: Some(radiance.into()),
            ..self
        }
    }
}
