//! The sound along steps of a way within one medium. First all places are found where it is wanted, then all amplitudes, then the sums:
//! the processor works on several places at a time.
//!
//! Theory: docs/theory.md#tagged-light.

use super::path::{Last, PathModulation};
use super::steps::Step;
use crate::path::RayPart;
use eikonal::ModulationQuadrature;
use eikonal::field::{Modulation, SoundAmplitude};
use glam::{DVec2, DVec3};

const MOST_PLACES: usize = ModulationQuadrature::MOST_PLACES;

/// Storage for what is asked of the sound, and what it answers.
#[derive(Clone, Debug, Default)]
pub(crate) struct SoundAlong {
    /// Where amplitudes are wanted.
    places: Vec<DVec3>,
    amplitudes: Vec<SoundAmplitude>,
    /// Where values alone are wanted, and the numbers of these.
    inner: Vec<(usize, DVec3)>,
    /// Those of each part: zero where there are fewer.
    values: Vec<[DVec2; MOST_PLACES]>,
    parts: Vec<PartOfWay>,
    turns: Vec<Turn>,
}

/// How the modulation along a part is found.
#[derive(Clone, Debug)]
struct PartOfWay {
    /// Number of the part.
    part: usize,
    /// Numbers of the places where it starts and ends.
    ends: [usize; 2],
    /// `None` if it is long.
    quadrature: Option<ModulationQuadrature>,
}

/// Scattering at a place: the change of n ω, from after to before.
#[derive(Clone, Copy, Debug)]
struct Turn {
    place: usize,
    change: DVec3,
}

/// Where a way has come to: the number of the place, and index times the unit direction.
#[derive(Clone, Copy)]
struct Here {
    place: usize,
    velocity: DVec3,
}

impl SoundAlong {
    /// Finds the sound along steps, given where the way has come to in its medium if it has been there. Returns where it comes to.
    pub(super) fn follow(
        &mut self,
        sound: &Modulation,
        start: Option<Last>,
        parts: &[RayPart],
        steps: &[Step],
    ) -> Option<Last> {
        let here = self.ask(sound, start, parts, steps);
        let unknown = &self.places[self.amplitudes.len()..];
        self.amplitudes.extend(unknown.iter().map(|x| sound.at(*x)));
        self.values.resize(self.parts.len(), Default::default());
        let values = self.values.as_flattened_mut();
        for (number, x) in &self.inner {
            values[*number] = sound.value(*x);
        }
        here.map(|here| Last {
            x: self.places[here.place],
            velocity: here.velocity,
            amplitude: self.amplitudes[here.place],
        })
    }

    /// Takes note of where the sound is wanted along steps. Returns where they lead.
    fn ask(
        &mut self,
        sound: &Modulation,
        start: Option<Last>,
        parts: &[RayPart],
        steps: &[Step],
    ) -> Option<Here> {
        self.clear();
        let mut here = None;
        if let Some(last) = start {
            self.places.push(last.x);
            self.amplitudes.push(last.amplitude);
            let velocity = last.velocity;
            here = Some(Here { place: 0, velocity });
        }
        for step in steps {
            match *step {
                Step::Fly(part) => {
                    let place = self.ask_along(sound, parts, part, here);
                    let velocity = parts[part].arc.velocity(parts[part].theta_end);
                    here = Some(Here { place, velocity });
                }
                Step::Connect(part) => {
                    self.ask_along(sound, parts, part, here);
                }
                Step::Scatter(direction) => self.turns.extend(here.map(|here| Turn {
                    place: here.place,
                    change: here.velocity - here.velocity.length() * direction,
                })),
            }
        }
        here
    }

    fn clear(&mut self) {
        self.places.clear();
        self.amplitudes.clear();
        self.inner.clear();
        self.values.clear();
        self.parts.clear();
        self.turns.clear();
    }

    /// Takes note of where the sound is wanted along a part. Returns the number of the place where it ends.
    fn ask_along(
        &mut self,
        sound: &Modulation,
        parts: &[RayPart],
        part: usize,
        here: Option<Here>,
    ) -> usize {
        let (arc, range) = (&parts[part].arc, [0.0, parts[part].theta_end]);
        let ends = [arc.start(), arc.position(range[1])].map(|x| self.place(x, here));
        let quadrature = sound.quadrature(arc, range);
        if let Some(quadrature) = quadrature {
            // All, and what is too much taken back: a branch on the number would be mispredicted.
            let (places, count) = quadrature.places(arc, range);
            let (known, first) = (self.inner.len(), MOST_PLACES * self.parts.len());
            self.inner.extend((first..).zip(places));
            self.inner.truncate(known + count);
        }
        self.parts.push(PartOfWay {
            part,
            ends,
            quadrature,
        });
        ends[1]
    }

    /// The number of a place, which is known where the way has come to.
    fn place(&mut self, x: DVec3, here: Option<Here>) -> usize {
        match here {
            Some(here) if self.places[here.place] == x => here.place,
            _ => {
                self.places.push(x);
                self.places.len() - 1
            }
        }
    }

    /// Adds what the sound does along the steps that were followed last, one by one: the sum has the same bits however many are followed at once.
    pub(super) fn add_to(
        &self,
        modulation: &mut PathModulation,
        sound: &Modulation,
        parts: &[RayPart],
    ) {
        for (asked, values) in self.parts.iter().zip(&self.values) {
            let part = &parts[asked.part];
            let (arc, range) = (&part.arc, [0.0, part.theta_end]);
            let ends = asked.ends.map(|place| &self.amplitudes[place]);
            modulation.index += match asked.quadrature {
                Some(by) => sound.along_by(by, arc, range, ends, values),
                None => sound.along(arc, range, &ends.map(|end| *end)),
            };
        }
        for turn in &self.turns {
            let amplitude = &self.amplitudes[turn.place];
            let [re, im] = sound.displacement(self.places[turn.place], amplitude);
            modulation.displacement += DVec2::new(turn.change.dot(re), turn.change.dot(im));
        }
    }
}
