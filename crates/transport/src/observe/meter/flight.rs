//! Events of a particle's walk that meters score.

use super::polarization::ParticleStokes;
use crate::Spectrum;
use crate::path::{End, FreeFlightEvent, FreeLeg, Point, Span, WalkEvent, share};
use crate::scene::{MediumId, Scene};
use crate::shape::Hit;
use glam::DVec3;

/// Flight of a particle along one arc of its path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flight<'a> {
    /// Scene.
    pub scene: &'a Scene,
    /// Channel probabilities with which distances are sampled.
    pub channel_pdf: Spectrum,
    /// Arc.
    pub span: &'a Span<'a>,
    /// End of the flight, which starts at θ = 0.
    pub theta_end: f64,
    /// Power at the start of the edge.
    pub power: Spectrum,
    /// Optical path length from the emitter to the start of the arc.
    pub optical_length: f64,
}

/// Collision in a medium.
#[derive(Clone, Copy, Debug)]
pub(super) struct Collision<'a> {
    /// Scene of the medium.
    pub scene: &'a Scene,
    /// Point of the collision.
    pub point: Point<'a>,
    /// Power of the particle over the collision's density per unit length: an estimate of ∫ Φ dV.
    pub path: Spectrum,
    /// Optical path length from the emitter.
    pub optical_length: f64,
}

/// Light that passes through a surface, or arrives at an opaque surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passing<'a> {
    /// Scene.
    pub scene: &'a Scene,
    /// Index of the object.
    pub object: usize,
    /// Point on the surface.
    pub hit: Hit,
    /// Unit direction beyond the surface. At an opaque surface, it is the direction of arrival.
    pub direction: DVec3,
    /// Medium in which the light travels in `direction`.
    pub medium: MediumId,
    /// Power.
    pub power: Spectrum,
    /// Optical path length from the emitter.
    pub optical_length: f64,
}

impl Passing<'_> {
    /// Returns the Stokes parameters of the light per unit of its power, in the frame of the
    /// [meter](super::IrradianceMeter::stokes).
    pub(super) fn stokes(&self, particle: &ParticleStokes) -> [Spectrum; 4] {
        let object = &self.scene.objects()[self.object];
        // Planted error "polarisation of particles whose frame at meters is that of the x axis", found by morgana-transport/transport::polarization::meters::records_of_scattered_light_are_polarised_as_pixels_are:
        // let up = object.shape.y_axis().length() * DVec3::X;
        let up = object.shape.y_axis();
        particle.at_surface(self.direction, up, object.bsdf.is_opaque())
    }
}

/// Leg of a free flight of a particle.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeFlightLeg<'e, 's> {
    /// Power of the particle.
    pub power: Spectrum,
    /// Optical path length from the emitter to the start of the leg.
    pub optical_length: f64,
    /// Course of the leg, and the matter that it passes through.
    pub leg: &'e FreeLeg<'s>,
}

/// Returns the legs of a free flight.
pub(super) fn free_legs<'e, 's>(
    event: &FreeFlightEvent<'e, 's>,
) -> impl Iterator<Item = FreeFlightLeg<'e, 's>> {
    let power = event.ray.throughput;
    let mut optical_length = event.ray.optical_length;
    event.flight.legs.iter().map(move |leg| {
        let free = FreeFlightLeg {
            power,
            optical_length,
            leg,
        };
        optical_length += leg.optical_length();
        free
    })
}

/// Returns the flights of a particle along an edge, up to its end.
pub(crate) fn flights<'e>(event: &'e WalkEvent) -> impl Iterator<Item = Flight<'e>> {
    let mut optical_length = event.ray.optical_length;
    let spans = event.spans().iter().enumerate();
    spans.map(move |(i, span)| {
        let theta_end = match event.edge.end {
            End::Collision(point) if i + 1 == event.edge.spans.len() => point.theta,
            _ => span.theta_end,
        };
        let flight = Flight {
            scene: event.scene,
            channel_pdf: event.channel_pdf,
            span,
            theta_end,
            power: event.ray.throughput,
            optical_length,
        };
        optical_length = flight.length_after();
        flight
    })
}

impl Flight<'_> {
    /// Returns the expected power at the start of the next span.
    pub(crate) fn power_after(&self, next: &Span) -> Spectrum {
        self.power * (next.weight_before * share(self.channel_pdf, next.depth_before))
    }

    /// Returns the optical path length from the emitter to the end of the flight.
    pub(super) fn length_after(&self) -> f64 {
        self.optical_length + self.span.arc.optical_length(self.theta_end)
    }

    /// Returns the expected power at θ, given that the particle reaches θ without a collision. With
    /// one channel it is constant along the arc.
    pub(crate) fn power_at(&self, theta: f64) -> Spectrum {
        if !self.power_varies() {
            return self.power * self.span.weight_before;
        }
        let within = (self.span.attenuation).depth(theta, self.span.length_at(theta));
        let depth = self.span.depth_before + within;
        self.power * self.span.weight_before * share(self.channel_pdf, depth)
    }

    /// Returns power and absorption coefficient, if both are constant along the arc.
    pub(super) fn uniform(&self) -> Option<[Spectrum; 2]> {
        if self.power_varies() {
            return None;
        }
        let absorption = match self.span.attenuation.label() {
            Some(label) => label.absorption,
            None => self.scene.medium(self.span.medium).uniform_absorption()?,
        };
        Some([self.power_at(0.0), absorption])
    }

    /// Returns true if the power varies along the arc.
    fn power_varies(&self) -> bool {
        self.channel_pdf.is_several() && !self.scene.medium(self.span.medium).is_transparent()
    }

    /// Returns the absorption coefficient at θ.
    pub(crate) fn absorption_at(&self, theta: f64) -> Spectrum {
        let (arc, medium) = (&self.span.arc, self.scene.medium(self.span.medium));
        self.span.attenuation.rate(arc, theta)
            * absorbed_share(medium.albedo.at(arc.position(theta)))
    }
}

impl Collision<'_> {
    /// Returns the power that the medium absorbs from the particle.
    pub(super) fn absorbed(&self) -> Spectrum {
        let albedo = self.point.albedo(self.scene);
        self.path * self.point.rate * absorbed_share(albedo)
    }

    /// Returns the absorption coefficient at the collision.
    pub(super) fn absorption(&self) -> Spectrum {
        self.point.rate * absorbed_share(self.point.albedo(self.scene))
    }
}

/// Returns 1 − albedo.
fn absorbed_share(albedo: Spectrum) -> Spectrum {
    albedo.map(|a| 1.0 - a)
}
