//! Ways of which note is taken, to be followed later.

use super::path::{SoundInMedia, TaggedPath};
use crate::path::RayPart;
use glam::DVec3;

/// A step of a way. The parts along which it goes are kept apart: they are large.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Along the part with this number.
    Fly(usize),
    /// Scattering into this direction.
    Scatter(DVec3),
    /// Along that of a connection, which may be followed from its other end.
    Connect(usize),
}

impl TaggedPath {
    /// On by steps along parts of rays.
    pub(crate) fn go(&mut self, sound: &SoundInMedia, parts: &[RayPart], steps: &[Step]) {
        for step in steps {
            match *step {
                Step::Fly(i) => self.fly(sound, &parts[i]),
                Step::Scatter(direction) => self.scatter(sound, direction),
                Step::Connect(i) => self.connect(sound, &parts[i]),
            }
        }
    }
}
