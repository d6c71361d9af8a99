//! Disks and flat ellipses.

use super::curve::{Curve, Track};
use super::line::Line;
use super::placement::Placement;
use super::planar::Flat;
use super::{
    AreaDensity, AreaSample, Hit, Intersection, ShapeError, Tessellation, Uv, circle,
    polar_tangents,
};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::{DAffine3, DVec3};
use std::f64::consts::PI;

const LOCAL: Aabb = Aabb {
    min: DVec3::new(-1.0, -1.0, 0.0),
    max: DVec3::new(1.0, 1.0, 0.0),
};

const FACE: Flat = Flat {
    axis: 2,
    at: 0.0,
    side: 1.0,
    primitive: 0,
};

/// Unit disk at z = 0 under an affine map, facing +z; uv = (r, φ/2π).
#[derive(Clone, Debug, PartialEq)]
pub struct Disk {
    pub(super) placement: Placement,
}

impl Disk {
    /// Creates the image of the unit disk.
    ///
    /// # Errors
    /// Fails if the map is not finite or cannot be inverted.
    pub fn new(to_world: DAffine3) -> Result<Self, ShapeError> {
        let placement = Placement::new(to_world, &LOCAL)?;
        Ok(Disk { placement })
    }

    pub(super) fn intersect(&self, arc: &Arc, theta: [f64; 2]) -> Option<Intersection> {
        if arc.is_straight() {
            cross(&Line::new(arc, theta, &self.placement))
        } else {
            cross(&Curve::new(arc, theta, &self.placement, &LOCAL)?)
        }
    }

    pub(super) fn hit(&self, at: &Intersection) -> Hit {
        FACE.hit(&self.placement, at.theta, at.local, Uv::Disk(at.local))
    }

    pub(super) fn aabb(&self) -> Aabb {
        self.placement.aabb(|d| d.truncate().length())
    }

    pub(super) fn area(&self) -> f64 {
        PI * self.placement.axis_stretch(2)
    }

    pub(super) fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let local = point(u).extend(0.0);
        FACE.sample(&self.placement, local, Uv::Disk(local), self.area().recip())
    }

    pub(super) fn inverse_area(&self, position: DVec3, _primitive: u32) -> [f64; 2] {
        inverse(self.placement.local(position))
    }

    pub(super) fn area_density(&self, _primitive: u32) -> Option<AreaDensity> {
        Some(AreaDensity::Radial)
    }

    pub(super) fn local_tangents(&self, local: DVec3, _primitive: u32) -> [DVec3; 2] {
        polar_tangents(local)
    }

    pub(super) fn moved_along_normals(&self, distance: f64) -> Result<Self, ShapeError> {
        Disk::new(self.placement.shifted(distance))
    }

    pub(super) fn tessellate(&self, all: &mut Tessellation) {
        all.add_disk(0.0);
    }
}

#[inline]
fn cross(track: &impl Track) -> Option<Intersection> {
    let u = FACE.first(track, 1.0, |p: DVec3| p.truncate().length_squared() <= 1.0)?;
    Some(FACE.intersection(track, u))
}

/// Returns the uniform numbers that `point` maps to a local point.
pub(super) fn inverse(local: DVec3) -> [f64; 2] {
    let [r, turn] = Uv::Disk(local).get();
    [r * r, turn]
}

/// Maps two uniform numbers to a point of the unit disk, uniformly in area.
pub(super) fn point(u: [f64; 2]) -> glam::DVec2 {
    glam::DVec2::from(circle(u[1])) * u[0].sqrt()
}
