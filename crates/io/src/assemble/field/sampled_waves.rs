//! Check of samples of sound: their wavelength must agree with frequency and speed, and their
//! spacing must resolve the wave.

use super::super::sound_record::SoundRecord;
use crate::diagnostic::{Diagnostic, lints};
use glam::DVec3;
use std::f64::consts::TAU;

/// Maximum ratio of measured and expected squared wave numbers. A larger ratio is a mistake: wrong
/// units, a coarse grid, or noise.
const MAX_RATIO: f64 = 1.6;
/// Approximate maximum number of samples that are examined.
const MAX_EXAMINED: usize = 1_000_000;
/// Minimum number of samples per wavelength that show the change of pressure between samples.
const MIN_SAMPLES_PER_WAVELENGTH: f64 = 3.0;

/// Minimum number of examined samples with neighbours on all sides for a result.
const MIN_EXAMINED: usize = 8;

/// Returns a warning about complex amplitudes of sound whose waves do not fit the given wavelength.
/// In `pressure` x varies fastest.
pub(super) fn warning(
    pressure: &[[f64; 2]],
    record: &SoundRecord,
    wavelength: f64,
) -> Option<Diagnostic> {
    let axes = Axis::of(record.size, record.spacing());
    let found = squared_wave_number(pressure, &axes)?;
    let expected = (TAU / wavelength).powi(2);
    if (1.0 / MAX_RATIO..MAX_RATIO).contains(&(found / expected)) {
        return None;
    }
    let found = match TAU / found.sqrt() {
        length if length.is_finite() => format!("of a length of {length:.2e}"),
        _ => "of no length".to_owned(),
    };
    let message = format!(
        "the samples are of waves {found}, but by 'frequency' and 'sound_speed' the sound has a wavelength of {wavelength:.2e} (scene units)"
    );
    let coarsest = axes.iter().map(|axis| axis.spacing).fold(0.0, f64::max);
    let help = if coarsest * MIN_SAMPLES_PER_WAVELENGTH > wavelength {
        format!(
            "phases of light need {MIN_SAMPLES_PER_WAVELENGTH} samples or more to a wavelength where pressure varies: there are {:.2}",
            wavelength / coarsest
        )
    } else {
        "check the units of both, and 'to_world': the displacement of what scatters light depends on them".to_owned()
    };
    Some(lints::warning(lints::SOUND_SAMPLES, message).help(help))
}

/// Axis of a grid along which samples have two neighbours.
struct Axis {
    count: usize,
    /// Distance in the array from a sample to the next along this axis.
    step: usize,
    spacing: f64,
}

impl Axis {
    /// Returns the axes along which a grid has more than two samples.
    fn of(size: [usize; 3], spacing: DVec3) -> Vec<Self> {
        let steps = [1, size[0], size[0] * size[1]];
        let axes = (0..3).filter(|axis| size[*axis] > 2).map(|axis| Axis {
            count: size[axis],
            step: steps[axis],
            spacing: spacing[axis],
        });
        axes.collect()
    }

    /// Returns true if a sample has two neighbours along this axis.
    fn is_inner(&self, sample: usize) -> bool {
        (1..self.count - 1).contains(&(sample / self.step % self.count))
    }
}

/// Returns k² of waves P by Helmholtz's equation, −Re Σ P* ∇²P over Σ |P|², with second
/// differences. `None` if too few samples with pressure have neighbours.
fn squared_wave_number(pressure: &[[f64; 2]], axes: &[Axis]) -> Option<f64> {
    // Make the stride odd, so that it visits all columns of even grids.
    let stride = (pressure.len() / MAX_EXAMINED) | 1;
    let inner = |i: &usize| !axes.is_empty() && axes.iter().all(|axis| axis.is_inner(*i));
    let (mut bending, mut power, mut count) = (0.0, 0.0, 0);
    for i in (0..pressure.len()).step_by(stride).filter(inner) {
        count += 1;
        power += pressure[i].iter().map(|part| part * part).sum::<f64>();
        for axis in axes {
            for (part, own) in pressure[i].iter().enumerate() {
                let others = pressure[i - axis.step][part] + pressure[i + axis.step][part];
                bending += own * (2.0 * own - others) / axis.spacing.powi(2);
            }
        }
    }
    let is_known = count >= MIN_EXAMINED && power > 0.0 && bending.is_finite();
    is_known.then(|| bending / power)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests waves along and across a grid, travelling and standing, and on a grid that is small
    /// compared to the wavelength.
    #[test]
    fn waves_have_their_wave_number() {
        let size = [12, 9, 10];
        let spacing = DVec3::new(0.1, 0.08, 0.12);
        for k in [
            DVec3::new(5.0, 0.0, 0.0),
            DVec3::new(1.0, -3.0, 2.0),
            0.1 * DVec3::ONE,
        ] {
            for standing in [false, true] {
                let at = |i: usize| {
                    let place = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
                    let phase = k.dot(spacing * DVec3::from_array(place.map(|n| n as f64)));
                    [phase.cos(), if standing { 0.0 } else { phase.sin() }]
                };
                let pressure: Vec<_> = (0..size.iter().product()).map(at).collect();
                let found = squared_wave_number(&pressure, &Axis::of(size, spacing)).unwrap();
                let expected = k.length_squared();
                assert!((found / expected - 1.0).abs() < 0.03, "{k}: {found}");
            }
        }
        for (pressure, side) in [(1.0, 2), (1.0, 3), (0.0, 4)] {
            let axes = Axis::of([side; 3], spacing);
            let pressure = vec![[pressure, 0.0]; side.pow(3)];
            assert_eq!(squared_wave_number(&pressure, &axes), None, "{side}");
        }
    }
}
