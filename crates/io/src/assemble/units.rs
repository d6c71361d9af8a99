//! Detection of numbers that are given as an index of refraction but are probably another quantity.

use crate::volume::Sample;
use std::ops::RangeInclusive;

/// Indices of transparent matter: 1 (gases, vacuum) to 4 (germanium), and slightly below 1 for warm
/// plasmas and X-rays.
const INDICES: RangeInclusive<f64> = 0.9..=4.2;
/// Range of indices between gases and liquids, which hardly any matter has. The density of air at
/// the ground in kg/m³ lies in it.
const NO_MATTER: RangeInclusive<f64> = 1.02..=1.28;
/// Maximum of n − 1 of gases, and of index contrasts of other matter.
const MAX_CONTRAST: f64 = 0.1;
/// Minimum value, in Pa, that is taken for a pressure: a tenth of the atmospheric pressure.
const MIN_PRESSURE: f64 = 1e4;
/// Minimum density of a liquid in kg/m³, below the densities of light liquids.
const MIN_LIQUID_DENSITY: f64 = 300.0;
/// Range of Hounsfield units, from air to dense bone.
const HOUNSFIELD: RangeInclusive<f64> = -1100.0..=3100.0;
/// Maximum of n − 1 of a gas.
const MAX_GAS_CONTRAST: f64 = 0.05;
/// Minimum of n − 1 of a gas that is not nearly a vacuum.
const MIN_GAS_CONTRAST: f64 = 1e-7;
/// Maximum index change by pressure that a liquid can withstand.
const MAX_PIEZO_CONTRAST: f64 = 0.05;

/// Number of values processed together.
const LANES: usize = 8;

/// Returns the least and the largest of the values, or `None` without values.
pub(super) fn range<T: Sample>(values: &[T]) -> Option<[f64; 2]> {
    // Keep several minima and maxima so that the compiler can use SIMD instructions.
    let mut least = [f64::INFINITY; LANES];
    let mut most = [f64::NEG_INFINITY; LANES];
    for some in values.chunks(LANES) {
        for ((least, most), v) in least.iter_mut().zip(&mut most).zip(some) {
            let v = v.wide();
            *least = if v < *least { v } else { *least };
            *most = if v > *most { v } else { *most };
        }
    }
    let least = least.into_iter().fold(f64::INFINITY, f64::min);
    let most = most.into_iter().fold(f64::NEG_INFINITY, f64::max);
    (least <= most).then_some([least, most])
}

/// Returns the quantity that samples given as an index probably are, with advice, or `None` if they
/// look like an index.
pub(super) fn taken_for_index([least, most]: [f64; 2]) -> Option<(&'static str, &'static str)> {
    let of_gas = "the density of a gas in kg/m³";
    let gladstone_dale =
        "give a volume of type 'gladstone_dale', with the 'wavelength' for air, or 'constant'";
    if INDICES.contains(&least) && INDICES.contains(&most) {
        let between = NO_MATTER.contains(&least) && NO_MATTER.contains(&most);
        return (between && most > least).then_some((of_gas, gladstone_dale));
    }
    let size = most.abs().max(least.abs());
    Some(if size <= MAX_CONTRAST {
        (
            "n − 1, or a contrast of the index",
            "add the reference index by 'offset'",
        )
    } else if least < -100.0 && HOUNSFIELD.contains(&least) && HOUNSFIELD.contains(&most) {
        (
            "Hounsfield units",
            "convert them to an index first, or by 'scale' and 'offset'",
        )
    } else if least >= 0.0 && most >= MIN_PRESSURE {
        (
            "a pressure in Pa",
            "give a volume of type 'pressure', with 'n0' and 'dn_dp'",
        )
    } else if least >= 0.0 && most >= MIN_LIQUID_DENSITY {
        ("a density in kg/m³, or a temperature in K", gladstone_dale)
    } else if least >= 0.0 && *INDICES.end() < most {
        (
            "per cent, or a density",
            "convert them to an index first, or by 'scale' and 'offset'",
        )
    } else if least >= 0.0 {
        (of_gas, gladstone_dale)
    } else {
        (
            "differences from a reference",
            "add the reference index by 'offset'",
        )
    })
}

/// Returns the probable mistake in the densities of a gas, judged by the index that results.
pub(super) fn of_gas([least, most]: [f64; 2], n0: f64) -> Option<&'static str> {
    let size = (most - n0).abs().max((least - n0).abs());
    if size > MAX_GAS_CONTRAST {
        Some("no gas is so dense: the values look like g/m³, or the density of a liquid")
    } else if size > 0.0 && size < MIN_GAS_CONTRAST {
        Some(
            "this is nearly a vacuum: the values look like g/cm³, which 'scale' 1000 converts to kg/m³",
        )
    } else {
        None
    }
}

/// Returns the probable mistake in the pressures of a liquid.
pub(super) fn of_pressure([least, most]: [f64; 2], n0: f64) -> Option<&'static str> {
    let size = (most - n0).abs().max((least - n0).abs());
    (size > MAX_PIEZO_CONTRAST)
        .then_some("no liquid is compressed so much: give the pressure in pascals")
}

#[cfg(test)]
mod tests {
    use super::taken_for_index;

    #[test]
    fn units_are_told_by_their_ranges() {
        let cases = [
            ([1.0, 1.0003], None),
            ([1.0, 1.5], None),
            ([1.2, 1.2], None),
            ([1.33, 1.4], None),
            ([0.95, 1.2], None),
            ([1.1, 1.25], Some("the density of a gas in kg/m³")),
            ([0.2, 1.25], Some("the density of a gas in kg/m³")),
            ([0.0, 1.0], Some("the density of a gas in kg/m³")),
            ([0.0, 3e-4], Some("n − 1, or a contrast of the index")),
            ([-1e-5, 1e-5], Some("n − 1, or a contrast of the index")),
            ([-1000.0, 1500.0], Some("Hounsfield units")),
            ([9e4, 1.1e5], Some("a pressure in Pa")),
            (
                [990.0, 1005.0],
                Some("a density in kg/m³, or a temperature in K"),
            ),
            ([0.0, 100.0], Some("per cent, or a density")),
            ([-0.5, 2.0], Some("differences from a reference")),
        ];
        for (range, expected) in cases {
            assert_eq!(
                taken_for_index(range).map(|(what, _)| what),
                expected,
                "{range:?}"
            );
        }
    }
}
