//! End of an optical fibre: an aperture that radiates into a cone.

use super::angular_profile::{AngularProfile, Edge};
use super::aperture::Aperture;
use crate::Spectrum;
use crate::sampling::Frame;
use crate::sampling::sphere::uniform_sphere_pdf;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// Divergence of the light of a fibre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Divergence {
    /// Half angle θ₀ of the cone in radians, above 0 and at most
    /// [`AngularProfile::max_edge`].
    HalfAngle(f64),
    /// Numerical aperture: sin θ₀ = NA/n in a medium of index n at the centre of the aperture, 0 <
    /// NA ≤ n.
    NumericalAperture(f64),
}

/// Light from an aperture into a cone around its axis, or around the directions to a focus.
#[derive(Clone, Debug)]
pub struct Fiber {
    aperture: Aperture,
    profile: AngularProfile,
    divergence: Divergence,
    edge: Edge,
    /// Unit vector along the axis of the cone of the centre.
    axis: DVec3,
    /// Distance of the focus, if there is one.
    focus: Option<f64>,
    /// Irradiance of the aperture on its axis; with an image, the irradiance where the image is
    /// one.
    peak: Spectrum,
}

impl Fiber {
    /// Creates a fibre of the given total power. There is no light in channels in which the image
    /// of the aperture is black. A numerical aperture applies to vacuum until the fibre is part of
    /// a scene.
    pub fn new(
        aperture: Aperture,
        profile: AngularProfile,
        divergence: Divergence,
        power: Spectrum,
    ) -> Self {
        let peak = aperture.peak(power);
        let is_wide = matches!(divergence, Divergence::HalfAngle(angle) if angle > FRAC_PI_2);
        Fiber {
            axis: aperture.direction(),
            aperture,
            profile,
            divergence,
            edge: Edge { sine: 1.0, is_wide },
            focus: None,
            peak,
        }
        .in_medium(1.0)
    }

    /// Rotates the cones of all points of the aperture so that their axes meet on the axis of the
    /// fibre. The focus is at a `distance` > 0 from the centre; for a `distance` < 0 the axes
    /// diverge from a point behind the aperture.
    pub fn with_focus(self, distance: f64) -> Self {
        Fiber {
            focus: Some(distance),
            ..self
        }
    }

    /// Rotates the axes of all cones from the normal of the aperture to a `direction`, which is not
    /// zero. A focus lies along this direction from the centre.
    pub fn with_axis(self, direction: DVec3) -> Self {
        Fiber {
            axis: direction.normalize(),
            ..self
        }
    }

    /// Returns the fibre in a medium of index `n` > 0.
    pub fn in_medium(self, n: f64) -> Self {
        let sine = match self.divergence {
            Divergence::HalfAngle(angle) => angle.sin(),
            // Planted error "numerical apertures taken in vacuum", found by morgana-transport/transport::sources::shares::nothing_is_beside_the_cone:
            // Divergence::NumericalAperture(aperture) => aperture * (n / n),
            Divergence::NumericalAperture(aperture) => aperture / n,
        };
        let edge = Edge { sine, ..self.edge };
        Fiber { edge, ..self }
    }

    /// Returns the fibre displaced by `shift`.
    pub fn moved(mut self, shift: DVec3) -> Self {
        self.aperture = self.aperture.moved(shift);
        self
    }

    /// Returns the aperture.
    pub fn aperture(&self) -> &Aperture {
        &self.aperture
    }

    /// Returns the angular distribution of the light.
    pub fn profile(&self) -> &AngularProfile {
        &self.profile
    }

    /// Returns the unit direction of the light at the centre of the aperture.
    pub fn direction(&self) -> DVec3 {
        self.axis
    }

    /// Returns the divergence of the light.
    pub fn divergence(&self) -> Divergence {
        self.divergence
    }

    /// Returns the distance of the focus, if there is one.
    pub fn focus(&self) -> Option<f64> {
        self.focus
    }

    /// Returns the centre of the aperture.
    pub fn origin(&self) -> DVec3 {
        self.aperture.origin()
    }

    /// Returns the sine of the half angle of the cone, in the medium at its centre. It exceeds 1 if
    /// the numerical aperture is larger than the index there.
    pub fn sin(&self) -> f64 {
        self.edge.sine
    }

    /// Returns the approximate fraction of the aperture whose cones contain a point in the beam.
    /// The point is at `distance` from the aperture, or at the focus if there is one. The fraction
    /// is the probability that a connection contributes.
    pub fn share_seen(&self, distance: f64) -> f64 {
        let sine = self.profile.spread(self.edge);
        let spot = sine * self.focus.map_or(distance, f64::abs);
        (spot / self.aperture.radius()).powi(2).min(1.0)
    }

    /// Returns the irradiance of the aperture on its axis; with an image, the irradiance where the
    /// image is one.
    pub(super) fn peak(&self) -> Spectrum {
        self.peak
    }

    /// Returns the total power.
    pub fn power(&self) -> Spectrum {
        self.peak * self.aperture.area()
    }

    /// Returns the power per unit area at a point of the aperture, and per steradian in a unit
    /// direction.
    pub fn emitted(&self, point: DVec3, direction: DVec3) -> Spectrum {
        self.peak * self.aperture.relative(point) * self.pdf(point, direction)
    }

    /// Estimates the intensity in a unit direction, summed over the channels. Half of the light is
    /// assumed isotropic, because nearby points see the aperture's points in directions other than
    /// its centre.
    pub fn intensity_roughly(&self, direction: DVec3) -> f64 {
        let pdf = self.pdf(self.origin(), direction);
        self.power().sum() * 0.5 * (pdf + uniform_sphere_pdf())
    }

    /// Returns the axis of the cone of a point.
    fn axis(&self, point: DVec3) -> DVec3 {
        let turned = |focus: f64| {
            let to = self.aperture.origin() + self.axis * focus;
            ((to - point) * focus.signum()).try_normalize()
        };
        self.focus.and_then(turned).unwrap_or(self.axis)
    }

    /// Returns a frame with +z along the axis of a cone. Its +x is closest to +x of the aperture.
    fn frame(&self, axis: DVec3) -> Frame {
        Frame::along(axis, self.aperture.frame().s)
    }

    /// Samples a direction in which light leaves a point, with density proportional to the
    /// intensity.
    pub(super) fn sample(&self, point: DVec3, u: [f64; 2]) -> DVec3 {
        let axis = self.axis(point);
        let frame = if self.profile.depends_on_azimuth() {
            self.frame(axis)
        } else {
            Frame::from_normal(axis)
        };
        frame
            .to_world(self.profile.sample(self.edge, u))
            .normalize()
    }

    /// Returns the density of [`Fiber::sample`] per steradian.
    pub(super) fn pdf(&self, point: DVec3, direction: DVec3) -> f64 {
        let axis = self.axis(point);
        if self.profile.depends_on_azimuth() {
            let local = self.frame(axis).to_local(direction);
            return self.profile.pdf(self.edge, local);
        }
        // Unlike √(1 − cos²), the cross product keeps its digits in a narrow cone.
        let (cos, sin) = (axis.dot(direction), axis.cross(direction).length());
        self.profile.round_pdf(self.edge, cos, sin)
    }
}
