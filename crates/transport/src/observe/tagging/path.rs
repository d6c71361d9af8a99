//! Effect of sound on the optical length of a path, to first order: sound changes the index along
//! the path, and moves the scatterers (docs/theory.md#tagged-light).

use crate::scene::{MediumId, Scene};
use eikonal::ModulationPanel;
use eikonal::field::{Modulation, SoundAmplitude};
use eikonal::ray::Arc;
use glam::{DVec2, DVec3};

/// Complex amplitudes of the optical length of a path, which changes by the real part of amplitude
/// times e^{iωt}.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PathModulation {
    /// Amplitude from the index along edges: ∫ n̂ ds.
    pub index: DVec2,
    /// Amplitude from the displacement û of scatterers that scatter from ω into ω': Σ n (ω − ω')·û.
    pub displacement: DVec2,
}

impl PathModulation {
    /// Returns the sum of the two amplitudes.
    pub(crate) fn total(&self) -> DVec2 {
        self.index + self.displacement
    }
}

/// Sound in the media of a scene.
#[derive(Clone, Debug)]
pub(crate) struct SoundInMedia(pub(super) std::sync::Arc<[Option<Modulation>]>);

impl SoundInMedia {
    pub(crate) fn of(scene: &Scene) -> Self {
        let media = scene.media().iter();
        SoundInMedia(media.map(|medium| Modulation::of(&medium.index)).collect())
    }

    /// Returns the sound in a medium.
    pub(super) fn within(&self, medium: MediumId) -> Option<&Modulation> {
        self.0[medium].as_ref()
    }

    /// Returns true if a medium has sound.
    pub(crate) fn is_in(&self, medium: MediumId) -> bool {
        self.0[medium].is_some()
    }
}

/// Modulation of a path that is being followed, from either end.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TaggedPath {
    pub(super) modulation: PathModulation,
    /// Current end, if it is in a medium with sound.
    pub(super) last: Option<(MediumId, Last)>,
}

/// Current end of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Last {
    pub x: DVec3,
    /// Index times the unit direction.
    pub velocity: DVec3,
    pub amplitude: SoundAmplitude,
}

impl TaggedPath {
    /// Returns the modulation of the path so far.
    pub(crate) fn modulation(&self) -> PathModulation {
        self.modulation
    }

    /// Extends the path along an arc up to θ.
    pub(crate) fn fly(&mut self, sound: &SoundInMedia, medium: MediumId, arc: &Arc, theta: f64) {
        self.advance(sound, medium, arc, theta, |sound, ends| {
            sound.along(arc, [0.0, theta], ends)
        });
    }

    /// Extends the path along an arc up to θ. Also returns the panels of the arc in `panels`, which
    /// is empty where there is no sound.
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

    /// Extends the path along an arc up to θ. `along` computes the modulation from the amplitudes
    /// at the arc's ends.
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

    /// Returns the current end, if it is in this medium.
    pub(super) fn last_in(&self, medium: MediumId) -> Option<Last> {
        let within = self.last.filter(|(of, _)| *of == medium);
        within.map(|(_, last)| last)
    }

    /// Scatters light at the current end into a direction.
    pub(crate) fn scatter(&mut self, sound: &SoundInMedia, direction: DVec3) {
        if let Some((medium, last)) = &self.last
            && let Some(sound) = &sound.0[*medium]
        {
            let turn = turn(last.velocity, direction);
            self.modulation.displacement += displacement(sound, last.x, &last.amplitude, turn);
        }
    }
}

/// Returns n (ω − ω′) of a scattering; `velocity` is n ω, `direction` is ω′.
pub(super) fn turn(velocity: DVec3, direction: DVec3) -> DVec3 {
    // Planted error "scatterers moved against the light's direction", found by morgana-transport/transport::meters::tagged::modulations_are_those_of_optical_lengths_at_instants:
    // velocity + velocity.length() * direction
    velocity - velocity.length() * direction
}

/// Returns the amplitude from the displacement of a scatterer, given the sound's amplitude at its
/// position.
pub(super) fn displacement(
    sound: &Modulation,
    x: DVec3,
    amplitude: &SoundAmplitude,
    turn: DVec3,
) -> DVec2 {
    let [re, im] = sound.displacement(x, amplitude);
    DVec2::new(turn.dot(re), turn.dot(im))
}
