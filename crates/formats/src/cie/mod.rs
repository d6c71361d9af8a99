//! Conversion of spectra to colours: the standard observer, daylight, and linear sRGB.

mod tables;

use tables::{COUNT, D65, FIRST, MATCHING, STEP};

/// Range of visible wavelengths, in nm.
pub(crate) const VISIBLE: [f64; 2] = [FIRST, FIRST + STEP * (COUNT - 1) as f64];

/// Integral ∫ȳ dλ in nm, as in Mitsuba 3.9.1: equal energy of 1 has luminance 1.
const EQUAL_ENERGY: f64 = 106.750_259_399_414_06;
/// Ratio of ∫ȳ D65 dλ to ∫ȳ dλ, with the numbers of Mitsuba 3.9.1.
const DAYLIGHT: f64 = 98.997_417_518_762_55;
/// Number of wavelengths at which Mitsuba 3.9.1 samples a spectrum to compute its colour.
const SAMPLES: usize = 1000;

/// Matrix from XYZ to linear sRGB (D65): inverse of ITU-R BT.709's primaries and white.
pub(crate) const SRGB_OF_XYZ: [[f64; 3]; 3] = [
    [3.240479, -1.537150, -0.498535],
    [-0.969256, 1.875991, 0.041556],
    [0.055648, -0.204043, 1.057311],
];
/// White of sRGB (D65): X, Y, Z.
pub(crate) const WHITE: [f64; 3] = [0.950456, 1.0, 1.088754];

/// Returns the colour matching functions x̄, ȳ, z̄ of CIE 1931 at a wavelength in nm: linear
/// between the wavelengths of the tables, 0 beyond them.
pub(crate) fn matching(nm: f64) -> [f64; 3] {
    let Some((i, t)) = place(nm) else {
        return [0.0; 3];
    };
    std::array::from_fn(|c| MATCHING[i][c] * (1.0 - t) + MATCHING[i + 1][c] * t)
}

/// Returns the relative power of daylight (D65) at a wavelength in nm, of luminance 1; 0 for
/// invisible wavelengths.
pub fn d65(nm: f64) -> f64 {
    place(nm).map_or(0.0, |(i, t)| {
        (D65[i] * (1.0 - t) + D65[i + 1] * t) / DAYLIGHT
    })
}

/// Speed of light in vacuum, m/s.
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;
/// Constants of Planck, J s, and Boltzmann, J/K (SI, 2019).
const PLANCK: f64 = 6.626_070_15e-34;
const BOLTZMANN: f64 = 1.380_649e-23;

/// Returns the radiance of a black body per wavelength, in W/(m² sr nm), at a wavelength in nm and
/// a temperature in K: Planck's law.
pub fn planck(nm: f64, kelvin: f64) -> f64 {
    let wavelength = 1e-9 * nm;
    let first = 2.0 * PLANCK * SPEED_OF_LIGHT * SPEED_OF_LIGHT / wavelength.powi(5);
    let exponent = PLANCK * SPEED_OF_LIGHT / (wavelength * BOLTZMANN * kelvin);
    1e-9 * first / exponent.exp_m1()
}

/// Returns the row of the tables before a wavelength, and the fraction of the distance to the next
/// row.
fn place(nm: f64) -> Option<(usize, f64)> {
    let at = (nm - FIRST) / STEP;
    let within = at >= 0.0 && at <= (COUNT - 1) as f64;
    within.then(|| {
        let i = (at as usize).min(COUNT - 2);
        (i, at - i as f64)
    })
}

/// Returns linear red, green and blue of light with the power `power` at a wavelength in nm. Equal
/// energy of 1 has luminance 1, but is not white: daylight is white.
///
/// The sum over wavelengths follows Mitsuba 3.9.1. It includes the first and the last wavelength,
/// and all weights are 1/1000 of the range. Colours are therefore 0.1 % darker than by an integral.
pub fn srgb(power: impl Fn(f64) -> f64) -> [f64; 3] {
    let [first, last] = VISIBLE;
    let mut xyz = [0.0; 3];
    for i in 0..SAMPLES {
        let nm = first + i as f64 / (SAMPLES - 1) as f64 * (last - first);
        let power = power(nm);
        for (sum, response) in xyz.iter_mut().zip(matching(nm)) {
            *sum += response * power;
        }
    }
    let unit = (last - first) / (SAMPLES as f64 * EQUAL_ENERGY);
    of_xyz(xyz.map(|v| v * unit))
}

/// Converts X, Y and Z to linear red, green and blue.
pub fn of_xyz(xyz: [f64; 3]) -> [f64; 3] {
    SRGB_OF_XYZ.map(|row| (0..3).map(|c| row[c] * xyz[c]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that ∫ȳ dλ is 106.857 nm (CIE 15:2004). The normalisation differs by 0.1 %, as does
    /// the sum of 1000 samples.
    #[test]
    fn tables_are_normalised() {
        let sum: f64 = MATCHING.iter().map(|m| m[1] * STEP).sum();
        assert!((sum - 106.857).abs() < 1e-3, "{sum}");
        let ratio = (0..COUNT)
            .map(|i| MATCHING[i][1] * D65[i] * STEP)
            .sum::<f64>()
            / sum;
        assert!((ratio / DAYLIGHT - 1.0).abs() < 2e-3, "{ratio}");
        for sample in srgb(d65) {
            assert!((sample - 1.0).abs() < 2e-3, "{sample}");
        }
    }

    /// Compares with Wien's displacement law, 2.897772e-3 m K, and the Stefan–Boltzmann law,
    /// 5.670374e-8 W/(m² K⁴) over π.
    #[test]
    fn black_bodies_have_the_peak_and_power_of_thermal_radiation() {
        let kelvin = 5000.0;
        let peak = 2.897_772e6 / kelvin;
        for aside in [-1.0, 1.0] {
            assert!(planck(peak, kelvin) > planck(peak + aside, kelvin));
        }
        let sum: f64 = (1..200_000).map(|nm| planck(f64::from(nm), kelvin)).sum();
        let expected = 5.670_374e-8 * kelvin.powi(4) / std::f64::consts::PI;
        assert!((sum / expected - 1.0).abs() < 1e-5, "{sum}, {expected}");
    }

    #[test]
    fn nothing_is_seen_beyond_the_tables() {
        assert_eq!(matching(359.9), [0.0; 3]);
        assert_eq!(matching(830.1), [0.0; 3]);
        assert_eq!(d65(1064.0), 0.0);
        assert_eq!(matching(830.0), MATCHING[COUNT - 1]);
        assert_eq!(matching(555.0)[1], 1.0);
        assert_eq!(d65(f64::NAN), 0.0);
    }
}
