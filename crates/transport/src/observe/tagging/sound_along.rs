//! Sound along the steps of a path within one medium. Three passes collect all positions, compute
//! all amplitudes, and form the sums. The processor thus works on several positions at a time.
//!
//! Theory: docs/theory.md#tagged-light.

use super::path::{Last, PathModulation, displacement, turn};
use super::steps::Step;
use crate::path::RayPart;
use eikonal::ModulationQuadrature;
use eikonal::field::{Modulation, SoundAmplitude};
use glam::{DVec2, DVec3};

const MAX_PLACES: usize = ModulationQuadrature::MAX_PLACES;

/// Storage for positions, and for the sound at them.
#[derive(Clone, Debug, Default)]
pub(crate) struct SoundAlong {
    /// Positions whose amplitudes are needed.
    places: Vec<DVec3>,
    amplitudes: Vec<SoundAmplitude>,
    /// Positions at which only values are needed, with the indices of the values.
    inner: Vec<(usize, DVec3)>,
    /// Values of each part, padded with zeros.
    values: Vec<[DVec2; MAX_PLACES]>,
    parts: Vec<RequestedPart>,
    turns: Vec<Turn>,
}

/// Quadrature of the modulation along a part.
#[derive(Clone, Debug)]
struct RequestedPart {
    /// Index of the part.
    part: usize,
    /// Indices of the positions at which the part starts and ends.
    ends: [usize; 2],
    /// Quadrature; `None` if the part is long.
    quadrature: Option<ModulationQuadrature>,
}

/// Scattering at a position.
#[derive(Clone, Copy, Debug)]
struct Turn {
    place: usize,
    /// Change of direction: see [`turn`].
    turn: DVec3,
}

/// Current end of a path: the index of its position, and index of refraction times the unit
/// direction.
#[derive(Clone, Copy)]
struct PathEnd {
    place: usize,
    velocity: DVec3,
}

impl SoundAlong {
    /// Computes the sound along steps. `start` is the current end of the path, if it has been in
    /// this medium. Returns the new end.
    pub(super) fn follow(
        &mut self,
        sound: &Modulation,
        start: Option<Last>,
        parts: &[RayPart],
        steps: &[Step],
    ) -> Option<Last> {
        let here = self.request(sound, start, parts, steps);
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

    /// Collects the positions along steps at which the sound is needed. Returns the new end.
    fn request(
        &mut self,
        sound: &Modulation,
        start: Option<Last>,
        parts: &[RayPart],
        steps: &[Step],
    ) -> Option<PathEnd> {
        self.clear();
        let mut here = None;
        if let Some(last) = start {
            self.places.push(last.x);
            self.amplitudes.push(last.amplitude);
            let velocity = last.velocity;
            here = Some(PathEnd { place: 0, velocity });
        }
        for step in steps {
            match *step {
                Step::Fly(part) => {
                    let place = self.request_along(sound, parts, part, here);
                    // Planted error "displacement of scatterers without the index", found by morgana-transport/transport::meters::tagged::correlations_are_those_of_frozen_instants:
                    // let velocity = parts[part].arc.velocity(parts[part].theta_end).normalize();
                    let velocity = parts[part].arc.velocity(parts[part].theta_end);
                    here = Some(PathEnd { place, velocity });
                }
                Step::Connect(part) => {
                    self.request_along(sound, parts, part, here);
                }
                Step::Scatter(direction) => self.turns.extend(here.map(|here| Turn {
                    place: here.place,
                    turn: turn(here.velocity, direction),
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

    /// Collects the positions along a part at which the sound is needed. Returns the index of the
    /// position where the part ends.
    fn request_along(
        &mut self,
        sound: &Modulation,
        parts: &[RayPart],
        part: usize,
        here: Option<PathEnd>,
    ) -> usize {
        let (arc, range) = (&parts[part].arc, [0.0, parts[part].theta_end]);
        let ends = [arc.start(), arc.position(range[1])].map(|x| self.place(x, here));
        let quadrature = sound.quadrature(arc, range);
        if let Some(quadrature) = quadrature {
            // Add all positions, then truncate: a branch on the count would be mispredicted.
            let (places, count) = quadrature.places(arc, range);
            // Planted error "values of the sound along all parts of a way given to the first", found by morgana-transport/transport::meters::sidebands::records_do_not_depend_on_what_else_is_asked:
            // let (known, first) = (self.inner.len(), 0 * self.parts.len());
            let (known, first) = (self.inner.len(), MAX_PLACES * self.parts.len());
            self.inner.extend((first..).zip(places));
            self.inner.truncate(known + count);
        }
        self.parts.push(RequestedPart {
            part,
            ends,
            quadrature,
        });
        ends[1]
    }

    /// Returns the index of a position, which may be the path's current end or the last position.
    fn place(&mut self, x: DVec3, here: Option<PathEnd>) -> usize {
        let last = self.places.len().checked_sub(1);
        let known = here.map(|here| here.place).into_iter().chain(last);
        let known = known.into_iter().find(|place| self.places[*place] == x);
        known.unwrap_or_else(|| {
            self.places.push(x);
            self.places.len() - 1
        })
    }

    /// Adds the modulation along the steps that were followed last, one by one: the sum has the
    /// same bits for any number of steps that are followed at once.
    pub(super) fn add_to(
        &self,
        modulation: &mut PathModulation,
        sound: &Modulation,
        parts: &[RayPart],
    ) {
        for (request, values) in self.parts.iter().zip(&self.values) {
            let part = &parts[request.part];
            let (arc, range) = (&part.arc, [0.0, part.theta_end]);
            let ends = request.ends.map(|place| &self.amplitudes[place]);
            modulation.index += match request.quadrature {
                Some(by) => sound.along_by(by, arc, range, ends, values),
                None => sound.along(arc, range, &ends.map(|end| *end)),
            };
        }
        for turn in &self.turns {
            let (x, amplitude) = (self.places[turn.place], &self.amplitudes[turn.place]);
            modulation.displacement += displacement(sound, x, amplitude, turn.turn);
        }
    }
}
