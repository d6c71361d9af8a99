//! Test whether a point lies inside a closed mesh.

use super::intersect::Line;
use super::{Mesh, cross};
use glam::DVec3;

/// First crossing of a ray with a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FirstCrossing {
    /// The ray passes too close to an edge to decide.
    Unclear,
    /// The ray crosses no triangle.
    Nothing,
    /// The ray crosses a triangle.
    Triangle {
        /// Distance in lengths of the direction.
        distance: f64,
        /// True if the ray comes from the side to which the normal points.
        from_front: bool,
    },
}

/// Directions of the test rays. None of them is aligned with the usual axes of meshes.
pub const DIRECTIONS: [DVec3; 6] = [
    DVec3::new(0.267, 0.535, 0.802),
    DVec3::new(-0.621, 0.331, -0.711),
    DVec3::new(0.733, -0.653, -0.191),
    DVec3::new(-0.127, -0.881, 0.456),
    DVec3::new(0.911, 0.293, -0.289),
    DVec3::new(-0.377, 0.079, 0.923),
];

/// Relative area below which a line passes too close to an edge to decide on which side.
const MIN_EDGE_AREA: f64 = 1e-9;

impl Mesh {
    pub(in crate::shape) fn contains(&self, p: DVec3) -> bool {
        if !self.closed || !self.bounds.contains(p) {
            return false;
        }
        let seen = DIRECTIONS.iter().find_map(|d| self.crossings(p, *d));
        match seen {
            Some(crossings) => crossings % 2 != 0,
            None => self.winding(p).abs() > 0.5,
        }
    }

    /// Finds the first crossing of the ray from `p` along `d`.
    pub fn first_crossing(&self, p: DVec3, d: DVec3) -> FirstCrossing {
        let far = self.bounds.center().distance(p) + self.bounds.diagonal();
        let ends = [p, p + d * (2.0 * far)];
        let step = ends[1] - p;
        let line = Line::new(p, step);
        let sweep = self.frame.line(&ends);
        let mut first = FirstCrossing::Nothing;
        let mut end = 1.0;
        self.tree().visit(&sweep, [0.0, 1.0], &mut |i| {
            let triangle = self.triangle(i);
            let (e, z) = line.project(triangle);
            match crossing(e, z) {
                None => {
                    first = FirstCrossing::Unclear;
                    return f64::NEG_INFINITY;
                }
                Some(t) if t < end => {
                    end = t;
                    first = FirstCrossing::Triangle {
                        distance: 2.0 * far * t,
                        from_front: cross(triangle).dot(step) < 0.0,
                    };
                }
                Some(_) => {}
            }
            end
        });
        first
    }

    /// Counts the crossings of the ray from `p` with the mesh. Returns `None` if the ray passes
    /// close to an edge.
    fn crossings(&self, p: DVec3, d: DVec3) -> Option<u32> {
        let ends = [p, p + d * (2.0 * self.bounds.diagonal())];
        let line = Line::new(p, ends[1] - p);
        let sweep = self.frame.line(&ends);
        let mut count = Some(0);
        self.tree().visit(&sweep, [0.0, 1.0], &mut |i| {
            let (e, z) = line.project(self.triangle(i));
            count = count.and_then(|n| Some(n + u32::from(crosses(e, z)?)));
            if count.is_some() {
                1.0
            } else {
                f64::NEG_INFINITY
            }
        });
        count
    }

    /// Computes the generalised winding number: the solid angle of the mesh over 4π (A. Jacobson et
    /// al., "Robust inside-outside segmentation using generalized winding numbers", 2013; solid
    /// angle of a triangle by A. van Oosterom and J. Strackee, 1983).
    fn winding(&self, p: DVec3) -> f64 {
        let solid_angle = |i: usize| {
            let [a, b, c] = self.triangle(i).map(|v| v - p);
            let [x, y, z] = [a.length(), b.length(), c.length()];
            let below = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
            2.0 * libm::atan2(a.dot(b.cross(c)), below)
        };
        let total: f64 = (0..self.triangles.len()).map(solid_angle).sum();
        total / (4.0 * std::f64::consts::PI)
    }
}

/// Tests if a ray crosses a triangle, from the projected areas `e` of the sides and the parameters
/// `z` of the corners. Returns `None` if the ray is too close to an edge.
fn crosses(e: [f64; 3], z: [f64; 3]) -> Option<bool> {
    crossing(e, z).map(f64::is_finite)
}

/// Returns the parameter of the ray at the crossing, infinity if there is none, and `None` if the
/// ray is too close to an edge.
fn crossing(e: [f64; 3], z: [f64; 3]) -> Option<f64> {
    let size = e.iter().fold(0.0, |s, x| s + x.abs());
    let behind = z.iter().all(|z| *z < 0.0);
    if behind {
        return Some(f64::INFINITY);
    }
    let det = e[0] + e[1] + e[2];
    let w = e.map(|x| x * det.signum() / size);
    if size == 0.0
        || w.iter().all(|x| *x >= -MIN_EDGE_AREA) && w.iter().any(|x| *x <= MIN_EDGE_AREA)
    {
        return None;
    }
    let t = (e[0] * z[0] + e[1] * z[1] + e[2] * z[2]) / det;
    let met = w.iter().all(|x| *x > 0.0) && t > 0.0;
    Some(if met { t } else { f64::INFINITY })
}
