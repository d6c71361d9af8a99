//! Colours of the vertices of a mesh.

use super::TextureError;
use crate::Spectrum;
use crate::shape::{Mesh, Site};
use std::sync::Arc;

/// Values at the vertices of a mesh, linear over each triangle.
#[derive(Clone, Debug)]
pub struct VertexColours {
    mesh: Arc<Mesh>,
    colours: Vec<Spectrum>,
}

impl VertexColours {
    /// One value for each vertex of `mesh`, which must be the shape that is coloured.
    pub fn new(mesh: Arc<Mesh>, colours: Vec<Spectrum>) -> Result<Self, TextureError> {
        let (expected, found) = (mesh.positions().len(), colours.len());
        if expected != found {
            return Err(TextureError::Count { expected, found });
        }
        match colours.iter().position(|c| !c.is_finite()) {
            Some(index) => Err(TextureError::NotFinite { index }),
            None => Ok(VertexColours { mesh, colours }),
        }
    }

    pub(super) fn at(&self, site: &Site) -> Spectrum {
        let triangle = site.primitive as usize;
        let weights = self.mesh.weights(triangle, site.position);
        let corners = self.mesh.triangles()[triangle];
        let parts = corners.iter().zip(weights);
        parts.fold(Spectrum::ZERO, |sum, (vertex, weight)| {
            sum + self.colours[*vertex as usize] * weight
        })
    }

    pub(super) fn colours(&self) -> &[Spectrum] {
        &self.colours
    }
}
