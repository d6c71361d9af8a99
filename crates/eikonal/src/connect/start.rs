//! Where Newton's method starts, and how far branches are looked for.

use super::family::RayFamily;
use super::pattern::Pattern;
use crate::ray::{Node, Tangents};

/// A start of Newton's method: a ray and how far along it the target is taken to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialGuess<R> {
    /// First point and direction of the ray.
    pub family: RayFamily,
    /// The region in which it starts.
    pub region: R,
    /// Optical path length ∫n ds, positive.
    pub optical_length: f64,
    /// Which way the ray goes at refracting interfaces; the iteration keeps to it.
    pub pattern: Pattern,
}

/// A start whose ray has been followed before.
#[derive(Clone, Copy, Debug)]
pub struct Followed<R> {
    /// The start.
    pub start: InitialGuess<R>,
    /// Where the ray gets, with its tangents.
    pub end: Node<Tangents>,
    /// Field evaluations that it took to find that.
    pub evaluations: u64,
}

/// How far, and through how many reflections, branches are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Longest optical path length ∫n ds; no more than a million times the distance of the points counts.
    pub optical_length: f64,
    /// Most reflections at places where refraction is possible; at most [`Pattern::ENCOUNTERS`]
    /// matter.
    pub reflections: u32,
    /// Most reflections in all, total ones included.
    pub bounces: u32,
}

/// How many times the distance of the points branches are looked for at most.
const FARTHEST: f64 = 1e6;

impl Reach {
    /// As much of it as counts for points at a distance: rays are not followed without end.
    pub(super) fn within(self, distance: f64) -> Self {
        // Not a number is no length.
        let optical_length = self.optical_length.max(0.0).min(FARTHEST * distance);
        Reach {
            optical_length,
            ..self
        }
    }

    /// Whether a branch is looked for that has this optical path length, takes `reflections` by choice
    /// and `bounces` in all.
    pub fn includes(&self, optical_length: f64, reflections: u32, bounces: u32) -> bool {
        optical_length <= self.optical_length
            && reflections <= self.reflections
            && bounces <= self.bounces
    }
}
