//! Extinction along one arc.

use super::Medium;
use crate::Spectrum;
use eikonal::ray::{Arc, Profile};

/// What a medium takes from the light along one arc, as a function of θ.
#[derive(Clone, Debug)]
pub enum Attenuation {
    /// Nothing.
    None,
    /// The same extinction everywhere: depth is proportional to arc length.
    Uniform(Spectrum),
    /// The same on a straight arc of this length: depth is proportional to θ.
    Even(Spectrum, f64),
    /// Integrated along the arc.
    Varying(Profile<{ Spectrum::LANES }>),
}

impl Attenuation {
    /// For the part θ ≤ `theta_end` of an arc.
    pub fn new(medium: &Medium, arc: &Arc, theta_end: f64) -> Self {
        if medium.is_transparent() {
            return Attenuation::None;
        }
        match medium.uniform_extinction() {
            Some(sigma) if arc.is_straight() => Attenuation::Even(sigma, arc.arc_length(1.0)),
            Some(sigma) => Attenuation::Uniform(sigma),
            None => Attenuation::Varying(Profile::new(arc, theta_end, medium.spacing(), |x| {
                medium.extinction(x).0
            })),
        }
    }

    /// Optical depth from the start of the arc to θ.
    pub fn depth(&self, arc: &Arc, theta: f64) -> Spectrum {
        match self {
            Attenuation::None => Spectrum::ZERO,
            Attenuation::Uniform(sigma) => *sigma * arc.arc_length(theta),
            Attenuation::Even(sigma, length) => *sigma * (length * theta),
            Attenuation::Varying(profile) => Spectrum(profile.depth(theta)),
        }
    }

    /// Extinction per unit length at θ: exactly the derivative of [`Attenuation::depth`].
    pub fn rate(&self, arc: &Arc, theta: f64) -> Spectrum {
        match self {
            Attenuation::None => Spectrum::ZERO,
            Attenuation::Uniform(sigma) | Attenuation::Even(sigma, _) => *sigma,
            Attenuation::Varying(profile) => {
                let speed = arc.velocity(theta).length() * arc.h();
                Spectrum(profile.density(theta)) / speed
            }
        }
    }

    /// θ ≤ `theta_end` at which the depth of a channel reaches `target`.
    pub fn invert(&self, arc: &Arc, theta_end: f64, channel: usize, target: f64) -> Option<f64> {
        match self {
            Attenuation::None => None,
            Attenuation::Uniform(sigma) => {
                let length = target / sigma[channel];
                (length < arc.arc_length(theta_end)).then(|| arc.theta_at_length(length))
            }
            Attenuation::Even(sigma, length) => {
                let theta = target / (sigma[channel] * length);
                (theta < theta_end).then_some(theta)
            }
            Attenuation::Varying(profile) => profile.invert(channel, target),
        }
    }
}
