//! Normals of the vertices of a mesh (docs/theory.md#shading-normals).

use super::{Mesh, cross};
use crate::shape::{ShapeError, Site};
use glam::DVec3;

/// Largest angle in radians between the normals of a vertex and a triangle that counts as rounding:
/// two units in the sixth decimal, the last one that common file formats write.
const MAX_FLAT_DEVIATION: f64 = 2e-6;

impl Mesh {
    /// Returns the mesh with a normal for each vertex, of any length. Where the normals of a
    /// triangle cancel or are not finite, the geometric normal is used. Triangles of an open mesh
    /// that face away from their normals are reversed.
    ///
    /// # Errors
    /// Fails if the number of normals differs from the number of vertices.
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
        Ok(self.shaded_by(normals))
    }

    /// Returns the mesh with the mean normal of the triangles around each vertex, weighted by their
    /// angles there (G. Thürmer and C. Wüthrich, "Computing vertex normals from polygonal facets",
    /// 1998). Triangles are averaged only if they share a vertex index; equal positions do not
    /// suffice.
    pub fn with_smooth_normals(self) -> Self {
        self.with_normals_around(|vertex| vertex)
    }

    /// Returns the mesh with mean normals like [`Mesh::with_smooth_normals`], and treats vertices
    /// split by seams of texture coordinates as one. `originals` holds the original of each vertex.
    /// A vertex that is no copy is its own original.
    ///
    /// # Errors
    /// Fails if the number of originals differs from the number of vertices, or if an original does
    /// not exist.
    pub fn with_smooth_normals_across(self, originals: &[u32]) -> Result<Self, ShapeError> {
        let (expected, got) = (self.positions.len(), originals.len());
        if expected != got || originals.iter().any(|v| *v as usize >= expected) {
            return Err(ShapeError::Originals { expected });
        }
        Ok(self.with_normals_around(|vertex| originals[vertex] as usize))
    }

    fn with_normals_around(self, original: impl Fn(usize) -> usize) -> Self {
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
        let normals = (0..normals.len()).map(unit).collect();
        self.shaded_by(normals)
    }

    /// Returns the mesh with unit normals of its vertices. Drops them if all are the normals of
    /// their triangles to rounding, because shading by such normals takes time and changes nothing.
    fn shaded_by(mut self, normals: Vec<DVec3>) -> Self {
        let is_flat = |(i, corners): (usize, &[u32; 3])| {
            let normal = cross(self.triangle(i)).normalize_or_zero();
            corners.iter().all(|vertex| {
                let deviation = normals[*vertex as usize].cross(normal).length();
                deviation <= MAX_FLAT_DEVIATION
            })
        };
        let flat = self.triangles.iter().enumerate().all(is_flat);
        // Planted error "flat meshes shaded by rounded normals", found by morgana-transport/transport::shape::mesh::rounded_normals_shade_no_flat_mesh:
        // self.normals = Some(normals);
        self.normals = (!flat).then_some(normals);
        self
    }

    /// Returns the interpolated normal at a point, on the side of the geometric normal.
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

    /// Returns the derivatives of the position with respect to texture coordinates on triangle `i`.
    /// The barycentric coordinates replace texture coordinates that are missing or degenerate.
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
