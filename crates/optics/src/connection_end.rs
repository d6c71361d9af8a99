//! Ends of connections.
//!
//! Connections lead to both ends of a path: from a vertex of a sensor subpath to an emitter, and
//! from a vertex of a light subpath to the sensor. A [`ConnectionEnd`] states where a connection
//! ends. The module `path` finds the ray to the end and its geometry term.
//!
//! Theory: docs/theory.md#subpaths-from-either-end.

use crate::shape::Site;
use glam::DVec3;

/// Largest difference of the squared length of a unit vector from one.
const UNIT_TOLERANCE: f64 = 1e-12;

/// Target of a connection from a vertex to one end of a path: an emitter or the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConnectionEnd {
    /// A point; the edge's geometry term is 1/J.
    Point {
        /// The point.
        position: DVec3,
        /// Surface on which the point lies, if any.
        surface: Option<OnSurface>,
    },
    /// Any point of the plane through `through` across `direction`, left along `direction`. The
    /// geometry term of the edge is 1/A. For a beam, the ray from the centre guides the search.
    Plane {
        /// A point of the plane.
        through: DVec3,
        /// Unit direction in which light travels from an emitter, or importance from a sensor.
        direction: DVec3,
        /// True if `through` is the centre of a beam.
        beam: bool,
    },
}

/// The surface on which an end of a path lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnSurface {
    /// Index of the object.
    pub object: usize,
    /// Unit normal at the point, as in [`crate::shape::Hit`].
    pub normal: DVec3,
    /// The point with the data that textures need.
    pub site: Site,
}

/// Sampled end of a connection, with its density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndSample {
    /// Target of the connection.
    pub end: ConnectionEnd,
    /// Density: per unit area on a surface or a lens, per steradian for an environment, 1 if there
    /// is no choice.
    pub pdf: f64,
    /// True if scattered paths cannot hit this end.
    pub delta: bool,
}

impl ConnectionEnd {
    /// Creates an end at a point in space, on no surface.
    pub fn at(position: DVec3) -> Self {
        ConnectionEnd::Point {
            position,
            surface: None,
        }
    }

    /// Returns the position of a point, `None` for a plane.
    pub(crate) fn position(&self) -> Option<DVec3> {
        match self {
            ConnectionEnd::Point { position, .. } => Some(*position),
            ConnectionEnd::Plane { .. } => None,
        }
    }

    /// Creates an end on a plane, for parallel rays across the whole plane. `direction` must have
    /// unit length; otherwise connections miss their vertex.
    pub(crate) fn parallel(through: DVec3, direction: DVec3) -> Self {
        debug_assert!((direction.length_squared() - 1.0).abs() < UNIT_TOLERANCE);
        ConnectionEnd::Plane {
            through,
            direction,
            beam: false,
        }
    }
}

impl EndSample {
    /// Creates the sample of an end that is chosen with certainty.
    pub(crate) fn only(end: ConnectionEnd) -> Self {
        EndSample {
            end,
            pdf: 1.0,
            delta: true,
        }
    }
}
