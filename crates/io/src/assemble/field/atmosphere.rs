//! Index of the US Standard Atmosphere of 1976 (docs/scene/ior.md#the-standard-atmosphere).

use super::air;
use crate::query::Query;
use eikonal::Field;
use eikonal::field::{Coordinate, FieldError, IndexProfile};

/// Radius of the Earth for geopotential heights, in metres.
const EARTH_RADIUS: f64 = 6_356_766.0;
/// Hydrostatic constant g₀ M₀/R* in K/m, which determines the decrease of pressure with height.
const HYDROSTATIC: f64 = 9.806_65 * 0.028_964_4 / 8.314_32;
/// Specific gas constant R*/M₀ in J/(kg K).
const GAS_CONSTANT: f64 = 8.314_32 / 0.028_964_4;
/// Pressure at the ground in Pa.
const PRESSURE: f64 = 101_325.0;
/// Temperature at the ground in K.
const TEMPERATURE: f64 = 288.15;
/// Geopotential height in metres at which each layer begins, and its temperature gradient in K/m.
const LAYERS: [[f64; 2]; 7] = [
    [0.0, -6.5e-3],
    [11e3, 0.0],
    [20e3, 1e-3],
    [32e3, 2.8e-3],
    [47e3, 0.0],
    [51e3, -2.8e-3],
    [71e3, -2e-3],
];
/// Heights in metres between which the standard is defined.
const RANGE: [f64; 2] = [-5e3, 86e3];
/// Distance between samples in metres. It makes the slope of the spline accurate to 1e-8 within
/// layers and confines the bends between layers to 50 m.
const STEP: f64 = 50.0;
/// Relative growth of the distance between samples outside the standard's range.
const GROWTH: f64 = 0.05;
/// Extent in metres of the samples on each side of the standard's range.
const EXTENT: f64 = 4e5;
/// Length in metres over which the density below the standard's range tends to a constant.
const DECAY_LENGTH: f64 = 1e4;

/// Builds the field of a volume of type `standard_atmosphere`, at the wavelength `nm` of the
/// channel if it has one.
pub(super) fn build(q: &mut Query, nm: Option<f64>) -> Option<Result<Field, FieldError>> {
    let slope = air::constant(nm, q);
    let metres_per_unit = q.float("metres_per_unit");
    let radius = q.float_if_given("radius");
    let depth = radius.map_or(f64::MAX, |r| r * metres_per_unit);
    let sample = |[height, density]: [f64; 2]| [height / metres_per_unit, 1.0 + slope * density];
    let mut samples: Vec<[f64; 2]> = densities()
        .filter(|[height, _]| *height > -0.999 * depth)
        .map(sample)
        .collect();
    let (coordinate, shift) = match radius {
        Some(radius) => {
            samples.insert(0, [-radius, samples.first()?[1]]);
            (Coordinate::R, radius)
        }
        None => (Coordinate::Z, 0.0),
    };
    Some(IndexProfile::table(coordinate, shift, &samples).map(Field::from))
}

/// Returns the density in kg/m³ at a height in metres within the range of the standard.
fn density(height: f64) -> f64 {
    let geopotential = EARTH_RADIUS * height / (EARTH_RADIUS + height);
    let (mut pressure, mut temperature) = (PRESSURE, TEMPERATURE);
    for (i, [base, lapse]) in LAYERS.into_iter().enumerate() {
        let next = LAYERS.get(i + 1).map_or(f64::MAX, |[next, _]| *next);
        let rise = geopotential.min(next) - base;
        let end = temperature + lapse * rise;
        pressure *= if lapse == 0.0 {
            (-HYDROSTATIC * rise / temperature).exp()
        } else {
            (end / temperature).powf(-HYDROSTATIC / lapse)
        };
        temperature = end;
        if geopotential <= next {
            break;
        }
    }
    pressure / (GAS_CONSTANT * temperature)
}

/// Returns heights in metres, ascending, with densities in kg/m³: inside the range of the standard,
/// and smooth continuations outside.
fn densities() -> impl Iterator<Item = [f64; 2]> {
    let [low, high] = RANGE;
    let [bottom, top] = RANGE.map(density);
    // Decrease of the logarithm of the density per metre, at both ends of the range.
    let fall = (density(low) / density(low + 1.0)).ln();
    let thinning = (density(high - 1.0) / density(high)).ln();
    let below =
        move |d: f64| bottom * (1.0 + fall * DECAY_LENGTH * (1.0 - (-d / DECAY_LENGTH).exp()));
    let under: Vec<f64> = offsets().collect();
    let under = under.into_iter().rev().map(move |d| [low - d, below(d)]);
    let count = ((high - low) / STEP) as usize;
    let within = (0..=count).map(move |i| low + STEP * i as f64);
    let above = offsets().map(move |d| [high + d, top * (-thinning * d).exp()]);
    under.chain(within.map(|h| [h, density(h)])).chain(above)
}

/// Returns growing distances from the standard's range, in metres.
fn offsets() -> impl Iterator<Item = f64> {
    let next = |d: &f64| Some(d + STEP + GROWTH * d);
    std::iter::successors(Some(STEP), next).take_while(|d| *d < EXTENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares densities with the tables of the standard (NOAA, NASA, USAF, "U.S. Standard
    /// Atmosphere, 1976", table I), to five digits.
    #[test]
    fn densities_are_those_of_the_standard() {
        for (kilometres, published) in [
            (0.0, 1.2250),
            (5.0, 7.3643e-1),
            (10.0, 4.1351e-1),
            (20.0, 8.8910e-2),
            (30.0, 1.8410e-2),
            (40.0, 3.9957e-3),
            (50.0, 1.0269e-3),
            (60.0, 3.0968e-4),
            (70.0, 8.2829e-5),
            (80.0, 1.8458e-5),
        ] {
            let found = density(1e3 * kilometres);
            assert!(
                (found / published - 1.0).abs() < 1e-4,
                "{kilometres} km: {found} {published}"
            );
        }
    }
}
