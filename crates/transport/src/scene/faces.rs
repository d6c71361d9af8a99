//! Emitters and sensors exactly on a face, and the side of the face on which they act.
//!
//! A directed emitter or sensor on a face of a body lies outside the body, as in the limit from
//! outside: its light passes the face. On a face between two bodies that do not contain each other,
//! it lies behind the face with respect to its direction. The result is the same on a sheet that
//! transmits light. On an opaque sheet it lies in front. A point that radiates in all directions
//! lies on all sides: its light starts in the medium in its direction.

use super::Scene;
use super::coincident::{LAYER, TOUCH};
use super::containment::{Bodies, Containment};
use super::index::Index;
use super::parts::{Object, Parts};
use crate::emitter::{Emitter, PointOnFace};
use crate::sampling::evenly_spread;
use crate::sensor::{Batch, Sensor};
use crate::shape::DIRECTIONS;
use glam::{DMat3, DVec3};
use smallvec::SmallVec;
use std::cmp::Ordering;
use std::sync::Arc;

/// Sine of the angle between two normals below which faces count as one face.
const SAME_FACE_SINE: f64 = 0.05;
/// Number of points of an aperture at which faces are searched for, besides its centre.
const APERTURE_POINTS: usize = 64;
/// Largest number of surfaces that are tested in one direction from a point.
const MAX_SURFACES: usize = 4;

impl Scene {
    /// Returns the start of a ray from a point in a unit direction. The start is moved off the
    /// faces at the point, to the side on which a camera would lie.
    pub(crate) fn off_faces(&self, x: DVec3, direction: DVec3) -> DVec3 {
        let faces = Faces {
            containment: self.containment(),
            index: &self.geometry.all,
            epsilon: self.ray_epsilon,
            distance: self.geometry.face_distance,
        };
        x + faces.shift([x], direction).unwrap_or_default()
    }
}

/// Returns the distance from faces to which emitters and sensors are moved. At most `layers` sheets
/// lie on one another on a face; the distance lies beyond all of them.
pub(super) fn distance(epsilon: f64, layers: usize) -> f64 {
    (layers as f64 + 1.5) * LAYER * epsilon
}

/// Moves emitters and the sensor by a distance to their sides of the faces on which they lie.
/// `index` holds all objects.
pub(super) fn settle(
    parts: &mut Parts,
    index: &Index,
    bodies: &Bodies,
    epsilon: f64,
    distance: f64,
) {
    if parts.objects.is_empty() {
        return;
    }
    let faces = Faces {
        containment: parts.containment(bodies),
        index,
        epsilon,
        distance,
    };
    let emitters = parts.emitters.iter().map(|e| faces.emitter(e)).collect();
    let sensor = faces.sensor(&parts.sensor);
    parts.emitters = emitters;
    parts.sensor = sensor;
}

/// Search for the faces at a point.
struct Faces<'a> {
    containment: Containment<'a>,
    index: &'a Index,
    /// Distance by which rays start off surfaces.
    epsilon: f64,
    /// Distance from faces to which emitters and sensors are moved.
    distance: f64,
}

/// The faces that meet at a point.
struct Corner {
    /// Unit normals, linearly independent.
    normals: SmallVec<[DVec3; 3]>,
    /// Indices of the objects.
    objects: SmallVec<[usize; 4]>,
}

impl Faces<'_> {
    fn emitter(&self, emitter: &Emitter) -> Emitter {
        match emitter {
            Emitter::Point {
                position,
                intensity,
            } => match self.corner(*position) {
                None => emitter.clone(),
                Some(corner) => {
                    // Stay below sheets on the face of a body; a sheet itself may be moved.
                    let is_body = |i: &usize| self.object(*i).sides.is_some();
                    let distance = if corner.objects.iter().any(is_body) {
                        TOUCH * self.epsilon
                    } else {
                        self.distance
                    };
                    let offsets = corner.sides().map(|m| m * distance).collect();
                    let point = PointOnFace::new(*position, *intensity, corner.normals, offsets);
                    Emitter::PointOnFace(Arc::new(point))
                }
            },
            _ => {
                let apertures = emitter.aperture().into_iter();
                let starts = apertures.flat_map(|aperture| {
                    evenly_spread(APERTURE_POINTS).map(|u| aperture.sample(u))
                });
                let points = emitter.position().into_iter().chain(starts);
                let shift = emitter.axis().and_then(|axis| self.shift(points, axis));
                shift.map_or_else(|| emitter.clone(), |shift| emitter.moved(shift))
            }
        }
    }

    fn sensor(&self, sensor: &Sensor) -> Sensor {
        match sensor {
            Sensor::Absent(_) => sensor.clone(),
            Sensor::Batch(batch) => {
                let moved = Batch::new(batch.sensors().iter().map(|s| self.sensor(s)).collect());
                moved.map_or_else(|| sensor.clone(), |batch| Sensor::Batch(Arc::new(batch)))
            }
            _ => {
                let starts = evenly_spread(APERTURE_POINTS).map(|u| sensor.ray(u, u).origin);
                let points = std::iter::once(sensor.position()).chain(starts);
                let axis = sensor.to_world().matrix3.z_axis.normalize();
                match self.shift(points, axis) {
                    None => sensor.clone(),
                    Some(shift) => sensor.clone().moved(shift),
                }
            }
        }
    }

    /// Returns the displacement of an emitter or sensor along a unit `axis`, if one of its points
    /// lies on a face.
    fn shift(&self, points: impl IntoIterator<Item = DVec3>, axis: DVec3) -> Option<DVec3> {
        points.into_iter().find_map(|x| {
            let corner = self.corner(x)?;
            let blocks = |i: &usize| blocks(self.object(*i));
            let before = if corner.objects.iter().any(blocks) {
                -1.0
            } else {
                1.0
            };
            // Prefer sides outside opaque bodies, then sides in fewer bodies, then the side behind
            // the face.
            let better = |a: &DVec3, b: &DVec3| -> Ordering {
                let [p, q] = [*a, *b].map(|m| x + m * (TOUCH * self.epsilon));
                let filled = |p| corner.objects.iter().any(|i| fills(self.object(*i), p));
                let depth = |p| self.containment.depth(p);
                let along = |m: &DVec3| before * m.normalize().dot(axis);
                filled(p)
                    .cmp(&filled(q))
                    .then(depth(p).cmp(&depth(q)))
                    .then(along(a).total_cmp(&along(b)))
            };
            // Planted error "sources left on faces", found by morgana-io/io::placement::directed_emitters_on_faces_act_as_from_outside:
            // corner.sides().min_by(better).map(|m| m * 0.0)
            corner.sides().min_by(better).map(|m| m * self.distance)
        })
    }

    fn object(&self, i: usize) -> &Object {
        &self.containment.objects[i]
    }

    /// Returns the faces on which a point lies; `None` if there are none.
    fn corner(&self, x: DVec3) -> Option<Corner> {
        let mut corner = Corner {
            normals: SmallVec::new(),
            objects: SmallVec::new(),
        };
        let reach = TOUCH * self.epsilon;
        let directions = DIRECTIONS.map(DVec3::normalize);
        for direction in directions {
            // Lines that pass the point at a distance meet all faces of an edge or a corner.
            for aside in directions.map(|d| x + d * (reach / 3.0)) {
                for (object, normal) in self
                    .index
                    .within(aside, direction, reach)
                    .take(MAX_SURFACES)
                {
                    corner.add(object, normal);
                }
            }
        }
        (!corner.normals.is_empty()).then_some(corner)
    }
}

impl Corner {
    fn add(&mut self, object: usize, normal: DVec3) {
        if !self.objects.contains(&object) {
            self.objects.push(object);
        }
        let independent = match self.normals[..] {
            [] => true,
            [a] => a.cross(normal).length() > SAME_FACE_SINE,
            [a, b] => a.cross(b).normalize().dot(normal).abs() > SAME_FACE_SINE,
            _ => false,
        };
        if independent {
            self.normals.push(normal);
        }
    }

    /// Returns vectors to all sides of the faces, each with a component of ±1 along every normal.
    /// Bit k of the number of a side is set if the component along normal k is positive.
    fn sides(&self) -> impl Iterator<Item = DVec3> {
        let (a, b, c) = match self.normals[..] {
            [] => (DVec3::X, DVec3::Y, DVec3::Z),
            [a] => {
                let (b, c) = a.any_orthonormal_pair();
                (a, b, c)
            }
            [a, b] => (a, b, a.cross(b).normalize()),
            [a, b, c, ..] => (a, b, c),
        };
        let inverse = DMat3::from_cols(a, b, c).transpose().inverse();
        let count = self.normals.len();
        (0..1usize << count).map(move |side| {
            let component = |k: usize| match (k < count, side >> k & 1) {
                (false, _) => 0.0,
                (true, 1) => 1.0,
                (true, _) => -1.0,
            };
            inverse * DVec3::new(component(0), component(1), component(2))
        })
    }
}

/// Returns true if an object is opaque and does not separate media.
fn blocks(object: &Object) -> bool {
    object.sides.is_none() && object.bsdf.is_opaque()
}

/// Returns true if an opaque object contains a point.
fn fills(object: &Object, x: DVec3) -> bool {
    object.bsdf.is_opaque() && object.shape.is_closed() && object.shape.contains(x)
}
