//! Measurements for tests.

pub use crate::common::{container, fog, glass, parts, sky, vacuum};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::meter::{
    Coordinates, Estimator, FluenceMeter, IrradianceMeter, Meter, MeterGrid, Positions, Reading,
};
use morgana_transport::render::{Handle, MeasureOptions, Measurement, measure};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::Sensor;
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;

pub const FAMILY: f64 = 1e-3;

/// A sensor that sees nothing, for scenes without a camera.
pub fn nobody() -> Sensor {
    Sensor::Absent(DAffine3::IDENTITY)
}

/// Ten times as many particles under `MORGANA_LONG_TESTS`.
pub fn particles(n: u64) -> u64 {
    match std::env::var_os("MORGANA_LONG_TESTS") {
        Some(_) => 10 * n,
        None => crate::common::samples(n, n / 2),
    }
}

pub fn options(particles: u64, seed: u64) -> MeasureOptions {
    MeasureOptions {
        first: 0,
        particles,
        seed,
        max_depth: None,
        rr_depth: 5,
    }
}

pub fn run(parts: Parts, meters: &[Meter], options: &MeasureOptions) -> Measurement {
    let scene = Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"));
    let handle = Handle::default();
    let go_on = |_| ControlFlow::Continue(());
    let measurement = measure(&[scene], meters, options, &handle, go_on).unwrap();
    assert_eq!(measurement.stats.not_finite, 0);
    let range = options.range();
    assert_eq!(handle.samples(), range.end - range.start);
    measurement
}

pub fn scaled(scale: DVec3, translation: DVec3) -> DAffine3 {
    DAffine3::from_mat3_translation(DMat3::from_diagonal(scale), translation)
}

pub fn fluence(coordinates: Coordinates, size: [usize; 3], to_world: DAffine3) -> FluenceMeter {
    FluenceMeter {
        grid: MeterGrid::new(coordinates, size, to_world).unwrap(),
        estimator: Estimator::TrackLength,
        optical_length: None,
        weight_windows: false,
        sidebands: None,
        frequency_domain: None,
    }
}

/// Shells of the unit ball.
pub fn shells(count: usize) -> FluenceMeter {
    fluence(Coordinates::Spherical, [count, 1, 1], DAffine3::IDENTITY)
}

/// A meter of power through the surface of the `index`th object.
pub fn through(
    objects: &[Object],
    index: usize,
    resolution: [usize; 2],
    by_part: bool,
) -> IrradianceMeter {
    let shape = &objects[index].shape;
    IrradianceMeter::at(index, Positions::new(shape, resolution, by_part))
}

/// A beam of unit power.
pub fn beam(origin: DVec3, direction: DVec3, radius: f64) -> Emitter {
    Emitter::Collimated(Collimated::new(
        origin,
        direction,
        BeamProfile::Disc { radius },
        Spectrum::ONE,
    ))
}

/// The reading `name` of the `meter`th meter.
pub fn reading<'a>(measurement: &'a Measurement, meter: usize, name: &str) -> &'a Reading {
    let mut readings = measurement.readings[meter].iter();
    readings.find(|r| r.name == name).unwrap()
}

/// Differences from exact values, in standard errors.
pub fn zs<'a>(reading: &'a Reading, exact: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    assert_eq!(reading.mean.len(), exact.len());
    let all = reading.mean.iter().zip(&reading.error).zip(exact);
    all.map(|((mean, error), exact)| {
        println!("{}: {mean} ± {error}, expected {exact}", reading.name);
        (mean - exact) / error
    })
}
