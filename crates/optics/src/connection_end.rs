//! Where a connection should end.
//!
//! Both ends of a path can be aimed at: a vertex of a sensor subpath is joined to an emitter, and a
//! vertex of a light subpath to the sensor. A [`ConnectionEnd`] says where such a connection should end; how
//! it gets there, and with what geometry term, is the business of `path`.
//!
//! Theory: docs/theory.md#subpaths-from-either-end.

use crate::shape::Site;
use glam::DVec3;

/// Squared lengths of unit vectors differ from one by no more than this.
const UNIT: f64 = 1e-12;

/// Where a connection from a vertex to one end of a path, an emitter or the sensor, should end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConnectionEnd {
    /// A point; the edge's geometry term is 1/J.
    Point {
        /// The point.
        position: DVec3,
        /// Where it lies, if on a surface.
        surface: Option<OnSurface>,
    },
    /// Any point of the plane through `through` across `direction`, leaving along `direction`; the
    /// edge's geometry term is 1/A. A beam is guided: the ray from its centre shows where it goes.
    Plane {
        /// A point of the plane.
        through: DVec3,
        /// Unit direction in which light travels from an emitter, or importance from a sensor.
        direction: DVec3,
        /// Whether `through` is the centre of a beam.
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
    /// The point as textures see it.
    pub site: Site,
}

/// An end and its density: per unit area on a surface or a lens, per steradian for an environment, 1
/// if there is no choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndSample {
    /// Where to.
    pub end: ConnectionEnd,
    /// With what density.
    pub pdf: f64,
    /// Whether scattered paths cannot find this end by chance.
    pub delta: bool,
}

impl ConnectionEnd {
    /// A point in space, on no surface.
    pub fn at(position: DVec3) -> Self {
        ConnectionEnd::Point {
            position,
            surface: None,
        }
    }

    /// The point, if it is one.
    pub(crate) fn position(&self) -> Option<DVec3> {
        match self {
            ConnectionEnd::Point { position, .. } => Some(*position),
            ConnectionEnd::Plane { .. } => None,
        }
    }

    /// Parallel rays across a whole plane. With a direction of another length than one a connection ends
    /// beside its vertex.
    pub(crate) fn parallel(through: DVec3, direction: DVec3) -> Self {
        debug_assert!((direction.length_squared() - 1.0).abs() < UNIT);
        ConnectionEnd::Plane {
            through,
            direction,
            beam: false,
        }
    }
}

impl EndSample {
    /// The only end that there is.
    pub(crate) fn only(end: ConnectionEnd) -> Self {
        EndSample {
            end,
            pdf: 1.0,
            delta: true,
        }
    }
}
