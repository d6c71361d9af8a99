//! Telecentric camera: a lens with a stop in its focal plane, optionally with a knife edge in the
//! stop.

use super::{ApertureShape, PointSpread, Sensed, SensorRay};
use crate::connection_end::{ConnectionEnd, EndSample};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Camera that sees each point of its plane of focus under the same cone of directions, given by
/// the open part of a stop. The stop lies in the focal plane of the lens, where rays of one
/// direction meet, so it selects rays by direction. In front of the lens, a ray has the slope s
/// across the axis. It passes the stop if |s| ≤ tan of the acceptance angle and, with a knife edge,
/// s·e ≤ tan of the angle of the knife. The sensor reads the mean radiance over the open part.
///
/// The plane of focus holds the image, as for [`Orthographic`](super::Orthographic): the local
/// square [−1, 1]² at z = `focus_distance`, with its height divided by the aspect ratio.
#[derive(Clone, Debug)]
pub struct Telecentric {
    to_world: DAffine3,
    to_local: DAffine3,
    aspect: f64,
    focus_distance: f64,
    stop: ApertureStop,
    point_spread: Option<PointSpread>,
}

impl Telecentric {
    /// Creates the camera. `to_world` must be invertible. `aspect` is width over height.
    /// `focus_distance` is in local units.
    pub fn new(to_world: DAffine3, aspect: f64, focus_distance: f64, stop: ApertureStop) -> Self {
        Telecentric {
            to_world,
            to_local: to_world.inverse(),
            aspect,
            focus_distance,
            stop,
            point_spread: None,
        }
    }

    /// Returns the sensor with diffraction at its stop. `wavelength` > 0 is the wavelength in
    /// vacuum, in scene units. Returns `None` if a knife edge covers part of the stop. The
    /// transform must not shear.
    ///
    /// The reduced radius is 2π r sin α/λ at the distance r from a point of the plane of focus, for
    /// the acceptance angle α.
    pub fn with_diffraction(&self, wavelength: f64) -> Option<Self> {
        let StopShape::Open(aperture) = &self.stop.shape else {
            return None;
        };
        let m = self.to_world.matrix3;
        let sine = self.stop.radius.atan().sin();
        let spread = wavelength / (TAU * sine);
        let (width, height) = (2.0 * m.x_axis.length(), 2.0 * m.y_axis.length());
        let scale = [spread / width, spread * self.aspect / height];
        Some(Telecentric {
            point_spread: Some(PointSpread::new(aperture, scale)),
            ..self.clone()
        })
    }

    /// Returns the camera displaced by `shift`.
    pub(super) fn moved(mut self, shift: DVec3) -> Self {
        self.to_world.translation += shift;
        self.to_local = self.to_world.inverse();
        self
    }

    /// Returns width over height of the image.
    pub fn aspect(&self) -> f64 {
        self.aspect
    }

    /// Returns the distance to the plane in focus, in scene units.
    pub fn focus_distance(&self) -> f64 {
        self.focus_distance
    }

    /// Returns the radius of the stop.
    pub fn stop_radius(&self) -> f64 {
        self.stop.radius
    }

    pub(super) fn point_spread(&self) -> Option<&PointSpread> {
        self.point_spread.as_ref()
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    /// Returns the unit direction of rays through a point of the stop.
    fn direction(&self, lens: [f64; 2]) -> DVec3 {
        let m = self.to_world.matrix3;
        let slope = self.stop.sample(lens);
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::normalize);
        (x * slope.x + y * slope.y + z).normalize()
    }

    /// Returns the ray of an image position. Rays of one direction start on the plane perpendicular
    /// to them through the sensor's position.
    pub(super) fn ray(&self, [s, t]: [f64; 2], lens: [f64; 2]) -> SensorRay {
        let direction = self.direction(lens);
        let (x, y) = (1.0 - 2.0 * s, (1.0 - 2.0 * t) / self.aspect);
        let focus = DVec3::new(x, y, self.focus_distance);
        let focus = self.to_world.transform_point3(focus);
        let ahead = (focus - self.to_world.translation).dot(direction);
        SensorRay {
            origin: focus - direction * ahead,
            direction,
        }
    }

    pub(super) fn sample_end(&self, u: [f64; 2]) -> EndSample {
        EndSample {
            end: self.end_along(self.direction(u)),
            pdf: 1.0 / self.stop.area(),
            delta: true,
        }
    }

    /// Returns the end for all rays of one direction.
    pub(super) fn end_along(&self, direction: DVec3) -> ConnectionEnd {
        ConnectionEnd::parallel(self.to_world.translation, direction)
    }

    /// Returns the image position of a ray, where it intersects the plane of focus. An area dx dy
    /// there has the cross section |(M e_x × M e_y)·d| dx dy for rays along d.
    pub(super) fn sense(&self, start: DVec3, direction: DVec3) -> Option<Sensed> {
        let origin = self.to_local.transform_point3(start);
        let local = self.to_local.transform_vector3(direction);
        let focus = origin + local * ((self.focus_distance - origin.z) / local.z);
        let m = self.to_world.matrix3;
        let image_area = 4.0 / self.aspect;
        let cross_section = m.x_axis.cross(m.y_axis).dot(direction).abs();
        let sensed = Sensed {
            image: [0.5 * (1.0 - focus.x), 0.5 * (1.0 - focus.y * self.aspect)],
            density: 1.0 / (image_area * cross_section),
        };
        (local.z > 0.0).then_some(sensed)
    }
}

/// Open part of a stop in units of slope: an aperture of any shape, or the part of a disc on one
/// side of a straight edge.
#[derive(Clone, Debug)]
pub struct ApertureStop {
    radius: f64,
    shape: StopShape,
}

/// Shape of the open part of a stop.
#[derive(Clone, Debug)]
enum StopShape {
    /// Aperture of any shape.
    Open(ApertureShape),
    /// Disc, covered on one side of an edge.
    Knife {
        /// Unit vector towards the covered side.
        edge: DVec2,
        /// Position of the edge along this vector, in units of the radius, in (−1, 1].
        cut: f64,
    },
}

impl ApertureStop {
    /// Creates a disc of the given radius > 0.
    pub fn disc(radius: f64) -> Self {
        ApertureStop::new(radius, ApertureShape::default())
    }

    /// Creates an aperture scaled by `radius` > 0.
    pub fn new(radius: f64, aperture: ApertureShape) -> Self {
        ApertureStop {
            radius,
            shape: StopShape::Open(aperture),
        }
    }

    /// Creates the part of a disc for which s·`edge` ≤ `cut`. `edge` must not be zero, and `cut`
    /// must exceed −`radius`.
    pub fn with_knife(radius: f64, edge: DVec2, cut: f64) -> Self {
        ApertureStop {
            radius,
            shape: StopShape::Knife {
                edge: edge.normalize(),
                cut: cut.min(radius) / radius,
            },
        }
    }

    /// Returns the area of the part of the unit disc on one side of a line at t: ∫2√(1 − t²)dt from
    /// −1.
    fn segment(t: f64) -> f64 {
        t * (1.0 - t * t).max(0.0).sqrt() + t.asin() + 0.5 * PI
    }

    fn area(&self) -> f64 {
        let share = match &self.shape {
            StopShape::Open(aperture) => aperture.area(),
            StopShape::Knife { cut, .. } => ApertureStop::segment(*cut),
        };
        self.radius * self.radius * share
    }

    /// Samples a slope that passes the stop, uniformly by transmitted power. The slope is inverted,
    /// because light towards one side meets the stop on the other side behind the lens.
    fn sample(&self, u: [f64; 2]) -> DVec2 {
        self.radius
            * match &self.shape {
                // Planted error "apertures of telecentric sensors turned by half a turn", found by morgana-transport/transport::apertures::rays_pass_where_an_aperture_is_open:
                // StopShape::Open(aperture) => aperture.sample(u),
                StopShape::Open(aperture) => -aperture.sample(u),
                StopShape::Knife { edge, cut } => beside_knife(*edge, *cut, u),
            }
    }
}

/// Samples a point of the part of the unit disc for which s·`edge` ≤ `cut`, uniformly by area. The
/// distance along `edge` is found by bisection of its distribution; the point is uniform on its
/// chord.
fn beside_knife(edge: DVec2, cut: f64, [u, v]: [f64; 2]) -> DVec2 {
    let (mut low, mut high) = (-1.0, cut);
    let wanted = u * ApertureStop::segment(high);
    while high - low > 1e-15 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if ApertureStop::segment(middle) < wanted {
            low = middle
        } else {
            high = middle
        }
    }
    let t = 0.5 * (low + high);
    let chord = (1.0 - t * t).max(0.0).sqrt() * (2.0 * v - 1.0);
    edge * t + edge.perp() * chord
}
