//! Sizes of spheres: a single size, or the nodes of a quadrature over a log-normal distribution.
//!
//! Theory: docs/theory.md#mie-scattering.

use super::{PhaseError, Series, Spheres};
use std::f64::consts::PI;

/// Lower limit of the logarithms of radii, relative to the median, in standard deviations.
const MIN_LOG_RADIUS: f64 = -6.0;
/// Largest distance of nodes in standard deviations. The quadrature of smooth functions converges
/// exponentially, so it is exact to rounding.
const MAX_STEP: f64 = 0.25;
/// Largest distance of nodes in size parameter, at the largest spheres. Interference has a period
/// of about π.
const MAX_SIZE_STEP: f64 = 1.0;
/// Contribution to all scattering below which larger spheres are omitted.
const MIN_CONTRIBUTION: f64 = 1e-6;

/// Spheres of one size.
pub(super) struct Size {
    /// Radius.
    pub radius: f64,
    /// Fraction of the number of spheres.
    pub number: f64,
    /// Mie series of the spheres.
    pub series: Series,
}

/// Returns the sizes of spheres.
pub(super) fn sizes(spheres: &Spheres) -> Result<Vec<Size>, PhaseError> {
    let deviation = spheres.geometric_deviation.ln();
    if deviation == 0.0 {
        let x = spheres.size_parameter(spheres.radius);
        return within(x, Spheres::MAX_SIZE).map(|()| vec![size(spheres, spheres.radius, 1.0)]);
    }
    let coarse = until_negligible(spheres, MAX_STEP)?;
    let largest = coarse.last().map_or(spheres.radius, |s| s.radius);
    let step = MAX_SIZE_STEP / (deviation * spheres.size_parameter(largest));
    if step >= MAX_STEP {
        return Ok(coarse);
    }
    until_negligible(spheres, step)
}

/// Returns the nodes of a distribution at distances of `step` standard deviations, up to a size
/// beyond which the rest is negligible.
fn until_negligible(spheres: &Spheres, step: f64) -> Result<Vec<Size>, PhaseError> {
    let deviation = spheres.geometric_deviation.ln();
    let mut sizes = Vec::new();
    let mut scattering = 0.0;
    for t in (0..).map(|k| MIN_LOG_RADIUS + step * f64::from(k)) {
        let radius = spheres.radius * (deviation * t).exp();
        within(
            spheres.size_parameter(radius),
            Spheres::MAX_SIZE_IN_DISTRIBUTION,
        )?;
        let number = step * (-0.5 * t * t).exp() / (2.0 * PI).sqrt();
        let size = size(spheres, radius, number);
        let brings = number * radius * radius * size.series.scattering();
        scattering += brings;
        sizes.push(size);
        // The contribution increases up to some size and decreases beyond it.
        if t > 0.0 && brings < MIN_CONTRIBUTION * step * scattering {
            break;
        }
    }
    Ok(sizes)
}

fn size(spheres: &Spheres, radius: f64, number: f64) -> Size {
    Size {
        radius,
        number,
        series: Series::new(spheres.size_parameter(radius), spheres.relative_index()),
    }
}

fn within(found: f64, most: f64) -> Result<(), PhaseError> {
    let error = PhaseError::SphereSize { found, most };
    if found <= most { Ok(()) } else { Err(error) }
}

/// Returns the sizes for half the distance of nodes.
#[cfg(test)]
pub(super) fn finer(spheres: &Spheres) -> Vec<Size> {
    let deviation = spheres.geometric_deviation.ln();
    let coarse = sizes(spheres).unwrap();
    let step = (coarse[1].radius / coarse[0].radius).ln() / deviation;
    until_negligible(spheres, 0.5 * step).unwrap()
}
