//! Derivatives of images with respect to coefficients of media, colours of surfaces and emission
//! (docs/theory.md#derivatives-of-light).
//!
//! The references are [central differences](crate::differences) of renders with common random
//! numbers. There are 504 comparisons in all: with other seeds, correct code would fail the family
//! with a probability below 4 %. Differences use steps of a tenth; their error comes from the third
//! derivative, below 3e-3 of the derivative.
//!
//! Identities hold path by path, to rounding. Closed forms are compared at a family-wise
//! false-alarm rate of 1e-4.

mod colours;
mod emitters;
mod identities;
mod integrators;
mod media;
mod refusals;
mod setup;
mod surfaces;

use crate::differences::{self, Comparisons, Mean, long};
use eikonal::Field;
use eikonal::field::{Constant, LinearIndex, Luneburg};
use glam::DVec3;
use morgana_transport::bsdf::Tint;
use morgana_transport::derivative::{DerivativeError, RadiometricParameter};
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::render::{Derivative, DerivativeOptions, Handle, derivatives};
use morgana_transport::{Scene, Spectrum};
use setup::{MadeOf, Painted, Setup, two};

const PATH: Integrator = Integrator::Path(PathTracer {
    max_depth: Some(6),
    rr_depth: 4,
});
/// Media and the other parts of [`Setup::scene`].
const HAZE: usize = 1;
const WALL: usize = 1;
const LIGHT: usize = 0;

/// Arbitrary weights of both signs.
fn weights() -> Vec<f64> {
    (0..32).map(|i| ((i * 7 % 13) as f64 - 4.0) / 8.0).collect()
}

/// Σ weight × image of each batch of samples.
fn losses(integrator: Integrator, scene: Scene) -> Vec<f64> {
    let samples = if long() {
        1 << 15
    } else {
        crate::common::samples(1024, 384)
    };
    differences::losses(integrator, scene, samples, &weights())
}

fn by(scene: Scene, parameters: &[RadiometricParameter], samples: u64) -> Vec<Derivative> {
    try_by(scene, parameters, samples, &weights()).unwrap()
}

fn try_by(
    scene: Scene,
    parameters: &[RadiometricParameter],
    samples: u64,
    weights: &[f64],
) -> Result<Vec<Derivative>, DerivativeError> {
    try_with(PATH, scene, parameters, samples, weights)
}

fn try_with(
    integrator: Integrator,
    scene: Scene,
    parameters: &[RadiometricParameter],
    samples: u64,
    weights: &[f64],
) -> Result<Vec<Derivative>, DerivativeError> {
    let options = DerivativeOptions {
        integrator,
        samples,
        seed: 1,
        decomposition: Decomposition::default(),
        hide_emitters: false,
        parameters,
        weights,
    };
    let found = derivatives(&[scene], &options, &Handle::default())?;
    Ok(found.unwrap().by)
}

/// Derivative along a direction: its mean, and an upper bound of its error that assumes full
/// correlation of the numbers.
fn along(derivative: &Derivative, direction: &[[f64; 2]]) -> Mean {
    let pairs = direction.iter().flatten().enumerate();
    let mean = pairs.clone().map(|(i, d)| derivative.values[i] * d).sum();
    let error = pairs.map(|(i, d)| derivative.errors[i] * d.abs()).sum();
    (mean, error)
}

/// Mean and standard error of a central difference of the loss.
fn difference(
    setup: &Setup,
    parameter: RadiometricParameter,
    direction: &[[f64; 2]],
    step: f64,
) -> Mean {
    quotient(PATH, step, |h| {
        setup.changed(parameter, direction, h).scene()
    })
}

/// Mean and standard error of the difference quotient of the loss, for a scene that a step changes.
fn quotient(integrator: Integrator, step: f64, changed: impl Fn(f64) -> Scene) -> Mean {
    differences::quotient([-step, step].map(|h| losses(integrator, changed(h))), step)
}

/// A direction in which all numbers change, by different fractions of `size`.
fn direction(count: usize, size: f64) -> Vec<[f64; 2]> {
    let part = |i: usize| size * (0.5 + 0.5 * (i * 3 % 5) as f64 / 4.0);
    (0..count).map(|i| [part(2 * i), part(2 * i + 1)]).collect()
}

const IN_MEDIA: [RadiometricParameter; 5] = [
    RadiometricParameter::Extinction(HAZE),
    RadiometricParameter::Albedo(HAZE),
    RadiometricParameter::Absorption(HAZE),
    RadiometricParameter::Scattering(HAZE),
    RadiometricParameter::MeanCosine(HAZE),
];
const OTHERS: [RadiometricParameter; 2] = [
    RadiometricParameter::Colour(WALL, Tint::Reflectance),
    RadiometricParameter::Emission(LIGHT),
];

/// Compares all derivatives of a setup with differences.
fn compare(name: &str, setup: &Setup, parameters: &[RadiometricParameter]) {
    let samples = if long() {
        1 << 15
    } else {
        crate::common::samples(1024, 384)
    };
    let all = by(setup.scene(), parameters, samples);
    let mut comparisons = Comparisons::default();
    for (parameter, derivative) in parameters.iter().zip(all) {
        let count = derivative.values.len() / 2;
        let direction = match parameter {
            // Change both channels alike.
            RadiometricParameter::MeanCosine(_) | RadiometricParameter::Emission(_) => (0..count)
                .map(|i| [1.0 - 0.2 * (i % 3) as f64; 2])
                .collect(),
            _ => direction(count, 1.0),
        };
        let found = along(&derivative, &direction);
        let exact = difference(setup, *parameter, &direction, 0.05);
        comparisons.see(&format!("{name} {parameter:?}"), found, exact);
    }
    comparisons.check();
}

/// An index that bends rays.
fn linear() -> LinearIndex {
    LinearIndex::new(1.2, DVec3::Y * 0.1, DVec3::NEG_Y).unwrap()
}

/// An index that bends rays more strongly.
fn lens() -> Luneburg {
    Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap()
}

fn close(a: f64, b: f64, size: f64) -> bool {
    (a - b).abs() <= 1e-9 * size
}
