//! Cameras described by their position and their target.

use super::{Orthographic, Perspective, Sensor};
use glam::{DAffine3, DMat3, DVec3};

/// Widest field of view in degrees.
const MAX_FIELD_OF_VIEW: f64 = 179.0;

/// Returns the camera-to-world map of a camera at `origin` that looks at `target`: along +z, with y
/// up and x to the left. If `up` is zero, any perpendicular direction is used. Returns `None` if
/// the points coincide, or if `up` is parallel to the view.
pub fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Option<DAffine3> {
    let direction = (target - origin).try_normalize()?;
    let up = if up == DVec3::ZERO {
        direction.any_orthonormal_vector()
    } else {
        up
    };
    let left = up.try_normalize()?.cross(direction);
    // Reject nearly parallel vectors, whose cross product is only rounding error.
    let left = if left.length() < 1e-9 {
        None
    } else {
        left.try_normalize()
    }?;
    Some(DAffine3 {
        matrix3: DMat3::from_cols(left, direction.cross(left), direction),
        translation: origin,
    })
}

/// Projection of the scene to the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Full horizontal field of view in degrees, above 0 and up to 179.
        fov: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Width of the image in scene units.
        width: f64,
    },
}

/// Camera given by its position, its target and its projection. `SceneBuilder` converts it to a
/// [`Sensor`] that fits the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position.
    pub origin: DVec3,
    /// Point at the centre of the image.
    pub target: DVec3,
    /// Direction that is up in the image. If it is zero, any perpendicular direction is used.
    pub up: DVec3,
    /// Projection.
    pub projection: Projection,
}

/// Reason why a camera cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// The direction of view is undefined.
    #[error("origin and target must be finite and differ, and up must not be parallel to the view")]
    View,
    /// The field of view is out of range.
    #[error(
        "the field of view must be above 0 and at most {MAX_FIELD_OF_VIEW} degrees, but it is {0}"
    )]
    FieldOfView(f64),
    /// The width of the image is not positive.
    #[error("the width of the image must be positive and finite, but it is {0}")]
    Width(f64),
}

impl Camera {
    /// Creates a pinhole camera whose image spans `fov` degrees horizontally. The y axis points up,
    /// unless the camera looks along y.
    pub fn perspective(origin: impl Into<DVec3>, target: impl Into<DVec3>, fov: f64) -> Self {
        Camera::new(
            origin.into(),
            target.into(),
            Projection::Perspective { fov },
        )
    }

    /// Creates a camera of parallel rays whose image is `width` scene units wide. The y axis points
    /// up, unless the camera looks along y.
    pub fn orthographic(origin: impl Into<DVec3>, target: impl Into<DVec3>, width: f64) -> Self {
        Camera::new(
            origin.into(),
            target.into(),
            Projection::Orthographic { width },
        )
    }

    fn new(origin: DVec3, target: DVec3, projection: Projection) -> Self {
        let along_y = (target - origin).cross(DVec3::Y) == DVec3::ZERO;
        Camera {
            origin,
            target,
            up: if along_y { DVec3::Z } else { DVec3::Y },
            projection,
        }
    }

    /// Returns the camera rotated about its axis so that `up` is up in the image.
    pub fn with_up(self, up: impl Into<DVec3>) -> Self {
        Camera {
            up: up.into(),
            ..self
        }
    }

    /// Returns the sensor whose image has the given ratio of width to height.
    ///
    /// # Errors
    /// Fails if the camera is invalid: see [`CameraError`].
    pub fn sensor(&self, aspect: f64) -> Result<Sensor, CameraError> {
        let finite = self.origin.is_finite() && self.target.is_finite() && self.up.is_finite();
        let view = look_at(self.origin, self.target, self.up).filter(|_| finite);
        let view = view.ok_or(CameraError::View)?;
        match self.projection {
            Projection::Perspective { fov } if !(fov > 0.0 && fov <= MAX_FIELD_OF_VIEW) => {
                Err(CameraError::FieldOfView(fov))
            }
            Projection::Perspective { fov } => {
                let pinhole = Perspective::new(view, fov.to_radians(), aspect);
                Ok(Sensor::Perspective(pinhole))
            }
            Projection::Orthographic { width } if !(width > 0.0 && width.is_finite()) => {
                Err(CameraError::Width(width))
            }
            Projection::Orthographic { width } => {
                let half = DAffine3::from_scale(DVec3::new(0.5 * width, 0.5 * width, 1.0));
                Ok(Sensor::Orthographic(Orthographic::new(view * half, aspect)))
            }
        }
    }
}
