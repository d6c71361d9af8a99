//! Products of Mueller matrices between the sensor and a point of a path.
//!
//! Theory: docs/theory.md#stokes-vectors.

use super::frame::Axis;
use crate::Spectrum;
use crate::bsdf::FilterMueller;
use crate::bsdf::polarization::dielectric;
use crate::mueller::PlaneMueller;
use eikonal::connect::Event;
use eikonal::interface::Rule;
use eikonal::ray::Arc;
use glam::{DMat4, DVec3, DVec4};

/// Light from an emitter: its Stokes vectors per unit of its power.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StokesInFrame {
    axis: Axis,
    /// Stokes vectors of the channels, or one vector for all of them.
    vectors: [DVec4; Spectrum::CHANNELS],
    /// Number of vectors in use.
    count: usize,
}

impl StokesInFrame {
    /// Creates unpolarised light along a vector of any length, with `count` vectors.
    pub(super) fn unpolarized(along: DVec3, count: usize) -> Self {
        StokesInFrame {
            axis: Axis(along.normalize().any_orthonormal_vector()),
            vectors: [DVec4::X; Spectrum::CHANNELS],
            count,
        }
    }

    /// Follows an arc, from one θ to another.
    pub(super) fn carry(&mut self, arc: &Arc, from: f64, to: f64) {
        self.axis = self.axis.carried(arc, from, to);
    }

    /// Passes a filter in the unit direction `k`.
    pub(super) fn pass(&mut self, filter: &FilterMueller, k: DVec3) {
        let axis = Axis(filter.axis);
        let rotation = self.axis.to(axis, k);
        self.each(|_, vector| filter.matrix * rotation.of(vector));
        self.axis = axis;
    }

    /// Turns from one unit direction to another by an event with the given matrix for each channel.
    pub(super) fn turn(&mut self, from: DVec3, to: DVec3, mueller: impl Fn(usize) -> PlaneMueller) {
        let plane = Axis::of_plane(from, to);
        // Planted error "light from emitters whose frame is turned the wrong way", found by morgana-transport/transport::polarization::estimators::spheres_in_graded_glass_polarise_alike_from_both_ends:
        // let rotation = self.axis.to(plane, -from);
        let rotation = self.axis.to(plane, from);
        // Planted error "connections whose light is not turned at interfaces", found by morgana-transport/transport::polarization::chains::connections_carry_polarisation_through_interfaces:
        // self.each(|channel, vector| mueller(channel).of(rotation.of(vector)) * 0.5 + vector * 0.5);
        self.each(|channel, vector| mueller(channel).of(rotation.of(vector)));
        self.axis = plane;
    }

    /// Refracts or reflects at an interface between dielectrics. `before` and `after` are the
    /// light's velocities before and after the interface.
    pub(super) fn meet(&mut self, event: &Event, [before, after]: [DVec3; 2]) {
        let n_near = event.before.length();
        let cos = (event.normal.dot(event.before).abs() / n_near).min(1.0);
        let mueller = dielectric(cos, [n_near, event.far_n], event.rule == Rule::Refract);
        self.turn(before.normalize(), after.normalize(), |_| mueller);
    }

    fn each(&mut self, of: impl Fn(usize, DVec4) -> DVec4) {
        for (channel, vector) in self.vectors.iter_mut().enumerate().take(self.count) {
            *vector = of(channel, *vector);
        }
    }
}

/// Product of the Mueller matrices from a point of a path to the sensor. The light travels against
/// the path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transported {
    /// First axis of the frame at the point.
    axis: Axis,
    /// Unit direction of the path after its last event before the point.
    leaving: DVec3,
    /// Matrices from the frame at the point to the sensor's frame: one for each channel, or one for
    /// all.
    matrices: [DMat4; Spectrum::CHANNELS],
    /// Number of matrices in use.
    count: usize,
}

impl Transported {
    /// Creates the matrices at the sensor, for a path in the unit direction `leaving`. The first
    /// axis of the sensor's frame is horizontal, perpendicular to the path and to `up`.
    pub(crate) fn at_sensor(leaving: DVec3, up: DVec3, count: usize) -> Self {
        Transported {
            axis: Axis::across(leaving, leaving.cross(up)),
            leaving,
            matrices: [DMat4::IDENTITY; Spectrum::CHANNELS],
            count,
        }
    }

    /// Extends the path along an arc, up to θ.
    pub(super) fn carry(&mut self, arc: &Arc, theta: f64) {
        self.axis = self.axis.carried(arc, 0.0, theta);
    }

    /// Extends the path through an event that turns it from one unit direction to another, with the
    /// given matrix for each channel.
    pub(super) fn turn(&mut self, from: DVec3, to: DVec3, mueller: impl Fn(usize) -> PlaneMueller) {
        let plane = Axis::of_plane(from, to);
        // Planted error "frames of Stokes vectors turned the wrong way", found by morgana-transport/transport::polarization::rayleigh::slabs_agree_with_electric_fields:
        // let rotation = plane.to(self.axis, from);
        let rotation = plane.to(self.axis, -from);
        for (channel, matrix) in self.matrices.iter_mut().enumerate().take(self.count) {
            *matrix = mueller(channel).then(rotation.then(*matrix));
        }
        (self.axis, self.leaving) = (plane, to);
    }

    /// Extends the path through a filter that it meets in the unit direction `path`.
    pub(super) fn pass(&mut self, filter: &FilterMueller, path: DVec3) {
        let axis = Axis(filter.axis);
        let rotation = axis.to(self.axis, -path);
        for matrix in self.matrices.iter_mut().take(self.count) {
            *matrix = rotation.then(*matrix) * filter.matrix;
        }
        self.axis = axis;
    }

    /// Returns the Stokes parameters at the sensor, by channel, of unpolarised light that starts at
    /// the point.
    pub(super) fn of_unpolarized(&self) -> [Spectrum; 4] {
        self.by_parameter(|matrix, _| self.matrices[matrix].x_axis)
    }

    /// Returns the Stokes parameters at the sensor, by channel, of light that arrives at the point
    /// against the path's direction.
    pub(crate) fn of(&self, light: &StokesInFrame) -> [Spectrum; 4] {
        let rotation = light.axis.to(self.axis, -self.leaving);
        let last = light.count - 1;
        let vectors = light.vectors.map(|vector| rotation.of(vector));
        self.by_parameter(|matrix, channel| self.matrices[matrix] * vectors[channel.min(last)])
    }

    /// Returns Stokes parameters by channel. `of` receives the number of a channel's matrix and the
    /// channel.
    fn by_parameter(&self, of: impl Fn(usize, usize) -> DVec4) -> [Spectrum; 4] {
        let last = self.count - 1;
        let vectors: [DVec4; Spectrum::CHANNELS] = std::array::from_fn(|c| of(c.min(last), c));
        std::array::from_fn(|parameter| Spectrum(vectors.map(|vector| vector[parameter])))
    }
}
