//! Point with the measured intensities of a luminaire.

use super::EmitterValues;
use crate::sampling::Discrete;
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::TAU;

/// Reason why a table of intensities cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LuminaireError {
    /// There are fewer than two polar angles, or they do not increase or are out of range.
    #[error("polar angles must increase and lie between 0 and 180 degrees; two at least")]
    Polar,
    /// Azimuths do not increase, or do not cover the full circle.
    #[error("azimuths must increase from 0 to 360 degrees, or be 0 alone")]
    Azimuths,
    /// The number of intensities does not match the angles.
    #[error("expected {expected} intensities, found {found}")]
    Count {
        /// Number of intensities required.
        expected: usize,
        /// Number of intensities given.
        found: usize,
    },
    /// An intensity is negative or not finite, or all intensities are zero.
    #[error("intensities must be finite and not negative, and not all 0")]
    Intensity,
}

/// Relative intensities over polar angles and azimuths. They are linear between the angles, and
/// zero beyond the polar angles.
#[derive(Clone, Debug)]
pub struct Luminaire {
    position: DVec3,
    orientation: Orientation,
    scale: Spectrum,
    /// Polar angles in radians.
    polar: Vec<f64>,
    /// Azimuths from 0 to 2π, in radians.
    azimuths: Vec<f64>,
    /// Intensities, for each azimuth one per polar angle.
    values: Vec<f64>,
    /// Distribution over the intervals between polar angles.
    choice: Discrete,
}

impl Luminaire {
    /// Creates a luminaire at `position` from a table of intensities in units of `scale`. For each
    /// azimuth, the table holds the intensities at the polar angles. Angles are in degrees. Polar
    /// angles are measured from local +z, azimuths from local +x towards +y. Azimuths run from 0 to
    /// 360, or there is just one.
    ///
    /// # Errors
    /// Fails if angles are out of range or out of order, or if the number of intensities does not
    /// match the pairs of angles. Fails if intensities are negative, not finite, or all zero.
    pub fn new(
        position: DVec3,
        orientation: Orientation,
        scale: Spectrum,
        [polar, azimuths]: [Vec<f64>; 2],
        values: Vec<f64>,
    ) -> Result<Self, LuminaireError> {
        let inside = polar.iter().all(|a| (0.0..=180.0).contains(a));
        if polar.len() < 2 || !increase(&polar) || !inside {
            return Err(LuminaireError::Polar);
        }
        let whole = azimuths.first() == Some(&0.0) && azimuths.last() == Some(&360.0);
        if azimuths != [0.0] && !(whole && increase(&azimuths)) {
            return Err(LuminaireError::Azimuths);
        }
        let expected = polar.len() * azimuths.len();
        if values.len() != expected {
            let found = values.len();
            return Err(LuminaireError::Count { expected, found });
        }
        if values.iter().any(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err(LuminaireError::Intensity);
        }
        let polar: Vec<f64> = polar.into_iter().map(f64::to_radians).collect();
        let brightest = |k: usize| {
            let rows = values.chunks_exact(polar.len());
            rows.map(|row| row[k].max(row[k + 1])).fold(0.0, f64::max)
        };
        let zone = |k: usize| brightest(k) * (polar[k].cos() - polar[k + 1].cos());
        let zones: Vec<f64> = (0..polar.len() - 1).map(zone).collect();
        Ok(Luminaire {
            position,
            orientation,
            scale,
            choice: Discrete::new(&zones).map_err(|_| LuminaireError::Intensity)?,
            polar,
            azimuths: azimuths.into_iter().map(f64::to_radians).collect(),
            values,
        })
    }

    /// Returns the unit of the table.
    pub(super) fn values(&self) -> EmitterValues<'_> {
        EmitterValues::One(self.scale)
    }

    /// Returns the luminaire displaced by `shift`.
    pub fn moved(&self, shift: DVec3) -> Self {
        Luminaire {
            position: self.position + shift,
            ..self.clone()
        }
    }

    /// Returns the unit vector along local +z.
    pub fn axis(&self) -> DVec3 {
        self.orientation.to_world(DVec3::Z)
    }

    /// Returns the position.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns polar angle and azimuth of a unit direction.
    fn angles(&self, direction: DVec3) -> (f64, f64) {
        let d = self.orientation.to_local(direction);
        let azimuth = d.y.atan2(d.x);
        (d.x.hypot(d.y).atan2(d.z), azimuth.rem_euclid(TAU))
    }

    /// Returns the radiant intensity in a unit direction.
    pub fn intensity(&self, direction: DVec3) -> Spectrum {
        let (polar, azimuth) = self.angles(direction);
        let Some((k, t)) = place(&self.polar, polar) else {
            return Spectrum::ZERO;
        };
        let n = self.polar.len();
        let along = |row: usize| {
            let at = |k: usize| self.values[row * n + k];
            at(k) * (1.0 - t) + at(k + 1) * t
        };
        let value = match place(&self.azimuths, azimuth) {
            Some((row, s)) => along(row) * (1.0 - s) + along(row + 1) * s,
            None => along(0),
        };
        self.scale * value
    }

    /// Returns the total power. It is the mean over azimuths, by the trapezoidal rule, of 2π ∫ I
    /// sin θ dθ, with I linear between polar angles.
    pub fn power(&self) -> Spectrum {
        let zone = |row: &[f64]| -> f64 {
            let part = |k: usize| {
                let [a, b] = [self.polar[k], self.polar[k + 1]];
                let rise = (row[k + 1] - row[k]) / (b - a);
                row[k] * (a.cos() - b.cos()) + rise * (b.sin() - a.sin() - (b - a) * b.cos())
            };
            (0..self.polar.len() - 1).map(part).sum()
        };
        let rows: Vec<f64> = self
            .values
            .chunks_exact(self.polar.len())
            .map(zone)
            .collect();
        let turn = match rows[..] {
            [all] => TAU * all,
            _ => {
                let pairs = self.azimuths.windows(2).zip(rows.windows(2));
                pairs
                    .map(|(a, r)| 0.5 * (a[1] - a[0]) * (r[0] + r[1]))
                    .sum()
            }
        };
        self.scale * turn
    }

    /// Samples a direction: an interval of polar angles by an upper bound of its power, then
    /// uniformly within it.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let pick = self.choice.sample(u[0]);
        let [a, b] = [pick.index, pick.index + 1].map(|k| self.polar[k].cos());
        let cos = a + (b - a) * pick.u;
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        let (y, x) = (TAU * u[1]).sin_cos();
        self.orientation.to_world(DVec3::new(sin * x, sin * y, cos))
    }

    /// Returns the density of [`Luminaire::sample`] per steradian.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        let (polar, _) = self.angles(direction);
        place(&self.polar, polar).map_or(0.0, |(k, _)| {
            let height = self.polar[k].cos() - self.polar[k + 1].cos();
            self.choice.pdf(k) / (TAU * height)
        })
    }
}

/// Returns the interval that contains a value, and the position in it, from 0 to 1.
fn place(nodes: &[f64], x: f64) -> Option<(usize, f64)> {
    let last = nodes.len().checked_sub(2)?;
    if !(nodes[0]..=nodes[last + 1]).contains(&x) {
        return None;
    }
    let k = nodes
        .partition_point(|n| *n <= x)
        .saturating_sub(1)
        .min(last);
    Some((k, (x - nodes[k]) / (nodes[k + 1] - nodes[k])))
}

fn increase(angles: &[f64]) -> bool {
    angles.windows(2).all(|pair| pair[0] < pair[1])
}
