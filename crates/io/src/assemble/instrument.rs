//! Meters with the processing of their readings.

use crate::diagnostic::lints;
use transport::Scene;
use transport::meter::{Coordinates, Estimator, Meter};
use transport::scene::{SceneProblem, Subject};

/// Maximum number of cells whose centres are tested for an attenuating medium.
const PROBES: usize = 1 << 12;

/// Normalisation of readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normalization {
    /// Power in W, or energy in J for pulses, in the units of the emitters.
    Absolute,
    /// Readings divided by the power (or the energy) of all emitters, channel by channel.
    PerWatt,
}

/// Parameters that convert absorbed power to the initial pressure after a short pulse.
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
    /// Returns the factor that converts absorbed power, divided by the power of all emitters, to
    /// pressure in Pa.
    pub fn factor(&self) -> f64 {
        self.parameter * self.pulse_energy / self.metres_per_unit.powi(3)
    }
}

/// Meter with the processing of its readings.
#[derive(Clone, Debug)]
pub struct Instrument {
    /// Unique name: the id of the meter, or its type.
    pub name: String,
    /// Meter in the scene.
    pub meter: Meter,
    /// Normalisation of the readings.
    pub normalization: Normalization,
    /// Parameters of initial pressures, if these are requested.
    pub gruneisen: Option<Gruneisen>,
    /// Length of a scene unit in m, if the scene states it.
    pub metres_per_unit: Option<f64>,
}

impl Instrument {
    /// Number of the reading to which initial pressures are proportional: absorbed power.
    pub const ABSORBED: usize = 1;

    /// Returns true if the cells of the meter lie on a grid over x, y and z.
    pub fn has_grid(&self) -> bool {
        matches!(&self.meter, Meter::Fluence(meter) if meter.grid.coordinates() == Coordinates::Cartesian)
    }

    /// Returns a warning about cells in which the meter cannot score, because no medium attenuates
    /// light there.
    pub(super) fn warning(&self, scene: &Scene) -> Option<SceneProblem> {
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
