//! Telecentric camera: a stop in the focal plane of a lens, and a knife edge in the stop.

use super::{Sensed, SensorRay};
use crate::connection_end::{ConnectionEnd, EndSample};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::PI;

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
        }
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

/// The open part of a stop in units of slope: a disc, or what a straight edge leaves of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApertureStop {
    radius: f64,
    /// Unit vector towards the covered side.
    edge: DVec2,
    /// Where the edge is along it, at most `radius`.
    cut: f64,
}

impl ApertureStop {
    /// A disc of the given radius > 0.
    pub fn disc(radius: f64) -> Self {
        ApertureStop {
            radius,
            edge: DVec2::X,
            cut: radius,
        }
    }

    /// The part of a disc for which s·`edge` ≤ `cut`; `edge` must not be zero, and `cut` more than
    /// −`radius`.
    pub fn with_knife(radius: f64, edge: DVec2, cut: f64) -> Self {
        ApertureStop {
            radius,
            edge: edge.normalize(),
            cut: cut.min(radius),
        }
    }

    /// Area of the part of the unit disc on one side of a line at t: ∫2√(1 − t²)dt from −1.
    fn segment(t: f64) -> f64 {
        t * (1.0 - t * t).max(0.0).sqrt() + t.asin() + 0.5 * PI
    }

    fn area(&self) -> f64 {
        self.radius * self.radius * ApertureStop::segment(self.cut / self.radius)
    }

    /// A point of the open part, uniform by area: the distance along the edge's direction by bisection of
    /// its distribution, then any point of that chord.
    fn sample(&self, [u, v]: [f64; 2]) -> DVec2 {
        let (mut low, mut high) = (-1.0, self.cut / self.radius);
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
        (self.edge * t + self.edge.perp() * chord) * self.radius
    }
}
