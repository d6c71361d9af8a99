//! Checks of the numbers of emitters.

use super::checks::Problems;
use crate::emitter::{BeamProfile, Divergence, Emitter, Fiber, Spot, Surroundings};
use eikonal::Shown;
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Range of lengths with finite squares and reciprocals of squares.
const LENGTHS: RangeInclusive<f64> = 1e-100..=1e100;

impl Problems {
    pub(super) fn emitters(&mut self, emitters: &[Emitter]) {
        for (i, emitter) in emitters.iter().enumerate() {
            let subject = format!("emitter {i}");
            if matches!(emitter, Emitter::Area { .. } | Emitter::Textured(_)) {
                let message = "it covers an object: use ObjectBuilder::emission";
                self.add(subject, None, message.into());
                continue;
            }
            self.geometry(&subject, emitter);
            let before = self.count();
            self.numbers(&subject, emitter);
            if self.count() > before {
                continue;
            }
            let around = Surroundings {
                center: DVec3::ZERO,
                radius: 1.0,
            };
            let no_shape = |_| unreachable!("emitters on objects were refused");
            self.light(subject, "power", emitter.power(&around, no_shape));
        }
    }

    fn geometry(&mut self, subject: &str, emitter: &Emitter) {
        let most = LENGTHS.end();
        let vectors = geometry(emitter);
        if !vectors.into_iter().all(DVec3::is_finite) {
            let message = "positions and directions must be finite, and directions not zero";
            self.add(subject.into(), None, message.into());
        } else if let Some(far) = vectors.into_iter().find(|v| v.abs().max_element() > *most) {
            let message = format!(
                "coordinates must be at most {}, but it is at {}",
                Shown(*most),
                Shown(far)
            );
            self.add(subject.into(), None, message);
        }
    }

    /// Checks the numbers that determine the directions of an emitter's light.
    fn numbers(&mut self, subject: &str, emitter: &Emitter) {
        match emitter {
            Emitter::Spot(spot) => self.spot(subject, spot),
            Emitter::Collimated(beam) => self.profile(subject, beam.aperture().profile()),
            Emitter::Fiber(fiber) => self.fiber(subject, fiber),
            Emitter::Projector(projector) => self.field_of_view(subject, projector.half()[0]),
            _ => {}
        }
    }

    fn spot(&mut self, subject: &str, spot: &Spot) {
        let (cutoff, beam_width) = (spot.cutoff(), spot.beam_width());
        self.angle(subject, "cutoff", cutoff, PI);
        if !(0.0..=cutoff).contains(&beam_width) {
            let message = format!(
                "must be 0 to the cutoff, {}, but it is {}",
                Shown(cutoff),
                Shown(beam_width)
            );
            self.add(subject.into(), Some("beam_width"), message);
        }
    }

    fn fiber(&mut self, subject: &str, fiber: &Fiber) {
        self.profile(subject, fiber.aperture().profile());
        match fiber.divergence() {
            Divergence::HalfAngle(angle) => {
                self.angle(subject, "half_angle", angle, fiber.profile().max_edge());
            }
            Divergence::NumericalAperture(aperture) => {
                self.length(subject, "numerical_aperture", aperture);
            }
        }
        if let Some(focus) = fiber.focus() {
            self.length(subject, "focus", focus.abs());
        }
    }

    fn profile(&mut self, subject: &str, profile: BeamProfile) {
        match profile {
            BeamProfile::Disc { radius } => self.length(subject, "radius", radius),
            BeamProfile::Annulus { inner, radius } => {
                self.length(subject, "radius", radius);
                if !(0.0..radius).contains(&inner) {
                    let message = format!(
                        "must be at least 0 and below the radius, but it is {}",
                        Shown(inner)
                    );
                    self.add(subject.into(), Some("inner"), message);
                }
            }
            BeamProfile::Gaussian { waist } => self.length(subject, "waist", waist),
            BeamProfile::Rectangle { width, height }
            | BeamProfile::Parallelogram { width, height, .. } => {
                self.length(subject, "width", width);
                self.length(subject, "height", height);
            }
        }
    }

    fn angle(&mut self, subject: &str, parameter: &'static str, value: f64, most: f64) {
        if !(value > 0.0 && value <= most) {
            let message = format!(
                "must be above 0 and at most {} degrees, but it is {}",
                most.to_degrees(),
                Shown(value.to_degrees())
            );
            self.add(subject.into(), Some(parameter), message);
        }
    }

    /// Checks a length, or another number that is squared.
    pub(super) fn length(&mut self, subject: &str, parameter: &'static str, value: f64) {
        if !LENGTHS.contains(&value) {
            let [least, most] = [LENGTHS.start(), LENGTHS.end()].map(|v| Shown(*v));
            let message = format!("must be {least} to {most}, but it is {}", Shown(value));
            self.add(subject.into(), Some(parameter), message);
        }
    }
}

/// Returns the position of an emitter and the direction in which it radiates.
fn geometry(emitter: &Emitter) -> [DVec3; 2] {
    match emitter {
        Emitter::Directional { direction, .. } => [*direction, DVec3::ZERO],
        _ => [emitter.position(), emitter.axis()].map(Option::unwrap_or_default),
    }
}
