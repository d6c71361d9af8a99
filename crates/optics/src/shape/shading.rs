//! By which normal and along which tangents a surface scatters light (docs/theory.md#shading-normals).

use super::{Shape, Site};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

impl Shape {
    /// Unit normal for shading at a point with true unit normal `normal`, on its side: interpolated on a mesh whose vertices have
    /// normals, the true one elsewhere.
    pub fn shading_normal(&self, site: &Site, normal: DVec3) -> DVec3 {
        match self {
            Shape::Mesh(mesh) => mesh.shading_normal(site, normal),
            _ => normal,
        }
    }

    /// The y axis of the shape in its own frame, as a vector in the scene of any length; that of the scene for meshes.
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

    /// Derivatives of the position with respect to the texture coordinates of a point, in scene units; zero where there are none,
    /// as at poles.
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
