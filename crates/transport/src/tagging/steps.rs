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

/// A step of a way. Its legs are kept apart: they are large.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Along the leg with this number.
    Fly(usize),
    /// Scattering into this direction.
    Scatter(DVec3),
    /// Along that of a connection, which may be followed from its other end.
    Connect(usize),
}

impl TaggedPath {
    /// On by steps along legs.
    pub(crate) fn go(&mut self, sound: &SoundInMedia, legs: &[Leg], steps: &[Step]) {
        for step in steps {
            match *step {
                Step::Fly(i) => self.fly(sound, legs[i].medium, &legs[i].arc, legs[i].theta),
                Step::Scatter(direction) => self.scatter(sound, direction),
                Step::Connect(i) => {
                    self.connect(sound, legs[i].medium, &legs[i].arc, legs[i].theta);
                }
            }
        }
    }
}
