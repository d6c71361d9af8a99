//! Following ways of which note was taken.

use super::path::{SoundInMedia, TaggedPath};
use super::sound_along::SoundAlong;
use super::steps::Step;
use crate::path::RayPart;

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
