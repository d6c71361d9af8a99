//! Starts of rays, and the two parameters that Newton's method varies (docs/theory.md#connections).

use crate::field::Field;
use crate::ray::{Node, Tangents, perpendicular_basis};
use glam::{DVec2, DVec3};

/// A two-parameter family of rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayFamily {
    /// All directions from the point `x`; Newton varies the direction.
    Point {
        /// Start.
        x: DVec3,
        /// Unit direction.
        direction: DVec3,
    },
    /// All points of the plane through `x` perpendicular to the direction; Newton varies `x`.
    Plane {
        /// Start.
        x: DVec3,
        /// Unit direction of all rays of the family.
        direction: DVec3,
    },
}

impl RayFamily {
    /// Returns the start of the ray.
    pub fn x(&self) -> DVec3 {
        match *self {
            RayFamily::Point { x, .. } | RayFamily::Plane { x, .. } => x,
        }
    }

    /// Returns the unit direction of the ray at its start.
    pub fn direction(&self) -> DVec3 {
        match *self {
            RayFamily::Point { direction, .. } | RayFamily::Plane { direction, .. } => direction,
        }
    }

    /// Returns the first node of the ray, with the tangents of unit changes of the two parameters.
    pub(super) fn node(&self, field: &Field) -> Node<Tangents> {
        let basis = perpendicular_basis(self.direction());
        let unset = Tangents::lateral(1.0, DVec3::ZERO, DVec3::ZERO, basis);
        let mut node = Node::start(field, self.x(), self.direction(), unset);
        let n = node.n2.sqrt();
        node.variation = match *self {
            RayFamily::Point { .. } => Tangents::angular(n, basis),
            RayFamily::Plane { direction, .. } => {
                Tangents::lateral(n, 2.0 * node.a, direction, basis)
            }
        };
        node
    }

    /// Returns the family with its parameters changed by `step`, in radians or lengths.
    pub(super) fn moved(&self, step: DVec2) -> Self {
        let [t1, t2] = perpendicular_basis(self.direction());
        let offset = t1 * step.x + t2 * step.y;
        match *self {
            RayFamily::Point { x, direction } => RayFamily::Point {
                x,
                direction: (direction + offset).normalize(),
            },
            RayFamily::Plane { x, direction } => RayFamily::Plane {
                x: x + offset,
                direction,
            },
        }
    }

    /// Returns the distance between the ends of straight rays of length `arc_length`, per unit of
    /// the parameters.
    pub(super) fn spread(&self, arc_length: f64) -> f64 {
        match self {
            RayFamily::Point { .. } => arc_length,
            RayFamily::Plane { .. } => 1.0,
        }
    }

    /// Returns the largest change of the parameters that one Newton step may make, for a target at
    /// distance `d`.
    pub(super) fn longest_step(&self, d: f64) -> f64 {
        match self {
            RayFamily::Point { .. } => 0.5,
            RayFamily::Plane { .. } => 0.5 * d,
        }
    }
}
