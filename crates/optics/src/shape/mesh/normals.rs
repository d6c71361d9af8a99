//! Normals of the vertices of a mesh (docs/theory.md#shading-normals).

use super::{Mesh, cross};
use crate::shape::{ShapeError, Site};
use glam::DVec3;

impl Mesh {
    /// The mesh with a normal for each vertex, of any length; where the normals of a triangle add up to nothing, or are not
    /// finite, its own stands. Triangles of an open mesh that face away from their normals are turned.
    ///
    /// # Errors
    /// Normals that are not as many as vertices.
    pub fn with_normals(mut self, normals: Vec<DVec3>) -> Result<Self, ShapeError> {
        let (expected, got) = (self.positions.len(), normals.len());
        if expected != got {
            return Err(ShapeError::NormalCount { expected, got });
        }
        let normals: Vec<DVec3> = normals.iter().map(|n| n.normalize_or_zero()).collect();
        if !self.closed {
            for i in 0..self.triangles.len() {
                let around: DVec3 = self.triangles[i].iter().map(|v| normals[*v as usize]).sum();
                if cross(self.triangle(i)).dot(around) < 0.0 {
                    self.triangles[i].swap(1, 2);
                }
            }
        }
        self.normals = Some(normals);
        Ok(self)
    }

    /// The mesh with the mean normal of the triangles around each vertex, weighted by their angles there (G. Thürmer and
    /// C. Wüthrich, "Computing vertex normals from polygonal facets", 1998). Triangles that share a vertex by its place alone are
    /// not averaged.
    pub fn with_smooth_normals(self) -> Self {
        self.with_normals_around(|vertex| vertex)
    }

    /// The same where vertices that seams of texture coordinates have split count as one: `originals` says for each vertex of which it
    /// is a copy, which may be itself.
    ///
    /// # Errors
    /// Originals that are not as many as vertices, or one that there is not.
    pub fn with_smooth_normals_across(self, originals: &[u32]) -> Result<Self, ShapeError> {
        let (expected, got) = (self.positions.len(), originals.len());
        if expected != got || originals.iter().any(|v| *v as usize >= expected) {
            return Err(ShapeError::Originals { expected });
        }
        Ok(self.with_normals_around(|vertex| originals[vertex] as usize))
    }

    fn with_normals_around(mut self, original: impl Fn(usize) -> usize) -> Self {
        let mut normals = vec![DVec3::ZERO; self.positions.len()];
        for (i, corners) in self.triangles.iter().enumerate() {
            let t = self.triangle(i);
            let normal = cross(t).normalize_or_zero();
            for k in 0..3 {
                let [a, b] = [1, 2].map(|j| t[(k + j) % 3] - t[k]);
                normals[original(corners[k] as usize)] += normal * a.angle_between(b);
            }
        }
        let unit = |vertex| normals[original(vertex)].normalize_or_zero();
        self.normals = Some((0..normals.len()).map(unit).collect());
        self
    }

    /// Whether its vertices have normals.
    pub fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// The normal that is interpolated at a point, on the side of the true one.
    pub(in crate::shape) fn shading_normal(&self, site: &Site, normal: DVec3) -> DVec3 {
        let Some(normals) = &self.normals else {
            return normal;
        };
        let triangle = site.primitive as usize;
        let weights = self.weights(triangle, site.position);
        let corners = self.triangles[triangle].iter().zip(weights);
        let sum = corners.fold(DVec3::ZERO, |sum, (vertex, weight)| {
            sum + normals[*vertex as usize] * weight
        });
        let interpolated = sum.normalize_or(normal);
        if interpolated.dot(normal) < 0.0 {
            -interpolated
        } else {
            interpolated
        }
    }

    /// Derivatives of the position with respect to texture coordinates on triangle `i`: barycentric ones if none were given, or
    /// if they say nothing.
    pub(in crate::shape) fn tangents(&self, i: usize) -> [DVec3; 2] {
        let [a, b, c] = self.triangle(i);
        let sides = [b - a, c - a];
        let corner = |w| self.uv(i, w);
        let [o, p, q] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(corner);
        let [p, q] = [p, q].map(|r| [r[0] - o[0], r[1] - o[1]]);
        let det = p[0] * q[1] - p[1] * q[0];
        if det == 0.0 {
            return sides;
        }
        [
            (sides[0] * q[1] - sides[1] * p[1]) / det,
            (sides[1] * p[0] - sides[0] * q[0]) / det,
        ]
    }
}
