//! Colours of the vertices or of the triangles of a mesh.

use super::TextureError;
use crate::Spectrum;
use crate::shape::{Mesh, Site};
use std::sync::Arc;

/// Values at the vertices of a mesh, linear over each triangle, or constant values of its
/// triangles.
#[derive(Clone, Debug)]
pub struct VertexColours {
    mesh: Arc<Mesh>,
    colours: Vec<Spectrum>,
    /// True if there is one value per triangle.
    of_triangles: bool,
}

impl VertexColours {
    /// Creates the texture from one value per vertex of `mesh`, which must be the coloured shape.
    ///
    /// # Errors
    /// Fails if the number of values differs from the number of vertices, or if a value is not
    /// finite.
    pub fn new(mesh: Arc<Mesh>, colours: Vec<Spectrum>) -> Result<Self, TextureError> {
        let expected = mesh.positions().len();
        VertexColours {
            mesh,
            colours,
            of_triangles: false,
        }
        .checked(expected)
    }

    /// Creates the texture from one value per triangle of `mesh`, which must be the coloured shape.
    ///
    /// # Errors
    /// Fails if the number of values differs from the number of triangles, or if a value is not
    /// finite.
    pub fn of_triangles(mesh: Arc<Mesh>, colours: Vec<Spectrum>) -> Result<Self, TextureError> {
        let expected = mesh.triangles().len();
        VertexColours {
            mesh,
            colours,
            of_triangles: true,
        }
        .checked(expected)
    }

    fn checked(self, expected: usize) -> Result<Self, TextureError> {
        let found = self.colours.len();
        if expected != found {
            return Err(TextureError::Count { expected, found });
        }
        match self.colours.iter().position(|c| !c.is_finite()) {
            Some(index) => Err(TextureError::NotFinite { index }),
            None => Ok(self),
        }
    }

    pub(super) fn at(&self, site: &Site) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        self.weights(site, |i, weight| sum += self.colours[i] * weight);
        sum
    }

    /// Calls `see` with each colour that contributes at a point, and its weight.
    pub(super) fn weights(&self, site: &Site, mut see: impl FnMut(usize, f64)) {
        let triangle = site.primitive as usize;
        if self.of_triangles {
            return see(triangle, 1.0);
        }
        let weights = self.mesh.weights(triangle, site.position);
        let corners = self.mesh.triangles()[triangle];
        for (vertex, weight) in corners.into_iter().zip(weights) {
            see(vertex as usize, weight);
        }
    }

    pub(super) fn colours(&self) -> &[Spectrum] {
        &self.colours
    }
}
