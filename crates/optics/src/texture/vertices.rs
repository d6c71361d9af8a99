//! Colours of the vertices or of the triangles of a mesh.

use super::TextureError;
use crate::Spectrum;
use crate::shape::{Mesh, Site};
use std::sync::Arc;

/// Values at the vertices of a mesh, linear over each triangle, or of its triangles.
#[derive(Clone, Debug)]
pub struct VertexColours {
    mesh: Arc<Mesh>,
    colours: Vec<Spectrum>,
    /// Whether there is a value for each triangle.
    of_triangles: bool,
}

impl VertexColours {
    /// One value for each vertex of `mesh`, which must be the shape that is coloured.
    ///
    /// # Errors
    /// Values that are not as many as vertices, or not finite.
    pub fn new(mesh: Arc<Mesh>, colours: Vec<Spectrum>) -> Result<Self, TextureError> {
        let expected = mesh.positions().len();
        VertexColours {
            mesh,
            colours,
            of_triangles: false,
        }
        .checked(expected)
    }

    /// One value for each triangle of `mesh`, which must be the shape that is coloured.
    ///
    /// # Errors
    /// Values that are not as many as triangles, or not finite.
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

    /// Calls `see` with each colour that counts at a point, and its weight.
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
