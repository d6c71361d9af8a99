//! Replay of paths through a changed scene, with the recorded decisions and random numbers.

use super::super::Majorants;
use super::super::record::{AttachedPath, Crossed, SampledChannel, Scattering, SegmentEnd};
use super::TOLERANCE;
use crate::Spectrum;
use crate::bsdf::fresnel;
use crate::scene::{MediumId, Scene};
use crate::sensor::SensorRay;
use eikonal::Tolerance;
use eikonal::adjoint::{Flight, FlightIntersection, FlightLimits, FlightPoint};
use eikonal::connect::World;
use eikonal::interface::{Interface, Rule};
use eikonal::ray::{Arc, Work};
use glam::{DMat3, DQuat, DVec3};

/// Path through a changed scene.
pub(super) struct Replay<'a> {
    scene: &'a Scene,
    medium: MediumId,
    x: DVec3,
    v: DVec3,
    /// Factor on the recorded throughput; it includes n² at the sensor in the changed scene.
    ratio: Spectrum,
    flight: Flight,
}

impl Replay<'_> {
    /// Returns the contribution of a path in each channel, times n² at the sensor in the recorded
    /// scene. Returns `None` if the path's events differ.
    pub(super) fn of(scene: &Scene, path: &AttachedPath, ray: SensorRay) -> Option<Spectrum> {
        let medium = path.segments[0].medium;
        let found = path.found.as_ref().unwrap();
        let mut replay = Replay {
            scene,
            medium,
            x: ray.origin,
            v: ray.direction * scene.n(medium, ray.origin),
            ratio: Spectrum::splat(scene.field(medium).n2(ray.origin)),
            flight: Flight::default(),
        };
        let mut light = Spectrum::ZERO;
        for segment in &path.segments {
            if segment.medium != replay.medium {
                return None;
            }
            match &segment.end {
                SegmentEnd::Scattered(event) => replay.scatter(event, &segment.sampled)?,
                SegmentEnd::Crossed(event) => replay.cross(event, &segment.sampled)?,
                SegmentEnd::Arrived(_) => {
                    let n2 = scene.field(replay.medium).n2(replay.x);
                    let toward = replay.v.normalize();
                    let (_, sky) = scene.environments().next()?;
                    light = sky.radiance(toward) / n2;
                }
            }
        }
        Some(found.throughput * light * replay.ratio)
    }

    /// Returns the extinction by which flights collide.
    fn sigma(&self) -> Spectrum {
        Majorants::new(self.scene, 2).of(self.medium)
    }

    /// Returns the factor of a collision at a position, up to a constant: the scattering
    /// coefficient, or for a null collision the extinction missing to the majorant.
    fn acceptance_ratio(&self, x: DVec3, is_real: bool) -> Spectrum {
        let medium = self.scene.medium(self.medium);
        let (sigma, most) = (medium.extinction(x), self.sigma()[0]);
        if is_real {
            sigma * medium.albedo.at(x)
        } else {
            sigma.map(|sigma| most - sigma)
        }
    }

    /// Updates the weights of channels for a segment that is `longer` than recorded: each channel's
    /// density over the density of all channels.
    fn weigh(&mut self, sampled: &SampledChannel, longer: f64) {
        let left = self.sigma().map(|sigma| (-sigma * longer).exp());
        self.ratio *= left / (sampled.posterior * left).sum();
    }

    fn fly(&mut self) -> Option<(FlightPoint, Option<FlightIntersection<usize>>)> {
        let limits = FlightLimits {
            tolerance: Tolerance::new(TOLERANCE),
            resolved: self.medium > 0,
            length: 1e3,
        };
        let scene = self.scene;
        let meets = |arc: &Arc| {
            let (what, hit) = scene.first_hit(arc)?;
            Some(FlightIntersection {
                theta: hit.theta,
                position: hit.position,
                normal: hit.normal,
                what,
            })
        };
        let field = scene.field(self.medium);
        let start = [self.x, self.v];
        let flown = self
            .flight
            .follow(field, start, &limits, &mut Work::default(), meets);
        flown.ok()
    }

    fn scatter(&mut self, event: &Scattering, sampled: &SampledChannel) -> Option<()> {
        let (end, _) = self.fly()?;
        let sigma = self.sigma()[sampled.channel];
        let beyond = event.boundary.as_ref()?;
        let collides = |length: f64| -(-sigma * length).exp_m1();
        let before = collides(beyond.end.length);
        let u = collides(event.vertex.length) / before;
        let after = collides(end.length);
        self.ratio *= after / before;
        let length = -(-u * after).ln_1p() / sigma;
        self.weigh(sampled, length - event.vertex.length);
        let field = self.scene.field(self.medium);
        let (vertex, ..) = self.flight.at(field, true, length);
        let is_real = event.onward.is_some();
        let [now, then] = [vertex.x, event.vertex.x].map(|x| self.acceptance_ratio(x, is_real));
        self.ratio *= Spectrum(std::array::from_fn(|c| {
            if then[c] > 0.0 { now[c] / then[c] } else { 0.0 }
        }));
        let turn = DQuat::from_rotation_arc(event.vertex.v.normalize(), vertex.v.normalize());
        self.x = vertex.x;
        self.v = match event.onward {
            Some(onward) => turn * onward * field.n(vertex.x),
            None => vertex.v,
        };
        Some(())
    }

    fn cross(&mut self, event: &Crossed, sampled: &SampledChannel) -> Option<()> {
        let (end, met) = self.fly()?;
        let met = met?;
        let longer = end.length - event.end.length;
        self.ratio *= (-self.sigma()[sampled.channel] * longer).exp();
        self.weigh(sampled, longer);
        let n2 = |medium| (self.scene.field(medium).n2(end.x), DVec3::ZERO);
        let interface = Interface {
            normal: met.normal,
            shape: DMat3::ZERO,
            near: n2(self.medium),
            far: n2(event.far),
        };
        let rule = event.crossing.rule;
        let after = interface.velocity(rule, end.v)?;
        match &event.share {
            Some(share) => {
                let [near, far] = [interface.near.0, interface.far.0].map(f64::sqrt);
                let cos = met.normal.dot(end.v.normalize()).abs();
                let f = fresnel::dielectric(cos, near, far).reflectance;
                let own = if rule == Rule::Reflect { f } else { 1.0 - f };
                self.ratio *= own / share.value;
            }
            None => self.ratio *= interface.far.0 / interface.near.0,
        }
        // The recorded throughput contains the ratio of the unchanged scene.
        if event.share.is_none() {
            let before = &event.crossing.interface;
            self.ratio *= before.near.0 / before.far.0;
        }
        let off = self.scene.ray_epsilon().copysign(met.normal.dot(after));
        self.x = end.x + met.normal * off;
        self.v = after;
        if rule != Rule::Reflect {
            self.medium = event.far;
        }
        Some(())
    }
}
