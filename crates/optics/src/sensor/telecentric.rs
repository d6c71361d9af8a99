//! Telecentric camera: a stop in the focal plane of a lens, and a knife edge in the stop.

use super::{ApertureShape, PointSpread, Sensed, SensorRay};
use crate::connection_end::{ConnectionEnd, EndSample};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A camera that sees each point of its plane of focus under the same cone of directions, that of the open
/// part of a stop. The stop lies in the focal plane of the lens, where rays of one direction meet, so that
/// it sorts rays by direction: a ray of slope s across the axis, in front of the lens, goes through the
/// stop if |s| ≤ tan of the acceptance angle and, with a knife edge, s·e ≤ tan of the knife's angle. What
/// is read is the mean radiance over the open part.
///
/// The plane of focus holds the image as that of [`Orthographic`](super::Orthographic): the local square
/// [−1, 1]² at z = `focus_distance`, its height divided by the aspect ratio.
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
    /// `to_world` must be invertible; `aspect` is width over height; `focus_distance` is in local units.
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

    /// The sensor with diffraction at its stop, of light of a `wavelength` > 0 in vacuum, in scene units; `None` if a knife edge
    /// covers part of the stop. The transform must not shear.
    ///
    /// The reduced radius is 2π r sin α/λ at the distance r from a point of the plane of focus, for the acceptance angle α.
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

    /// The same, displaced by `shift`.
    pub(super) fn moved(mut self, shift: DVec3) -> Self {
        self.to_world.translation += shift;
        self.to_local = self.to_world.inverse();
        self
    }

    /// Width over height of the image.
    pub fn aspect(&self) -> f64 {
        self.aspect
    }

    /// Distance to the plane that is in focus, in scene units.
    pub fn focus_distance(&self) -> f64 {
        self.focus_distance
    }

    /// Radius of the stop.
    pub fn stop_radius(&self) -> f64 {
        self.stop.radius
    }

    pub(super) fn point_spread(&self) -> Option<&PointSpread> {
        self.point_spread.as_ref()
    }

    pub(super) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    /// The unit direction of rays through a point of the stop.
    fn direction(&self, lens: [f64; 2]) -> DVec3 {
        let m = self.to_world.matrix3;
        let slope = self.stop.sample(lens);
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::normalize);
        (x * slope.x + y * slope.y + z).normalize()
    }

    /// Rays of one direction start on the plane across them through the sensor's position.
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

    /// The end at all rays of one direction.
    pub(super) fn end_along(&self, direction: DVec3) -> ConnectionEnd {
        ConnectionEnd::parallel(self.to_world.translation, direction)
    }

    /// The ray belongs where it meets the plane of focus. An area dx dy there has the cross section
    /// |(M e_x × M e_y)·d| dx dy for rays along d.
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

/// The open part of a stop in units of slope: an aperture of any shape, or what a straight edge leaves of a disc.
#[derive(Clone, Debug)]
pub struct ApertureStop {
    radius: f64,
    shape: StopShape,
}

/// What is covered of a stop.
#[derive(Clone, Debug)]
enum StopShape {
    /// What is not of the aperture's shape.
    Open(ApertureShape),
    /// One side of an edge.
    Knife {
        /// Unit vector towards the covered side.
        edge: DVec2,
        /// Where the edge is along it, in units of the radius, in (−1, 1].
        cut: f64,
    },
}

impl ApertureStop {
    /// A disc of the given radius > 0.
    pub fn disc(radius: f64) -> Self {
        ApertureStop::new(radius, ApertureShape::default())
    }

    /// An aperture that is that many times as large, > 0.
    pub fn new(radius: f64, aperture: ApertureShape) -> Self {
        ApertureStop {
            radius,
            shape: StopShape::Open(aperture),
        }
    }

    /// The part of a disc for which s·`edge` ≤ `cut`; `edge` must not be zero, and `cut` more than
    /// −`radius`.
    pub fn with_knife(radius: f64, edge: DVec2, cut: f64) -> Self {
        ApertureStop {
            radius,
            shape: StopShape::Knife {
                edge: edge.normalize(),
                cut: cut.min(radius) / radius,
            },
        }
    }

    /// Area of the part of the unit disc on one side of a line at t: ∫2√(1 − t²)dt from −1.
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

    /// A slope that passes, uniform by the power that does. Behind the lens, what goes towards one side meets the stop on the other.
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

/// A point of the part of the unit disc for which s·`edge` ≤ `cut`, uniform by area: the distance along the edge's direction by
/// bisection of its distribution, then any point of that chord.
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
