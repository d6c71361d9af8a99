//! Shading normals and tangents of surfaces (docs/theory.md#shading-normals).

use super::{Shape, Site};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

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
        let placement = match self {
            Shape::Mesh(_) => return DVec3::Y,
            Shape::VoxelFaces(faces) => return faces.y_axis(),
            Shape::Sphere(s) => &s.placement,
            Shape::Cube(s) => &s.placement,
            Shape::Rectangle(s) => &s.placement,
            Shape::Disk(s) => &s.placement,
            Shape::Cylinder(s) => &s.placement,
        };
        placement.vector(DVec3::Y)
    }

    /// Returns the derivatives of the position with respect to the texture coordinates, in scene
    /// units. They are zero where they do not exist, as at poles.
    pub fn tangents(&self, site: &Site) -> [DVec3; 2] {
        let placement = match self {
            Shape::Mesh(mesh) => return mesh.tangents(site.primitive as usize),
            Shape::VoxelFaces(faces) => return faces.tangents(site.primitive),
            Shape::Sphere(s) => &s.placement,
            Shape::Cube(s) => &s.placement,
            Shape::Rectangle(s) => &s.placement,
            Shape::Disk(s) => &s.placement,
            Shape::Cylinder(s) => &s.placement,
        };
        let local = placement.local(site.position);
        let around = DVec3::new(-local.y, local.x, 0.0) * TAU;
        let outward = local.with_z(0.0).normalize_or_zero();
        let tangents = match self {
            Shape::Sphere(_) => {
                let meridian = (outward * local.z).with_z(-local.truncate().length());
                [around, meridian * PI]
            }
            Shape::Cylinder(_) if site.primitive == 0 => [around, DVec3::Z],
            Shape::Disk(_) | Shape::Cylinder(_) => [outward, around],
            Shape::Cube(_) => super::cube::tangents(site.primitive),
            _ => [DVec3::X * 2.0, DVec3::Y * 2.0],
        };
        tangents.map(|t| placement.vector(t))
    }
}
