//! Ways of which note is taken, to be followed later.

use super::path::{SoundInMedia, TaggedPath};
use super::sound_along::SoundAlong;
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

impl Step {
    /// The number of its part, if it goes along one.
    fn part(&self) -> Option<usize> {
        match self {
            Step::Fly(i) | Step::Connect(i) => Some(*i),
            Step::Scatter(_) => None,
        }
    }
}

impl TaggedPath {
    /// On by steps along parts of rays. All that is asked of the sound within a medium is found at once.
    pub(crate) fn go(
        &mut self,
        sound: &SoundInMedia,
        parts: &[RayPart],
        steps: &[Step],
        along: &mut SoundAlong,
    ) {
        let mut rest = steps;
        while let [first, next @ ..] = rest {
            let medium = match first {
                Step::Fly(i) | Step::Connect(i) => parts[*i].medium,
                Step::Scatter(direction) => {
                    self.scatter(sound, *direction);
                    rest = next;
                    continue;
                }
            };
            let is_beyond = |step: &Step| step.part().is_some_and(|i| parts[i].medium != medium);
            let count = rest.iter().position(is_beyond).unwrap_or(rest.len());
            let (within, beyond) = rest.split_at(count);
            match sound.within(medium) {
                Some(sound) => {
                    let start = self.last_in(medium);
                    let last = along.follow(sound, start, parts, within);
                    along.add_to(&mut self.modulation, sound, parts);
                    self.last = last.map(|last| (medium, last));
                }
                None => self.last = None,
            }
            rest = beyond;
        }
    }
}
