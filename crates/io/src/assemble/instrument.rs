//! A meter with what becomes of its readings.

use crate::diagnostic::lints;
use transport::Scene;
use transport::meter::{Estimator, Meter};
use transport::scene::{SceneProblem, Subject};

/// Most cells at whose middles a meter's surroundings are probed.
const PROBES: usize = 1 << 12;

/// What readings are given in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normalization {
    /// As the emitters are: W, or J for pulses.
    Absolute,
    /// Divided by the power of all emitters (or their energy), channel by channel.
    PerWatt,
}

/// What turns absorbed power into the pressure that a short pulse starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gruneisen {
    /// Grüneisen parameter Γ ≥ 0.
    pub parameter: f64,
    /// Energy of the pulse in J.
    pub pulse_energy: f64,
    /// Length of a scene unit in m.
    pub metres_per_unit: f64,
}

impl Gruneisen {
    /// What absorbed power is multiplied by, over the power of all emitters, for the pressure in Pa.
    pub fn factor(&self) -> f64 {
        self.parameter * self.pulse_energy / self.metres_per_unit.powi(3)
    }
}

/// A meter, and what becomes of its readings.
#[derive(Clone, Debug)]
pub struct Instrument {
    /// Its id, or else its type; distinct.
    pub name: String,
    /// What measures.
    pub meter: Meter,
    /// What readings are given in.
    pub normalization: Normalization,
    /// For initial pressures.
    pub gruneisen: Option<Gruneisen>,
}

impl Instrument {
    /// The number of the meter's reading that initial pressures are in proportion to: absorbed power.
    pub const ABSORBED: usize = 1;

    /// What is doubtful about it in a scene: cells where it can find nothing.
    pub(super) fn doubt(&self, scene: &Scene) -> Option<SceneProblem> {
        let Meter::Fluence(meter) = &self.meter else {
            return None;
        };
        let cells = meter.grid.cells();
        let step = cells.div_ceil(PROBES);
        let clear = |cell: &usize| {
            let medium = scene.medium_at(meter.grid.middle(*cell));
            scene.medium(medium).is_transparent()
        };
        let probes = (0..cells).step_by(step);
        let (all, clear) = (probes.len(), probes.filter(clear).count());
        let share = 100.0 * clear as f64 / all as f64;
        let (message, help) = match meter.estimator {
            _ if clear == all => (
                "lies where no medium attenuates light: nothing is absorbed there".to_owned(),
                "check the meter's to_world, which maps the unit cube [0, 1]³ to its place",
            ),
            Estimator::Collision if clear > 0 => (
                format!(
                    "has {share:.0}% of its cells where no medium attenuates light: without collisions \
                         its estimator finds none there"
                ),
                "use the estimator track_length, or a smaller meter",
            ),
            _ => return None,
        };
        Some(SceneProblem::warning(
            lints::METER_IN_THE_CLEAR,
            Subject::Sensor,
            format!("the meter '{}' {message}", self.name),
            help,
        ))
    }
}
