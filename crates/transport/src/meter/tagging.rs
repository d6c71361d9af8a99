//! What sound does to the optical length of particles' ways, to first order: it changes the index along them, and moves what scatters them
//! (docs/theory.md#tagged-light).

use super::flight::Flight;
use crate::scene::{MediumId, Scene};
use eikonal::field::{Modulation, SoundAmplitude};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// The amplitudes of the optical length of a way, as complex numbers: it changes by the real part of amplitude times e^{iωt}.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PathModulation {
    /// By the index along edges: ∫ n̂ ds.
    pub index: DVec2,
    /// By the displacement û of what scatters from ω into ω': Σ n (ω − ω')·û.
    pub displacement: DVec2,
}

/// The sound in the media of a scene.
#[derive(Clone, Debug)]
pub(super) struct SoundInMedia(Arc<[Option<Modulation>]>);

impl SoundInMedia {
    pub(super) fn of(scene: &Scene) -> Self {
        let media = scene.media().iter();
        SoundInMedia(media.map(|medium| Modulation::of(&medium.index)).collect())
    }
}

/// The modulations of a particle and of its copies that wait to be followed, one after the other.
#[derive(Clone, Debug)]
pub(super) struct Tagging {
    sound: SoundInMedia,
    waiting: Vec<Tagged>,
    current: Tagged,
}

#[derive(Clone, Copy, Debug, Default)]
struct Tagged {
    path: PathModulation,
    last: Option<Last>,
}

/// The amplitude where a particle was last.
#[derive(Clone, Copy, Debug)]
struct Last {
    medium: MediumId,
    x: DVec3,
    amplitude: SoundAmplitude,
}

impl Tagging {
    pub(super) fn new(sound: SoundInMedia) -> Self {
        Tagging {
            sound,
            waiting: Vec::new(),
            current: Tagged::default(),
        }
    }

    /// A particle starts.
    pub(super) fn start(&mut self) {
        self.waiting.clear();
        self.waiting.push(Tagged::default());
    }

    /// The copy that was put aside last takes its next edge.
    pub(super) fn resume(&mut self) {
        self.current = self.waiting.pop().unwrap_or_default();
    }

    /// The walk goes on in so many copies.
    pub(super) fn go_on(&mut self, copies: usize) {
        self.waiting.extend((0..copies).map(|_| self.current));
    }

    /// That of the particle's way so far.
    pub(super) fn path(&self) -> PathModulation {
        self.current.path
    }

    /// The particle flies.
    pub(super) fn fly(&mut self, flight: &Flight) {
        let (arc, medium) = (&flight.span.arc, flight.span.medium);
        let Some(sound) = &self.sound.0[medium] else {
            return;
        };
        let x = arc.start();
        let last = self.current.last;
        let known = last.filter(|last| last.medium == medium && last.x == x);
        let start = known.map_or_else(|| sound.at(x), |last| last.amplitude);
        let x = arc.position(flight.theta_end);
        let amplitude = sound.at(x);
        self.current.path.index += sound.along(arc, [0.0, flight.theta_end], &[start, amplitude]);
        self.current.last = Some(Last {
            medium,
            x,
            amplitude,
        });
    }

    /// The particle is scattered at the end of its last flight, into a direction.
    pub(super) fn scatter(&mut self, flight: &Flight, direction: DVec3) {
        let here = |last: &Last| last.medium == flight.span.medium;
        if let Some(last) = self.current.last.filter(here) {
            let n = flight.span.arc.velocity(flight.theta_end);
            let turn = n - n.length() * direction;
            let [re, im] = last.amplitude.displacement;
            self.current.path.displacement += DVec2::new(turn.dot(re), turn.dot(im));
        }
    }
}
