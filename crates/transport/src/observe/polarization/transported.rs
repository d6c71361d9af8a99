//! The product of Mueller matrices between the sensor and a point of a path.
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

/// Light on its way along a connection, whose interfaces are alike for all channels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StokesInFrame {
    axis: Axis,
    vector: DVec4,
}

impl StokesInFrame {
    /// Leaves an emitter along a vector of any length.
    pub(super) fn unpolarized(along: DVec3) -> Self {
        StokesInFrame {
            axis: Axis(along.normalize().any_orthonormal_vector()),
            vector: DVec4::X,
        }
    }

    /// On along an arc, from one θ to another.
    pub(super) fn carry(&mut self, arc: &Arc, from: f64, to: f64) {
        self.axis = self.axis.carried(arc, from, to);
    }

    /// On through a filter, in the unit direction `k`.
    pub(super) fn pass(&mut self, filter: &FilterMueller, k: DVec3) {
        let axis = Axis(filter.axis);
        self.vector = filter.matrix * self.axis.to(axis, k).of(self.vector);
        self.axis = axis;
    }

    /// On through an interface between dielectrics; the velocities are those of light, before and after.
    pub(super) fn meet(&mut self, event: &Event, [before, after]: [DVec3; 2]) {
        let (from, to) = (before.normalize(), after.normalize());
        let n_near = event.before.length();
        let cos = (event.normal.dot(event.before).abs() / n_near).min(1.0);
        let mueller = dielectric(cos, [n_near, event.far_n], event.rule == Rule::Refract);
        let plane = Axis::of_plane(from, to);
        self.vector = mueller.of(self.axis.to(plane, from).of(self.vector));
        self.axis = plane;
    }
}

/// What becomes of light that travels against a path, from a point of it to the sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transported {
    /// First axis of the frame at the point.
    pub axis: Axis,
    /// From that frame to the sensor's: one matrix for each channel, or one for all.
    matrices: [DMat4; Spectrum::CHANNELS],
    /// Number of matrices in use.
    count: usize,
}

impl Transported {
    /// At the sensor, whose frame has this axis.
    pub(super) fn new(axis: Axis, count: usize) -> Self {
        Transported {
            axis,
            matrices: [DMat4::IDENTITY; Spectrum::CHANNELS],
            count,
        }
    }

    /// On along an arc, up to θ.
    pub(super) fn carry(&mut self, arc: &Arc, theta: f64) {
        self.axis = self.axis.carried(arc, 0.0, theta);
    }

    /// On through an event with the given matrix for each channel, which turns the path from one unit direction to another.
    pub(super) fn turn(&mut self, from: DVec3, to: DVec3, mueller: impl Fn(usize) -> PlaneMueller) {
        let plane = Axis::of_plane(from, to);
        let rotation = plane.to(self.axis, -from);
        for (channel, matrix) in self.matrices.iter_mut().enumerate().take(self.count) {
            *matrix = mueller(channel).then(rotation.then(*matrix));
        }
        self.axis = plane;
    }

    /// On through a filter, which the path meets in the unit direction `path`.
    pub(super) fn pass(&mut self, filter: &FilterMueller, path: DVec3) {
        let axis = Axis(filter.axis);
        let rotation = axis.to(self.axis, -path);
        for matrix in self.matrices.iter_mut().take(self.count) {
            *matrix = rotation.then(*matrix) * filter.matrix;
        }
        self.axis = axis;
    }

    /// The Stokes parameters at the sensor of unpolarised light that starts here, by channel.
    pub(super) fn of_unpolarized(&self) -> [Spectrum; 4] {
        self.by_parameter(|i| self.matrices[i].x_axis)
    }

    /// Those of light that comes against the unit direction `path`.
    pub(super) fn of(&self, light: &StokesInFrame, path: DVec3) -> [Spectrum; 4] {
        let rotation = light.axis.to(self.axis, -path);
        let vector = rotation.of(light.vector);
        self.by_parameter(|i| self.matrices[i] * vector)
    }

    fn by_parameter(&self, of: impl Fn(usize) -> DVec4) -> [Spectrum; 4] {
        let last = self.count - 1;
        let vectors: [DVec4; Spectrum::CHANNELS] = std::array::from_fn(|c| of(c.min(last)));
        std::array::from_fn(|parameter| Spectrum(vectors.map(|vector| vector[parameter])))
    }
}
