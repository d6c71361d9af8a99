//! Objects of a scene that is being built.

use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::scene::Object;
use crate::shape::Shape;

/// An object of a scene that is being built: a shape, its surface, and the names of the media on either side.
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
    /// An object for a [`SceneBuilder`](super::SceneBuilder). Unless [`bsdf`](ObjectBuilder::bsdf) says otherwise its surface lets
    /// light pass if it holds a medium, is black if it emits light, and else diffuse with a reflectance of 0.5.
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
    /// The surface.
    pub fn bsdf(self, bsdf: Bsdf) -> Self {
        ObjectBuilder {
            bsdf: Some(bsdf),
            ..self
        }
    }

    /// Name of the [medium](super::SceneBuilder::medium) inside.
    pub fn interior(self, medium: impl Into<String>) -> Self {
        ObjectBuilder {
            interior: Some(medium.into()),
            ..self
        }
    }

    /// Name of the [medium](super::SceneBuilder::medium) outside, if it is not the ambient one.
    pub fn exterior(self, medium: impl Into<String>) -> Self {
        ObjectBuilder {
            exterior: Some(medium.into()),
            ..self
        }
    }

    /// Makes the surface emit this radiance, W/(m² sr) if lengths are in metres, from the side to which its normals point.
    pub fn emission(self, radiance: impl Into<Spectrum>) -> Self {
        ObjectBuilder {
            emission: Some(radiance.into()),
            ..self
        }
    }
}
