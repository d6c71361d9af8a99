//! Modulation along recorded steps.
//!
//! Theory: docs/theory.md#tagged-light.

use super::path::{SoundInMedia, TaggedPath};
use super::sound_along::SoundAlong;
use super::steps::Step;
use crate::path::RayPart;

impl TaggedPath {
    /// Extends the path by steps along parts of rays. All values of the sound within a medium are
    /// computed at once.
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
            // Planted error "the sound of one medium in all that have any", found by morgana-transport/lib::observe::tagging::follow::tests::steps_add_up_however_many_are_followed_at_once:
            // let is_beyond = |step: &Step| step.part().is_some_and(|i| sound.is_in(parts[i].medium) != sound.is_in(medium));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MediumId;
    use eikonal::Field;
    use eikonal::field::{Acoustic, AcousticMode, Constant, Modulation};
    use eikonal::ray::Arc;
    use glam::{DVec2, DVec3};
    use testkit::Rng;

    /// Returns sound of two wavelengths, and a medium without sound.
    fn sounds() -> SoundInMedia {
        let field = |wave_number| {
            let mode = AcousticMode::new(1e-5, 1, wave_number, 0.3).unwrap();
            let field = Acoustic::new(1.33, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode]);
            Field::from(field.unwrap().with_elasto_optic(0.32).unwrap())
        };
        let fields = [field(9.0), Constant::new(1.2).into(), field(4.0)];
        SoundInMedia(fields.iter().map(Modulation::of).collect())
    }

    /// Returns a part from `start`, straight or curved, long or short, within a medium.
    fn part(rng: &mut Rng, start: DVec3, medium: MediumId) -> RayPart {
        let v = 1.3 * DVec3::from_array(rng.direction());
        let h = 1.5 * rng.next_1d().powi(2);
        let arc = if rng.next_1d() < 0.5 {
            Arc::line(start, v, h)
        } else {
            let bend = 0.2 * DVec3::from_array(rng.direction());
            let end = start + v * h + bend * (0.5 * h * h);
            Arc::hermite([start, v, bend], [end, v + bend * h, bend], h)
        };
        RayPart {
            arc,
            theta_end: 0.2 + 0.8 * rng.next_1d(),
            medium,
        }
    }

    /// Returns a path through several media, with some scattering and a connection of two parts at
    /// its end. The first part is followed backwards.
    fn way(rng: &mut Rng) -> (Vec<RayPart>, Vec<Step>) {
        let (mut x, mut medium) = (DVec3::ZERO, 0);
        let (mut parts, mut steps) = (Vec::new(), Vec::new());
        for _ in 0..12 {
            if rng.next_1d() < 0.3 {
                medium = (3.0 * rng.next_1d()) as usize;
            }
            let flown = part(rng, x, medium);
            x = flown.arc.position(flown.theta_end);
            steps.push(Step::Fly(parts.len()));
            parts.push(flown);
            if rng.next_1d() < 0.7 {
                steps.push(Step::Scatter(DVec3::from_array(rng.direction())));
            }
        }
        let first = part(rng, x, medium);
        let beyond = part(rng, first.arc.end(), (medium + 2) % 3);
        let back = RayPart {
            arc: first.arc.reversed(),
            theta_end: 1.0,
            medium,
        };
        steps.extend([parts.len(), parts.len() + 1].map(Step::Connect));
        parts.extend([back, beyond]);
        (parts, steps)
    }

    /// Computes the expected path step by step.
    fn expected(sounds: &SoundInMedia, parts: &[RayPart], steps: &[Step]) -> TaggedPath {
        let mut path = TaggedPath::default();
        for step in steps {
            match *step {
                Step::Fly(i) => {
                    let RayPart {
                        arc,
                        theta_end,
                        medium,
                    } = &parts[i];
                    path.fly(sounds, *medium, arc, *theta_end);
                }
                Step::Scatter(direction) => path.scatter(sounds, direction),
                Step::Connect(i) => {
                    let RayPart {
                        arc,
                        theta_end,
                        medium,
                    } = &parts[i];
                    let Some(sound) = sounds.within(*medium) else {
                        continue;
                    };
                    let ends = [0.0, *theta_end].map(|theta| sound.at(arc.position(theta)));
                    path.modulation.index += sound.along(arc, [0.0, *theta_end], &ends);
                }
            }
        }
        path
    }

    /// Results have the same bits for any number of steps that are followed at once.
    #[test]
    fn steps_add_up_however_many_are_followed_at_once() {
        let (sounds, mut rng) = (sounds(), Rng::new(5));
        let mut along = SoundAlong::default();
        for _ in 0..200 {
            let (parts, steps) = way(&mut rng);
            let expected = expected(&sounds, &parts, &steps).modulation();
            assert!(expected.index != DVec2::ZERO && expected.displacement.is_finite());
            let cut = (steps.len() as f64 * rng.next_1d()) as usize;
            let mut path = TaggedPath::default();
            for steps in [&steps[..cut], &steps[cut..]] {
                path.go(&sounds, &parts, steps, &mut along);
            }
            assert_eq!(path.modulation(), expected);
        }
    }
}
