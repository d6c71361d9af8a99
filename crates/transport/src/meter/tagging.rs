//! What sound does to the optical lengths of particles' ways (docs/theory.md#tagged-light).

use super::flight::Flight;
use crate::scene::MediumId;
use crate::tagging::{PathModulation, SoundInMedia, TaggedPath};
use eikonal::ModulationPanel;
use eikonal::ray::Arc;
use glam::{DVec2, DVec3};

/// The modulations of a particle and of its copies that wait to be followed, one after the other.
#[derive(Clone, Debug)]
pub(super) struct Tagging {
    sound: SoundInMedia,
    waiting: Vec<TaggedPath>,
    current: TaggedPath,
    /// Whether that along flights is wanted, not at their ends alone.
    tabulates: bool,
    /// That before the last flight, and along it.
    before: DVec2,
    panels: Vec<ModulationPanel>,
}

impl Tagging {
    /// `tabulates` says whether [`Tagging::until`] will be asked for.
    pub(super) fn new(sound: SoundInMedia, tabulates: bool) -> Self {
        Tagging {
            sound,
            tabulates,
            waiting: Vec::new(),
            current: TaggedPath::default(),
            before: DVec2::ZERO,
            panels: Vec::new(),
        }
    }

    /// A particle starts.
    pub(super) fn start(&mut self) {
        self.waiting.clear();
        self.waiting.push(TaggedPath::default());
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
        self.current.modulation()
    }

    /// That of its way up to a θ of its last flight.
    pub(super) fn until(&self, theta: f64) -> DVec2 {
        let panel = self.panels.partition_point(|panel| panel.end() < theta);
        let last = self.panels.len().saturating_sub(1);
        match self.panels.get(panel.min(last)) {
            Some(panel) => self.before + panel.until(theta),
            // Without sound it is what it was, and not a number where the sound is too fine.
            None => self.path().total(),
        }
    }

    /// The particle flies.
    pub(super) fn fly(&mut self, flight: &Flight) {
        self.follow(flight.span.medium, &flight.span.arc, flight.theta_end);
    }

    /// The particle flies along an arc up to θ.
    pub(super) fn follow(&mut self, medium: MediumId, arc: &Arc, theta: f64) {
        let (sound, path) = (&self.sound, &mut self.current);
        if self.tabulates {
            self.before = path.modulation().total();
            path.fly_tabulated(sound, medium, arc, theta, &mut self.panels);
        } else {
            path.fly(sound, medium, arc, theta);
        }
    }

    /// The particle is scattered at the end of its last flight, into a direction.
    pub(super) fn scatter(&mut self, direction: DVec3) {
        self.current.scatter(&self.sound, direction);
    }
}
