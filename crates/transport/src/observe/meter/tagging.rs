//! Effect of sound on the optical lengths of particles' paths (docs/theory.md#tagged-light).

use super::copies::Copies;
use super::flight::Flight;
use super::{Estimator, Meter};
use crate::path::RayPart;
use crate::scene::MediumId;
use crate::tagging::{PathModulation, SoundAlong, SoundInMedia, Step, TaggedPath};
use eikonal::ModulationPanel;
use eikonal::ray::Arc;
use glam::{DVec2, DVec3};

/// Maximum number of recorded steps, to limit memory.
const MAX_STEPS: usize = 1000;

/// Points at which meters need modulations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RequestedModulations {
    /// Surfaces, which particles may never reach.
    OnArrival,
    /// Ends of flights.
    AtEnds,
    /// All points along flights.
    Along,
}

impl RequestedModulations {
    /// Returns the points that any of these meters needs.
    pub(super) fn by(meters: &[Meter]) -> Self {
        let fluence = |meter: &Meter| match meter {
            Meter::Fluence(meter) if meter.sidebands.is_some() => Some(meter.estimator),
            _ => None,
        };
        let estimators = || meters.iter().filter_map(fluence);
        if estimators().any(|estimator| estimator == Estimator::TrackLength) {
            RequestedModulations::Along
        } else if estimators().next().is_some() {
            RequestedModulations::AtEnds
        } else {
            RequestedModulations::OnArrival
        }
    }
}

/// Modulations of a particle and of its waiting copies, which are followed one after the other.
#[derive(Clone, Debug)]
pub(super) struct Tagging {
    sound: SoundInMedia,
    copies: Copies<TaggedPath>,
    requested: RequestedModulations,
    /// Steps of the current particle since its modulation was last computed.
    steps: Vec<Step>,
    parts: Vec<RayPart>,
    along: SoundAlong,
    /// Modulation before the last flight; `panels` hold the modulation along it.
    before: DVec2,
    panels: Vec<ModulationPanel>,
}

impl Tagging {
    pub(super) fn new(sound: SoundInMedia, requested: RequestedModulations) -> Self {
        Tagging {
            sound,
            requested,
            steps: Vec::new(),
            parts: Vec::new(),
            along: SoundAlong::default(),
            copies: Copies::new(TaggedPath::default()),
            before: DVec2::ZERO,
            panels: Vec::new(),
        }
    }

    /// Starts a particle.
    pub(super) fn start(&mut self) {
        self.copies.start(|path| *path = TaggedPath::default());
        self.clear();
    }

    /// Continues with the next copy, along its next edge.
    pub(super) fn resume(&mut self) {
        if !self.copies.resume() {
            self.clear();
        }
    }

    /// Divides the particle into `copies` copies; 0 ends it.
    pub(super) fn continue_walk(&mut self, copies: usize) {
        // Planted error "copies of tagged particles that forget their way" (3 lines), found by morgana-transport/transport::meters::sidebands::records_do_not_depend_on_what_else_is_asked:
        // (no line)
        if copies > 1 {
            self.arrive();
        }
        self.copies.continue_walk(copies);
    }

    /// Returns the modulation of the particle's path so far. It is up to date at ends of flights,
    /// unless only [arrivals](RequestedModulations::OnArrival) need it.
    pub(super) fn path(&self) -> PathModulation {
        self.copies.current.modulation()
    }

    /// Computes and returns the modulation up to the current end of the path, even if no meter
    /// needs it yet.
    pub(super) fn arrive(&mut self) -> PathModulation {
        let (steps, along) = (&self.steps, &mut self.along);
        self.copies
            .current
            .go(&self.sound, &self.parts, steps, along);
        self.clear();
        self.path()
    }

    fn clear(&mut self) {
        self.steps.clear();
        self.parts.clear();
    }

    /// Returns the modulation of the path up to θ of its last flight.
    pub(super) fn until(&self, theta: f64) -> DVec2 {
        let panel = self.panels.partition_point(|panel| panel.end() < theta);
        let last = self.panels.len().saturating_sub(1);
        match self.panels.get(panel.min(last)) {
            Some(panel) => self.before + panel.until(theta),
            // Without sound the modulation is unchanged; it is NaN where the sound is too fine.
            None => self.path().total(),
        }
    }

    /// Adds a flight.
    pub(super) fn fly(&mut self, flight: &Flight) {
        self.follow(flight.span.medium, &flight.span.arc, flight.theta_end);
    }

    /// Adds a flight along an arc up to θ.
    pub(super) fn follow(&mut self, medium: MediumId, arc: &Arc, theta_end: f64) {
        match self.requested {
            RequestedModulations::OnArrival => {
                self.step(Step::Fly);
                self.parts.push(RayPart {
                    arc: *arc,
                    theta_end,
                    medium,
                });
            }
            RequestedModulations::AtEnds => {
                self.copies.current.fly(&self.sound, medium, arc, theta_end)
            }
            RequestedModulations::Along => {
                let (sound, path) = (&self.sound, &mut self.copies.current);
                // Planted error "phases of tagged fluence of the last flight alone", found by morgana-transport/transport::meters::sidebands::track_lengths_and_collisions_find_the_same_sidebands:
                // self.before = DVec2::ZERO;
                self.before = path.modulation().total();
                path.fly_tabulated(sound, medium, arc, theta_end, &mut self.panels);
            }
        }
    }

    /// Adds a scattering at the end of the last flight, into a direction.
    pub(super) fn scatter(&mut self, direction: DVec3) {
        match self.requested {
            RequestedModulations::OnArrival => self.step(|_| Step::Scatter(direction)),
            RequestedModulations::AtEnds | RequestedModulations::Along => {
                self.copies.current.scatter(&self.sound, direction)
            }
        }
    }

    /// Records a step; `step` receives the index of the next part.
    fn step(&mut self, step: impl FnOnce(usize) -> Step) {
        if self.steps.len() == MAX_STEPS {
            self.arrive();
        }
        self.steps.push(step(self.parts.len()));
    }
}
