//! Receivers: surfaces at which rays end.

use crate::bounds::Aabb;
use crate::ray::Arc;
use crate::ray::bernstein::{first_root, height};
use glam::DVec3;

/// Round-off of positions, relative to the diagonal of a box.
const ROUND_OFF: f64 = 1e-11;

/// A surface on which rays end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Receiver {
    /// A plane through a point, reached from either side.
    Plane {
        /// Point of the plane.
        point: DVec3,
        /// Unit normal.
        normal: DVec3,
    },
    /// Faces of a box, where rays leave it. Rays that start outside enter it first.
    Leaving(Aabb),
}

/// Intersection of an arc with a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Intersection {
    pub theta: f64,
    pub position: DVec3,
    pub normal: DVec3,
}

impl Intersection {
    fn at(arc: &Arc, theta: f64, normal: DVec3) -> Self {
        Intersection {
            theta,
            position: arc.position(theta),
            normal,
        }
    }
}

impl Receiver {
    /// Returns the first intersection of an arc with the receiver. An arc meets the faces of a box
    /// only if it starts in the box.
    pub(super) fn first(&self, arc: &Arc) -> Option<Intersection> {
        match self {
            Receiver::Plane { point, normal } => plane(arc, *point, *normal),
            Receiver::Leaving(region) if region.grown(reach(region)).contains(arc.start()) => {
                leaving(arc, region)
            }
            Receiver::Leaving(_) => None,
        }
    }
}

/// Returns the first intersection of an arc with a plane.
fn plane(arc: &Arc, point: DVec3, normal: DVec3) -> Option<Intersection> {
    if arc.is_straight() {
        let theta = normal.dot(point - arc.start()) / normal.dot(arc.derivative(0.0));
        let meets = theta > 0.0 && theta <= 1.0;
        return meets.then(|| Intersection::at(arc, theta, normal));
    }
    let heights = height(&arc.control(), point, normal);
    let theta = first_root(&heights, 0.0, 1.0, [0.0; 2])?;
    Some(Intersection::at(arc, theta, normal))
}

/// Returns the distance by which round-off may put the end of a step beyond a face.
fn reach(region: &Aabb) -> f64 {
    ROUND_OFF * region.diagonal()
}

/// Returns the point where an arc that starts in a box leaves it. If the previous step ended on a
/// face, beyond it by round-off but without meeting it, the arc leaves the box at its start.
pub(super) fn leaving(arc: &Arc, region: &Aabb) -> Option<Intersection> {
    let ends = arc.aabb();
    let (start, step) = (arc.start(), arc.end() - arc.start());
    let faces = [(region.max, 1.0), (region.min, -1.0)];
    let mut first: Option<Intersection> = None;
    for (corner, sign) in faces {
        for (axis, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            if sign * (start[axis] - corner[axis]) >= 0.0 && sign * step[axis] > 0.0 {
                return Some(Intersection::at(arc, 0.0, unit * sign));
            }
            let reaches = if sign > 0.0 {
                ends.max[axis] > corner[axis]
            } else {
                ends.min[axis] < corner[axis]
            };
            let met = reaches.then(|| plane(arc, corner, unit * sign)).flatten();
            if let Some(met) = met
                && first.is_none_or(|before| met.theta < before.theta)
            {
                first = Some(met);
            }
        }
    }
    first
}

/// Returns the point where a straight arc that starts outside a box enters it.
pub(super) fn entering(arc: &Arc, region: &Aabb) -> Option<Intersection> {
    let (x, step) = (arc.start(), arc.end() - arc.start());
    let (mut near, mut far, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, DVec3::ZERO);
    for (axis, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        let faces = [region.min[axis], region.max[axis]];
        if step[axis] == 0.0 {
            if x[axis] < faces[0] || x[axis] > faces[1] {
                return None;
            }
            continue;
        }
        let [a, b] = faces.map(|face| (face - x[axis]) / step[axis]);
        if a.min(b) > near {
            (near, normal) = (a.min(b), unit);
        }
        far = far.min(a.max(b));
    }
    (near > 0.0 && near <= 1.0 && near < far).then(|| Intersection::at(arc, near, normal))
}
