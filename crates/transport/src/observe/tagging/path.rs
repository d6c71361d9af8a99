//! What sound does to the optical length of a way, to first order: it changes the index along it, and moves what scatters light
//! (docs/theory.md#tagged-light).

use crate::scene::{MediumId, Scene};
use eikonal::ModulationPanel;
use eikonal::field::{Modulation, SoundAmplitude};
use eikonal::ray::Arc;
use glam::{DVec2, DVec3};

/// The amplitudes of the optical length of a way, as complex numbers: it changes by the real part of amplitude times e^{iωt}.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PathModulation {
    /// By the index along edges: ∫ n̂ ds.
    pub index: DVec2,
    /// By the displacement û of what scatters from ω into ω': Σ n (ω − ω')·û.
    pub displacement: DVec2,
}

impl PathModulation {
    /// By both.
    pub(crate) fn total(&self) -> DVec2 {
        self.index + self.displacement
    }
}

/// The sound in the media of a scene.
#[derive(Clone, Debug)]
pub(crate) struct SoundInMedia(pub(super) std::sync::Arc<[Option<Modulation>]>);

impl SoundInMedia {
    pub(crate) fn of(scene: &Scene) -> Self {
        let media = scene.media().iter();
        SoundInMedia(media.map(|medium| Modulation::of(&medium.index)).collect())
    }

    /// That in a medium.
    pub(super) fn within(&self, medium: MediumId) -> Option<&Modulation> {
        self.0[medium].as_ref()
    }

    /// Whether there is any in a medium.
    pub(crate) fn is_in(&self, medium: MediumId) -> bool {
        self.0[medium].is_some()
    }
}

/// A way as it is followed, from either end.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TaggedPath {
    pub(super) modulation: PathModulation,
    /// Where it has come to in a medium with sound.
    pub(super) last: Option<(MediumId, Last)>,
}

/// Where a way has come to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Last {
    pub x: DVec3,
    /// Index times the unit direction.
    pub velocity: DVec3,
    pub amplitude: SoundAmplitude,
}

impl TaggedPath {
    /// That of the way so far.
    pub(crate) fn modulation(&self) -> PathModulation {
        self.modulation
    }

    /// On along an arc up to θ.
    pub(crate) fn fly(&mut self, sound: &SoundInMedia, medium: MediumId, arc: &Arc, theta: f64) {
        self.advance(sound, medium, arc, theta, |sound, ends| {
            sound.along(arc, [0.0, theta], ends)
        });
    }

    /// The same, and the panels of the arc, which are empty where there is no sound.
    pub(crate) fn fly_tabulated(
        &mut self,
        sound: &SoundInMedia,
        medium: MediumId,
        arc: &Arc,
        theta: f64,
        panels: &mut Vec<ModulationPanel>,
    ) {
        panels.clear();
        self.advance(sound, medium, arc, theta, |sound, ends| {
            sound.tabulate(arc, [0.0, theta], ends, |panel| panels.push(panel))
        });
    }

    /// On along an arc up to θ, whose modulation is found given the amplitudes at its ends.
    fn advance(
        &mut self,
        sound: &SoundInMedia,
        medium: MediumId,
        arc: &Arc,
        theta: f64,
        along: impl FnOnce(&Modulation, &[SoundAmplitude; 2]) -> DVec2,
    ) {
        let Some(sound) = &sound.0[medium] else {
            self.last = None;
            return;
        };
        let known = self.last_in(medium);
        let known = known.filter(|last| last.x == arc.start());
        let start = known.map_or_else(|| sound.at(arc.start()), |last| last.amplitude);
        let x = arc.position(theta);
        let amplitude = sound.at(x);
        self.modulation.index += along(sound, &[start, amplitude]);
        let velocity = arc.velocity(theta);
        let last = Last {
            x,
            velocity,
            amplitude,
        };
        self.last = Some((medium, last));
    }

    /// Where it has come to, if that is in this medium.
    pub(super) fn last_in(&self, medium: MediumId) -> Option<Last> {
        let within = self.last.filter(|(of, _)| *of == medium);
        within.map(|(_, last)| last)
    }

    /// Light is scattered where the way has come to, and goes on in a direction.
    pub(crate) fn scatter(&mut self, sound: &SoundInMedia, direction: DVec3) {
        if let Some((medium, last)) = &self.last
            && let Some(sound) = &sound.0[*medium]
        {
            let turn = turn(last.velocity, direction);
            self.modulation.displacement += displacement(sound, last.x, &last.amplitude, turn);
        }
    }
}

/// n (ω − ω′) of scattering from index times direction into a direction.
pub(super) fn turn(velocity: DVec3, direction: DVec3) -> DVec3 {
    // Planted error "scatterers moved against the light's direction", found by morgana-transport/transport::meters::tagged::modulations_are_those_of_optical_lengths_at_instants:
    // velocity + velocity.length() * direction
    velocity - velocity.length() * direction
}

/// What the displacement of what scatters at a place adds, given the amplitude there.
pub(super) fn displacement(
    sound: &Modulation,
    x: DVec3,
    amplitude: &SoundAmplitude,
    turn: DVec3,
) -> DVec2 {
    let [re, im] = sound.displacement(x, amplitude);
    DVec2::new(turn.dot(re), turn.dot(im))
}
