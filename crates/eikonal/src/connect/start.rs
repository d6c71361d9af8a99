//! Initial guesses of Newton's method, and limits of the search for branches.

use super::family::RayFamily;
use super::pattern::Pattern;
use crate::ray::{Node, Tangents};

/// Initial guess of Newton's method: a ray, and the length along it at which the target is assumed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialGuess<R> {
    /// First point and direction of the ray.
    pub family: RayFamily,
    /// Region in which the ray starts.
    pub region: R,
    /// Optical path length ∫n ds, positive.
    pub optical_length: f64,
    /// Choices of the ray at refracting interfaces; the iteration keeps them.
    pub pattern: Pattern,
}

/// An initial guess whose ray has been traced before.
#[derive(Clone, Copy, Debug)]
pub struct Followed<R> {
    /// Initial guess.
    pub start: InitialGuess<R>,
    /// End of the ray, with its tangents.
    pub end: Node<Tangents>,
    /// Number of field evaluations that tracing took.
    pub evaluations: u64,
}

/// Limits of the search for branches: length and number of reflections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Longest optical path length ∫n ds; at most a million times the distance between the points
    /// has an effect.
    pub optical_length: f64,
    /// Maximum number of reflections where refraction is possible; at most
    /// [`Pattern::MAX_ENCOUNTERS`] have an effect.
    pub reflections: u32,
    /// Maximum number of all reflections, total reflections included.
    pub bounces: u32,
}

/// Largest optical path length of a search, relative to the distance between the points.
const MAX_RELATIVE_LENGTH: f64 = 1e6;

impl Reach {
    /// Limits the reach for points at a distance, so that rays are not traced without end.
    pub(super) fn within(self, distance: f64) -> Self {
        // Replace NaN by zero length.
        let optical_length = self
            .optical_length
            .max(0.0)
            .min(MAX_RELATIVE_LENGTH * distance);
        Reach {
            optical_length,
            ..self
        }
    }

    /// Returns true if the reach includes a branch of this optical path length, with `reflections`
    /// by choice and `bounces` in total.
    pub fn includes(&self, optical_length: f64, reflections: u32, bounces: u32) -> bool {
        optical_length <= self.optical_length
            && reflections <= self.reflections
            && bounces <= self.bounces
    }
}
