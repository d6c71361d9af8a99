//! Surface coordinates that are computed on request.

use super::turn;
use glam::DVec3;
use std::f64::consts::PI;

/// Coordinates on a surface, stored as the data from which they are computed. Angles take time, and
/// few textures need them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Uv {
    /// Coordinates u and v.
    Plain([f64; 2]),
    /// (φ/2π, ϑ/π) of a local direction, with ϑ from +z.
    Sphere(DVec3),
    /// (φ/2π, z) of a local point.
    Cylinder(DVec3),
    /// (r, φ/2π) of a local point in the plane z = 0.
    Disk(DVec3),
}

impl Uv {
    /// Returns u and v.
    pub fn get(&self) -> [f64; 2] {
        match *self {
            Uv::Plain(uv) => uv,
            Uv::Sphere(DVec3 { x, y, z }) => [turn(x, y), libm::atan2(x.hypot(y), z) / PI],
            Uv::Cylinder(DVec3 { x, y, z }) => [turn(x, y), z],
            Uv::Disk(local) => [local.truncate().length(), turn(local.x, local.y)],
        }
    }
}

impl Default for Uv {
    fn default() -> Self {
        Uv::Plain([0.0; 2])
    }
}
