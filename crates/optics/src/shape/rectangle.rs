//! Rectangles and parallelograms.

use super::curve::{Curve, Track};
use super::line::Line;
use super::placement::Placement;
use super::planar::Flat;
use super::{AreaDensity, AreaSample, Hit, Intersection, ShapeError, Tessellation, Uv};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::{DAffine3, DVec3};

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

/// Square \[−1, 1\]² at z = 0 under an affine map, facing +z; uv = ((x + 1)/2, (y + 1)/2).
#[derive(Clone, Debug, PartialEq)]
pub struct Rectangle {
    pub(super) placement: Placement,
}

impl Rectangle {
    /// Creates the image of the square.
    ///
    /// # Errors
    /// Fails if the map is not finite or cannot be inverted.
    pub fn new(to_world: DAffine3) -> Result<Self, ShapeError> {
        let placement = Placement::new(to_world, &LOCAL)?;
        Ok(Rectangle { placement })
    }

    pub(super) fn intersect(&self, arc: &Arc, theta: [f64; 2]) -> Option<Intersection> {
        if arc.is_straight() {
            cross(&Line::new(arc, theta, &self.placement))
        } else {
            cross(&Curve::new(arc, theta, &self.placement, &LOCAL)?)
        }
    }

    pub(super) fn hit(&self, at: &Intersection) -> Hit {
        FACE.hit(&self.placement, at.theta, at.local, Uv::Plain(uv(at.local)))
    }

    pub(super) fn aabb(&self) -> Aabb {
        self.placement.aabb(|d| d.x.abs() + d.y.abs())
    }

    pub(super) fn area(&self) -> f64 {
        4.0 * self.placement.axis_stretch(2)
    }

    pub(super) fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let local = DVec3::new(2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0, 0.0);
        FACE.sample(
            &self.placement,
            local,
            Uv::Plain(uv(local)),
            self.area().recip(),
        )
    }

    pub(super) fn inverse_area(&self, position: DVec3, _primitive: u32) -> [f64; 2] {
        uv(self.placement.local(position))
    }

    pub(super) fn area_density(&self, _primitive: u32) -> Option<AreaDensity> {
        Some(AreaDensity::Even)
    }

    pub(super) fn local_tangents(&self, _local: DVec3, _primitive: u32) -> [DVec3; 2] {
        [DVec3::X * 2.0, DVec3::Y * 2.0]
    }

    pub(super) fn moved_along_normals(&self, distance: f64) -> Result<Self, ShapeError> {
        Rectangle::new(self.placement.shifted(distance))
    }

    pub(super) fn tessellate(&self, all: &mut Tessellation) {
        all.add_square(|[x, y]| DVec3::new(x, y, 0.0));
    }
}

#[inline]
fn cross(track: &impl Track) -> Option<Intersection> {
    let u = FACE.first(track, 1.0, |p: DVec3| p.x.abs() <= 1.0 && p.y.abs() <= 1.0)?;
    Some(FACE.intersection(track, u))
}

fn uv(local: DVec3) -> [f64; 2] {
    [0.5 * (local.x + 1.0), 0.5 * (local.y + 1.0)]
}
