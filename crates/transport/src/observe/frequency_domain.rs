//! Light whose power is modulated at given frequencies.
//!
//! Theory: docs/theory.md#frequency-domain.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use std::f64::consts::TAU;

/// Speed of light in vacuum, m/s.
const LIGHT_SPEED: f64 = 299_792_458.0;

/// Frequencies at which the power of all emitters is modulated. Light of weight w with the optical
/// path length L has *parts*: w cos kL at each wave number k = 2πf/c, then w sin kL at each, then
/// the sum of both at each. The sums yield the covariance of the other two.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrequencyDomain {
    /// Frequencies in Hz.
    hertz: Vec<f64>,
    /// Wave numbers of the modulation in vacuum, per scene unit.
    wave_numbers: Vec<f64>,
}

/// Parts of light at each frequency.
pub(crate) const PARTS: usize = 3;

/// Factors of all parts.
pub(crate) type Factors = SmallVec<[f64; 8]>;

impl FrequencyDomain {
    /// Largest number of frequencies.
    pub const MAX_FREQUENCIES: usize = 64;

    /// Creates frequencies in Hz, for scene units of a length in m. Returns `None` if there is no
    /// frequency or too many, if a frequency is not positive, or if wave numbers are not finite.
    ///
    /// ```
    /// use morgana_transport::frequency_domain::FrequencyDomain;
    ///
    /// let two = FrequencyDomain::new(&[100e6, 200e6], 1e-3).unwrap();
    /// assert_eq!(two.hertz(), [100e6, 200e6]);
    /// assert!(FrequencyDomain::new(&[0.0], 1e-3).is_none());
    /// ```
    pub fn new(hertz: &[f64], metres_per_unit: f64) -> Option<Self> {
        let wave_number = |f: &f64| TAU * f * metres_per_unit / LIGHT_SPEED;
        let wave_numbers: Vec<f64> = hertz.iter().map(wave_number).collect();
        let are_possible = wave_numbers.iter().all(|k| *k > 0.0 && k.is_finite());
        let few = (1..=Self::MAX_FREQUENCIES).contains(&hertz.len());
        (few && are_possible).then(|| FrequencyDomain {
            hertz: hertz.to_vec(),
            wave_numbers,
        })
    }

    /// Returns the frequencies in Hz.
    pub fn hertz(&self) -> &[f64] {
        &self.hertz
    }

    /// Returns the number of parts of light.
    pub(crate) fn parts(&self) -> usize {
        PARTS * self.hertz.len()
    }

    /// Adds to `sums` the means of all factors over light whose optical path lengths are spread
    /// evenly between two values, times `weight`.
    #[inline]
    pub(crate) fn add_between(&self, [from, to]: [f64; 2], weight: f64, sums: &mut [f64]) {
        let [middle, half] = [0.5 * (from + to), 0.5 * (to - from)];
        let (cosines, rest) = sums.split_at_mut(self.wave_numbers.len());
        let (sines, both) = rest.split_at_mut(self.wave_numbers.len());
        for (i, k) in self.wave_numbers.iter().enumerate() {
            let (sin, cos) = (k * middle).sin_cos();
            // Planted error "modulated light of flights at their ends", found by morgana-transport/lib::observe::frequency_domain::tests::factors_are_means_along_flights:
            // let weight = weight * (half - half + 1.0);
            let weight = weight * sinc(k * half);
            cosines[i] += weight * cos;
            sines[i] += weight * sin;
            both[i] += weight * (cos + sin);
        }
    }

    /// Returns the factors of all parts of light with an optical path length.
    pub(crate) fn factors(&self, optical_length: f64) -> Factors {
        self.factors_between([optical_length; 2])
    }

    /// Returns the means of all factors over light whose optical path lengths are spread evenly
    /// between two values.
    #[inline]
    pub(crate) fn factors_between(&self, lengths: [f64; 2]) -> Factors {
        let mut factors = Factors::from_elem(0.0, self.parts());
        self.add_between(lengths, 1.0, &mut factors);
        factors
    }
}

/// Returns sin(x)/x.
#[inline]
fn sinc(x: f64) -> f64 {
    let square = x * x;
    if square < 1e-4 {
        // The next term is below 2e-16.
        1.0 - square * (1.0 - square * 0.05) / 6.0
    } else {
        x.sin() / x
    }
}

/// Amplitude and phase of modulated light, with their standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Phasor {
    /// Amplitude and its standard error.
    pub amplitude: [f64; 2],
    /// Phase, from −π to π, and its standard error in radians; zero and infinite without light.
    pub phase: [f64; 2],
}

impl Phasor {
    /// Smallest ratio of the amplitude to its standard error at which the phase has a meaning.
    const MIN_RATIO: f64 = 3.0;

    /// Computes amplitude and phase from the means of the three parts of light, and the variances
    /// of the means, by linear propagation of errors.
    pub(crate) fn of(means: [f64; PARTS], variances: [f64; PARTS]) -> Self {
        let [x, y, _] = means;
        let [var_x, var_y, var_both] = variances;
        let covariance = 0.5 * (var_both - var_x - var_y);
        let amplitude = x.hypot(y);
        if amplitude == 0.0 {
            return Phasor {
                amplitude: [0.0, var_x.max(var_y).sqrt()],
                phase: [0.0, f64::INFINITY],
            };
        }
        let (cos, sin) = (x / amplitude, y / amplitude);
        // Planted error "errors of amplitudes without the covariance of their parts", found by morgana-transport/transport::meters::frequency_domain::amplitudes_and_phases_scatter_as_they_say:
        // let mixed = 0.0 * cos * sin * covariance;
        let mixed = 2.0 * cos * sin * covariance;
        let along = cos * cos * var_x + mixed + sin * sin * var_y;
        let across = sin * sin * var_x - mixed + cos * cos * var_y;
        Phasor {
            amplitude: [amplitude, along.max(0.0).sqrt()],
            phase: [y.atan2(x), across.max(0.0).sqrt() / amplitude],
        }
    }

    /// Returns the derivatives of the amplitude by the in-phase and the quadrature part; zero
    /// without light.
    pub(crate) fn amplitude_derivatives([x, y]: [f64; 2]) -> [f64; 2] {
        let amplitude = x.hypot(y);
        [x, y].map(|part| {
            if amplitude > 0.0 {
                part / amplitude
            } else {
                0.0
            }
        })
    }

    /// Returns the derivatives of the phase by the in-phase and the quadrature part; zero without
    /// light.
    pub(crate) fn phase_derivatives([x, y]: [f64; 2]) -> [f64; 2] {
        let square = x * x + y * y;
        [-y, x].map(|part| if square > 0.0 { part / square } else { 0.0 })
    }

    /// Returns true if the phase has no meaning, because the amplitude may be zero.
    pub(crate) fn is_unknown(&self) -> bool {
        let [amplitude, error] = self.amplitude;
        let across = self.phase[1] * amplitude;
        // Planted error "phases of amplitudes that may be zero", found by morgana-transport/lib::observe::frequency_domain::tests::phases_without_amplitude_are_unknown:
        // amplitude <= 0.0 * Self::MIN_RATIO * error.max(across)
        amplitude <= Self::MIN_RATIO * error.max(across)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn domain() -> FrequencyDomain {
        FrequencyDomain::new(&[1e8, 7e8], 1e-3).unwrap()
    }

    /// Means of factors over flights are those of many points along them.
    #[test]
    fn factors_are_means_along_flights() {
        let domain = domain();
        for lengths in [[0.0, 1e-9], [3.0, 5.0], [10.0, 400.0]] {
            let points: u32 = 20_000;
            let step = (lengths[1] - lengths[0]) / f64::from(points);
            let mut expected = vec![0.0; domain.parts()];
            for i in 0..points {
                let at = lengths[0] + step * (f64::from(i) + 0.5);
                for (sum, factor) in expected.iter_mut().zip(domain.factors(at)) {
                    *sum += factor / f64::from(points);
                }
            }
            let found = domain.factors_between(lengths);
            for (a, b) in found.iter().zip(&expected) {
                assert!((a - b).abs() < 1e-9, "{lengths:?}: {found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn factors_are_cosines_and_sines() {
        let domain = domain();
        let turn = LIGHT_SPEED / 1e8 / 1e-3;
        let found = domain.factors(turn / 4.0);
        let expected = [0.0, 0.0, 1.0, -1.0, 1.0, -1.0];
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-12, "{found:?}");
        }
    }

    #[test]
    fn frequencies_are_positive_and_few() {
        for hertz in [
            &[][..],
            &[-1.0],
            &[1e8, 0.0],
            &[f64::NAN],
            &[f64::INFINITY],
            &[1e8; 65],
        ] {
            assert!(FrequencyDomain::new(hertz, 1e-3).is_none(), "{hertz:?}");
        }
        for metres in [0.0, -1.0, f64::NAN] {
            assert!(FrequencyDomain::new(&[1e8], metres).is_none());
        }
    }

    #[test]
    fn phases_without_amplitude_are_unknown() {
        let weak = Phasor::of([0.02, 0.01, 0.03], [1e-4, 1e-4, 2e-4]);
        assert!(weak.is_unknown());
        let strong = Phasor::of([1.0, 1.0, 2.0], [1e-4, 1e-4, 2e-4]);
        assert!(!strong.is_unknown());
        assert!(Phasor::of([0.0; 3], [0.0; 3]).is_unknown());
        assert!((strong.phase[0] - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
        assert!((strong.phase[1] - 1e-2 / 2f64.sqrt()).abs() < 1e-15);
        // Parts that vary together move the amplitude, not the phase.
        let together = Phasor::of([1.0, 1.0, 2.0], [1e-4, 1e-4, 4e-4]);
        assert!((together.amplitude[1] - 1e-2 * 2f64.sqrt()).abs() < 1e-15);
        assert!(together.phase[1] < 1e-9);
    }
}
