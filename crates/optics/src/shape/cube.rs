//! Cubes, boxes and parallelepipeds.

use super::curve::Curve;
use super::line::Line;
use super::placement::Placement;
use super::planar::Flat;
use super::{AreaDensity, AreaSample, Hit, Intersection, ShapeError, Tessellation, Uv};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::{DAffine3, DMat2, DVec2, DVec3};

const LOCAL: Aabb = Aabb {
    min: DVec3::NEG_ONE,
    max: DVec3::ONE,
};

/// Cube \[−1, 1\]³ under an affine map. Face 2k (2k + 1) is where coordinate k is −1 (+1). On each
/// face, uv ∈ \[0, 1\]² follows the two other coordinates in cyclic order.
#[derive(Clone, Debug, PartialEq)]
pub struct Cube {
    pub(super) placement: Placement,
}

/// Maximum norm below which a local point is certainly not on the surface, whatever the rounding.
const INNER_NORM: f64 = 1.0 - 1e-6;

impl Cube {
    /// Creates the image of the cube.
    ///
    /// # Errors
    /// Fails if the map is not finite or cannot be inverted.
    pub fn new(to_world: DAffine3) -> Result<Self, ShapeError> {
        let placement = Placement::new(to_world, &LOCAL)?;
        Ok(Cube { placement })
    }

    pub(super) fn intersect(&self, arc: &Arc, theta: [f64; 2]) -> Option<Intersection> {
        if arc.is_straight() {
            let line = Line::new(arc, theta, &self.placement);
            let (u, i) = line.cube()?;
            return Some(face(i).intersection(&line, u));
        }
        let within = |p: DVec3| p.abs().max_element() < INNER_NORM;
        let curve = Curve::leaving(arc, theta, &self.placement, &LOCAL, within)?;
        // Accept points slightly beyond the edges, so that no curve slips between two faces.
        let limit = 1.0 + self.placement.noise();
        let mut best: Option<(f64, Flat)> = None;
        for face in (0..6).map(face) {
            let [a, b] = others(face.axis);
            let inside = |p: DVec3| p[a].abs() <= limit && p[b].abs() <= limit;
            let until = best.as_ref().map_or(1.0, |(u, _)| *u);
            if let Some(u) = face.first(&curve, until, inside)
                && (best.is_none() || u < until)
            {
                best = Some((u, face));
            }
        }
        let (u, face) = best?;
        Some(face.intersection(&curve, u))
    }

    pub(super) fn hit(&self, at: &Intersection) -> Hit {
        let face = face(at.primitive as usize);
        let local = at.local.clamp(LOCAL.min, LOCAL.max);
        face.hit(&self.placement, at.theta, local, plain(local, face.axis))
    }

    /// Returns the map from \[−1, 1\]³ to the scene.
    pub fn to_world(&self) -> DAffine3 {
        self.placement.to_world()
    }

    /// Returns the corners.
    pub fn corners(&self) -> [DVec3; 8] {
        LOCAL.corners().map(|p| self.placement.point(p))
    }

    pub(super) fn aabb(&self) -> Aabb {
        self.placement.aabb(|d| d.abs().element_sum())
    }

    pub(super) fn contains(&self, p: DVec3) -> bool {
        self.placement.local(p).abs().max_element() < 1.0
    }

    pub(super) fn volume(&self) -> f64 {
        8.0 * self.placement.determinant()
    }

    pub(super) fn area(&self) -> f64 {
        2.0 * self.face_areas().iter().sum::<f64>()
    }

    pub(super) fn part_areas(&self) -> Vec<f64> {
        let [x, y, z] = self.face_areas();
        vec![x, x, y, y, z, z]
    }

    /// Returns the areas of the faces across each axis.
    fn face_areas(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| 4.0 * self.placement.axis_stretch(axis))
    }

    pub(super) fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let areas = self.face_areas();
        let total = self.area();
        let mut rest = u[0] * total;
        let mut i = 0;
        while i < 5 && rest >= areas[i / 2] {
            rest -= areas[i / 2];
            i += 1;
        }
        let face = face(i);
        let [a, b] = others(face.axis);
        let mut local = face.project(DVec3::ZERO);
        local[a] = (2.0 * rest / areas[face.axis] - 1.0).clamp(-1.0, 1.0);
        local[b] = 2.0 * u[1] - 1.0;
        face.sample(
            &self.placement,
            local,
            plain(local, face.axis),
            total.recip(),
        )
    }

    pub(super) fn inverse_area(&self, position: DVec3, primitive: u32) -> [f64; 2] {
        let (areas, i) = (self.part_areas(), primitive as usize);
        let [a, b] = uv(self.placement.local(position), i / 2);
        let before: f64 = areas[..i].iter().sum();
        [(before + a * areas[i]) / self.area(), b]
    }

    pub(super) fn area_density(&self, _primitive: u32) -> Option<AreaDensity> {
        Some(AreaDensity::Even)
    }

    /// Returns the derivatives of the local position on a face with respect to [`texture_uv`],
    /// whose own derivatives are integers.
    pub(super) fn local_tangents(&self, _local: DVec3, primitive: u32) -> [DVec3; 2] {
        let at = |q| DVec2::from(texture_uv(primitive, q));
        let jacobian = DMat2::from_cols(
            at([1.0, 0.0]) - at([0.0, 0.0]),
            at([0.0, 1.0]) - at([0.0, 0.0]),
        );
        let inverse = jacobian.inverse();
        let [a, b] = others(primitive as usize / 2).map(|k| DVec3::AXES[k] * 2.0);
        [inverse.x_axis, inverse.y_axis].map(|q| a * q.x + b * q.y)
    }

    pub(super) fn moved_along_normals(&self, distance: f64) -> Result<Self, ShapeError> {
        Cube::new(self.placement.grown(distance, DVec3::ZERO))
    }

    pub(super) fn tessellate(&self, all: &mut Tessellation) {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
            all.add_square(|[u, v]| {
                let mut x = [side; 3];
                (x[(axis + 1) % 3], x[(axis + 2) % 3]) = (u, v);
                DVec3::from_array(x)
            });
        }
    }
}

fn face(i: usize) -> Flat {
    let axis = i / 2;
    let at = if i.is_multiple_of(2) { -1.0 } else { 1.0 };
    Flat {
        axis,
        at,
        side: at,
        primitive: i as u32,
    }
}

fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

fn plain(local: DVec3, axis: usize) -> Uv {
    Uv::Plain(uv(local, axis))
}

fn uv(local: DVec3, axis: usize) -> [f64; 2] {
    others(axis).map(|k| 0.5 * (local[k] + 1.0))
}

/// Converts uv on a face to Mitsuba's texture coordinates. Mitsuba's cube is a mesh whose faces are
/// each rotated differently.
pub(super) fn texture_uv(face: u32, [a, b]: [f64; 2]) -> [f64; 2] {
    match face {
        1 => [a, 1.0 - b],
        3 => [1.0 - b, 1.0 - a],
        4 => [1.0 - b, a],
        5 => [b, a],
        _ => [a, b],
    }
}
