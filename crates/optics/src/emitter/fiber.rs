//! End of an optical fibre: an aperture that radiates into a cone.

use super::aperture::Aperture;
use crate::Spectrum;
use crate::sampling::Frame;
use crate::sampling::disc::{
    truncated_gaussian_disc_pdf, truncated_gaussian_disc_sample, uniform_disc_pdf,
    uniform_disc_sample,
};
use crate::sampling::sphere::{uniform_cone_sample, uniform_sphere_pdf};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Angular distribution of the light of a fibre. θ is the angle from the axis, θ₀ the angle of the
/// edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AngularProfile {
    /// Same intensity for θ ≤ θ₀: uniform in solid angle.
    Uniform,
    /// Same radiance for θ ≤ θ₀: intensity proportional to cos θ.
    Lambertian,
    /// Radiance proportional to exp(−2 sin²θ/sin²θ₀), over the whole hemisphere.
    Gaussian,
}

/// Divergence of the light of a fibre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Divergence {
    /// Half angle θ₀ of the cone in radians, in (0, π/2].
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
    /// Sine of θ₀.
    sin: f64,
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
        Fiber {
            aperture,
            profile,
            divergence,
            sin: 1.0,
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

    /// Returns the fibre in a medium of index `n` > 0.
    pub fn in_medium(self, n: f64) -> Self {
        let sin = match self.divergence {
            Divergence::HalfAngle(angle) => angle.sin(),
            // Planted error "numerical apertures taken in vacuum", found by morgana-transport/transport::sources::shares::nothing_is_beside_the_cone:
            // Divergence::NumericalAperture(aperture) => aperture * (n / n),
            Divergence::NumericalAperture(aperture) => aperture / n,
        };
        Fiber { sin, ..self }
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
        self.sin
    }

    /// Returns the approximate fraction of the aperture whose cones contain a point in the beam.
    /// The point is at `distance` from the aperture, or at the focus if there is one. The fraction
    /// is the probability that a connection contributes.
    pub fn share_seen(&self, distance: f64) -> f64 {
        let spot = self.edge() * self.focus.map_or(distance, f64::abs);
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
        let axis = self.aperture.direction();
        let turned = |focus: f64| {
            let to = self.aperture.origin() + axis * focus;
            ((to - point) * focus.signum()).try_normalize()
        };
        self.focus.and_then(turned).unwrap_or(axis)
    }

    /// Samples a direction in which light leaves a point, with density proportional to the
    /// intensity.
    pub(super) fn sample(&self, point: DVec3, u: [f64; 2]) -> DVec3 {
        let lifted = |p: DVec2| p.extend((1.0 - p.length_squared()).max(0.0).sqrt());
        let local = match self.profile {
            AngularProfile::Uniform => uniform_cone_sample(self.cap(), u),
            AngularProfile::Lambertian => lifted(self.edge() * uniform_disc_sample(u)),
            AngularProfile::Gaussian => {
                lifted(truncated_gaussian_disc_sample(0.5 * self.edge(), u))
            }
        };
        Frame::from_normal(self.axis(point))
            .to_world(local)
            .normalize()
    }

    /// Returns the density of [`Fiber::sample`] per steradian.
    pub(super) fn pdf(&self, point: DVec3, direction: DVec3) -> f64 {
        let (axis, edge) = (self.axis(point), self.edge());
        let cos = axis.dot(direction);
        // Unlike √(1 − cos²), the cross product keeps its digits in a narrow cone.
        let p = DVec2::new(axis.cross(direction).length(), 0.0);
        if cos <= 0.0 {
            return 0.0;
        }
        match self.profile {
            AngularProfile::Uniform if p.x <= edge => 1.0 / (TAU * self.cap()),
            AngularProfile::Uniform => 0.0,
            AngularProfile::Lambertian => cos * uniform_disc_pdf(p / edge) / (edge * edge),
            AngularProfile::Gaussian => cos * truncated_gaussian_disc_pdf(0.5 * edge, p),
        }
    }

    /// Returns the sine of the half angle, at most 1.
    fn edge(&self) -> f64 {
        self.sin.min(1.0)
    }

    /// Returns the height 1 − cos of the cap that the cone cuts out of the unit sphere.
    fn cap(&self) -> f64 {
        let sin2 = self.edge() * self.edge();
        sin2 / (1.0 + (1.0 - sin2).sqrt())
    }
}
