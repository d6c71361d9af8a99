//! Ways of which note is taken, to be followed later.

use super::path::{SoundInMedia, TaggedPath};
use crate::scene::MediumId;
use eikonal::ray::Arc;
use glam::DVec3;

/// A part of an arc up to θ.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub medium: MediumId,
    pub arc: Arc,
    pub theta: f64,
}

/// A step of a way.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Along an arc.
    Fly(Leg),
    /// Scattering into this direction.
    Scatter(DVec3),
    /// Along a connection, which may be followed from its other end.
    Connect(Leg),
}

impl TaggedPath {
    /// On by steps.
    pub(crate) fn go(&mut self, sound: &SoundInMedia, steps: &[Step]) {
        for step in steps {
            match step {
                Step::Fly(leg) => self.fly(sound, leg.medium, &leg.arc, leg.theta),
                Step::Scatter(direction) => self.scatter(sound, *direction),
                Step::Connect(leg) => self.connect(sound, leg.medium, &leg.arc, leg.theta),
            }
        }
    }
}
