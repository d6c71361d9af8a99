//! Shading normals and tangents of surfaces (docs/theory.md#shading-normals).

use super::{Shape, Site, each};
use glam::DVec3;

impl Shape {
    /// Returns the unit normal for shading at a point with geometric unit normal `normal`, on the
    /// same side. It is interpolated on a mesh with vertex normals, and equal to the geometric
    /// normal elsewhere.
    pub fn shading_normal(&self, site: &Site, normal: DVec3) -> DVec3 {
        match self {
            Shape::Mesh(mesh) => mesh.shading_normal(site, normal),
            _ => normal,
        }
    }

    /// Returns the local y axis of the shape as a vector in the scene, of any length. Meshes return
    /// the y axis of the scene.
    pub fn y_axis(&self) -> DVec3 {
        each!(self, s => s.placement.vector(DVec3::Y), {
            Shape::Mesh(_) => DVec3::Y,
            Shape::VoxelFaces(faces) => faces.y_axis(),
        })
    }

    /// Returns the derivatives of the position with respect to the texture coordinates, in scene
    /// units. They are zero where they do not exist, as at poles.
    pub fn tangents(&self, site: &Site) -> [DVec3; 2] {
        each!(self, s => {
            let local = s.placement.local(site.position);
            let tangents = s.local_tangents(local, site.primitive);
            tangents.map(|t| s.placement.vector(t))
        }, {
            Shape::Mesh(mesh) => mesh.tangents(site.primitive as usize),
            Shape::VoxelFaces(faces) => faces.tangents(site.primitive),
        })
    }
}
