//! Derivatives of readings, compared with closed forms, the conservation of power, differences and
//! one another (docs/theory.md#derivatives-of-light).

use crate::meters::support::*;
use eikonal::field::{Constant, Luneburg, Placement};
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::derivative::RadiometricParameter;
use morgana_transport::frequency_domain::FrequencyDomain;
use morgana_transport::medium::Medium;
use morgana_transport::meter::{Coordinates, Estimator, Meter, ReadingAxis};
use morgana_transport::render::{
    Derivative, Handle, MeterDerivativeOptions, ReadingFunctional, meter_derivatives,
};
use morgana_transport::scene::Parts;
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use morgana_transport::{Bins, Scene, Spectrum};
use std::sync::Arc;
use testkit::z_test::max_abs_z;

const ESTIMATORS: [Estimator; 2] = [Estimator::TrackLength, Estimator::Collision];
const BY_ALL: [RadiometricParameter; 5] = [
    RadiometricParameter::Absorption(1),
    RadiometricParameter::Scattering(1),
    RadiometricParameter::Extinction(1),
    RadiometricParameter::Albedo(1),
    RadiometricParameter::MeanCosine(1),
];

pub fn by(
    parts: Parts,
    meters: &[Meter],
    parameters: &[RadiometricParameter],
    of: ReadingFunctional,
    particles: u64,
) -> Vec<Derivative> {
    let scene = Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"));
    let options = MeterDerivativeOptions {
        particles,
        seed: 1,
        max_depth: None,
        rr_depth: 5,
        parameters,
        of,
    };
    let found = meter_derivatives(&[scene], meters, &options, &Handle::default());
    let found = found.unwrap().unwrap();
    assert_eq!(found.stats.not_finite, 0);
    found.by
}

/// A purely absorbing medium, in slices along z of [−1, 1]³: samples of a grid, or one number.
fn ink(sigma: [f64; 3], samples: usize) -> Medium {
    let mut medium = fog(Constant::new(1.3), 1.0, 0.0, 0.0);
    let all = Spectrum([sigma[0], sigma[1], sigma[2], 0.0]);
    medium.sigma_t = VolumeTexture::Uniform(all);
    if samples > 1 {
        let data = (0..3 * samples).map(|i| sigma[i % 3] as f32).collect();
        let grid = GridSamples {
            size: [1, 1, samples],
            channels: 3,
            data,
        };
        let cube = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
        let (filter, range) = (GridFilter::Nearest, [0.0, 10.0]);
        let grid = VolumeGrid::new(grid, cube, Placement::Centers, filter, range);
        medium.sigma_t = VolumeTexture::Grid(Arc::new(grid.unwrap()));
    }
    medium
}

/// A beam of unit power along z through a cube [−1, 1]³.
fn cube(medium: Medium, channels: usize) -> Parts {
    let mut ambient = vacuum();
    ambient.index = Constant::new(1.3).into();
    let cube = Cube::new(scaled(DVec3::ONE, DVec3::ZERO)).unwrap();
    let cube = container(cube, Bsdf::Null);
    let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.5);
    let mut parts = parts(vec![cube], vec![ambient, medium], vec![light], nobody());
    parts.film.channels = channels;
    parts
}

pub fn grid(size: [usize; 3], estimator: Estimator) -> Meter {
    let to_world = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let mut meter = fluence(Coordinates::Cartesian, size, to_world);
    meter.estimator = estimator;
    Meter::Fluence(meter)
}

/// Cells of depth h that begin at z, of volume 4h, contain v = (e^−σz − e^−σ(z+h))/σ of fluence and
/// σv of absorbed power. ∂v/∂σ for a single number follows from this. With a number per cell, the
/// numbers of cells in front each reduce the light here by a fraction h per unit, and numbers of
/// cells behind have no effect.
#[test]
fn derivatives_in_a_beam_have_closed_forms() {
    const CELLS: usize = 4;
    let (sigma, h) = ([0.3f64, 1.0, 3.0], 2.0 / CELLS as f64);
    let each = |reading| ReadingFunctional::Each { meter: 0, reading };
    let volume = 4.0 * h;
    let mut zs = Vec::new();
    for estimator in ESTIMATORS {
        let meters = [grid([1, 1, CELLS], estimator)];
        for parameter in [
            RadiometricParameter::Absorption(1),
            RadiometricParameter::Extinction(1),
        ] {
            for reading in 0..2 {
                let parts = cube(ink(sigma, 1), 3);
                let found = &by(parts, &meters, &[parameter], each(reading), 20_000)[0];
                assert_eq!(found.shape, [CELLS, 1, 1, 3]);
                for (i, (value, error)) in found.values.iter().zip(&found.errors).enumerate() {
                    let (s, z) = (sigma[i % 3], h * (i / 3) as f64);
                    let [a, b] = [z, z + h].map(|z| (-s * z).exp());
                    let v = (a - b) / s;
                    let slope = ((z + h) * b - z * a) / s - v / s;
                    let exact = [slope, v + s * slope][reading] / volume;
                    zs.push((value - exact) / error);
                }
                let parts = cube(ink(sigma, CELLS), 3);
                let found = &by(parts, &meters, &[parameter], each(reading), 20_000)[0];
                assert_eq!(found.shape, [CELLS, 1, 1, CELLS, 1, 1, 3]);
                for (i, (value, error)) in found.values.iter().zip(&found.errors).enumerate() {
                    let (c, voxel, cell) = (i % 3, i / 3 % CELLS, i / 3 / CELLS);
                    let (s, z) = (sigma[c], h * cell as f64);
                    let [a, b] = [z, z + h].map(|z| (-s * z).exp());
                    let v = (a - b) / s;
                    let exact = match voxel.cmp(&cell) {
                        std::cmp::Ordering::Less => [-h * v, -h * s * v][reading],
                        std::cmp::Ordering::Equal => [(h * b - v) / s, h * b][reading],
                        std::cmp::Ordering::Greater => 0.0,
                    };
                    if voxel > cell {
                        assert_eq!(*value, 0.0);
                    } else {
                        zs.push((value - exact / volume) / error);
                    }
                }
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// A ball of fog, n² = 2 − r², in a beam, of one number or of voxels.
fn ball(sigma_t: f64, albedo: f64, g: f64, voxels: bool) -> Parts {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let mut medium = fog(index, sigma_t, albedo, g);
    if voxels {
        let data = (0..8).map(|i| (sigma_t * (0.5 + 0.2 * i as f64)) as f32);
        let samples = GridSamples {
            size: [2; 3],
            channels: 1,
            data: data.collect(),
        };
        let cube = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
        let (filter, range) = (GridFilter::Trilinear, [0.0, 100.0]);
        let grid = VolumeGrid::new(samples, cube, Placement::Centers, filter, range);
        medium.sigma_t = VolumeTexture::Grid(Arc::new(grid.unwrap()));
    }
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.8);
    parts(vec![ball], vec![vacuum(), medium], vec![light], nobody())
}

/// Power absorbed in the ball and power that leaves it add up to the power that enters, for any
/// fog. All derivatives of the sum vanish, except by emission.
#[test]
fn derivatives_conserve_power() {
    let mut zs = Vec::new();
    for (estimator, voxels) in [
        (ESTIMATORS[0], false),
        (ESTIMATORS[1], false),
        (ESTIMATORS[0], true),
        (ESTIMATORS[1], true),
    ] {
        let parts = ball(3.0, 0.8, 0.4, voxels);
        let skin = through(&parts.objects, 0, [1, 1], false);
        let meters = [grid([2, 3, 2], estimator), Meter::Irradiance(skin)];
        let counts = |meter: &Meter| {
            let readings = meter.readings().into_iter();
            let weights = readings.map(|(name, axes)| {
                let bins = axes.iter().map(ReadingAxis::len).product();
                match name {
                    "absorbed" => vec![8.0 / 12.0; bins],
                    "power" => vec![1.0, 0.0],
                    _ => Vec::new(),
                }
            });
            weights.collect()
        };
        let weights: Vec<Vec<Vec<f64>>> = meters.iter().map(counts).collect();
        let parameters = [&BY_ALL[..], &[RadiometricParameter::Emission(0)]].concat();
        let of = ReadingFunctional::Weighted(&weights);
        let found = by(parts, &meters, &parameters, of, particles(8_000));
        let (emission, others) = found.split_last().unwrap();
        zs.push((emission.values[0] - 1.0) / emission.errors[0]);
        for derivative in others {
            let all = derivative.values.iter().zip(&derivative.errors);
            zs.extend(all.map(|(value, error)| value / error));
            assert!(derivative.errors.iter().all(|e| *e < 0.05));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Compares with differences of measurements with common random numbers; errors are taken as if
/// independent. Steps of a tenth to either side change the quotient by less than 1 %.
#[test]
fn derivatives_of_fluence_are_differences() {
    let meters = [Meter::Fluence(shells(3))];
    let count = particles(60_000);
    let of = ReadingFunctional::Each {
        meter: 0,
        reading: 0,
    };
    let parameters = [BY_ALL[0], BY_ALL[1], BY_ALL[4]];
    let found = by(ball(3.0, 0.8, 0.4, false), &meters, &parameters, of, count);
    let changed = |a: f64, s: f64, g: f64| ball(a + s, s / (a + s), g, false);
    let mut zs = Vec::new();
    for (derivative, [da, ds, dg]) in
        found
            .iter()
            .zip([[0.06, 0.0, 0.0], [0.0, 0.24, 0.0], [0.0, 0.0, 0.04]])
    {
        let [up, down] = [1.0, -1.0].map(|sign| {
            let parts = changed(0.6 + sign * da, 2.4 + sign * ds, 0.4 + sign * dg);
            let found = run(parts, &meters, &options(count, 7));
            reading(&found, 0, "fluence").clone()
        });
        let step = 2.0 * (da + ds + dg);
        for i in 0..3 {
            let difference = (up.mean[i] - down.mean[i]) / step;
            let spread = up.error[i].hypot(down.error[i]) / step;
            let (value, error) = (derivative.values[i], derivative.errors[i]);
            println!("{value} ± {error}, {difference} ± {spread}");
            let slack = 0.01 * difference / 3.0;
            zs.push((value - difference) / error.hypot(spread).hypot(slack));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Rows of a Jacobian, added up with weights, equal the derivative of the weighted sum of readings,
/// to rounding, because the particles are identical. Fluence and absorbed power in gates; power by
/// position.
#[test]
fn rows_of_jacobians_add_up() {
    for estimator in ESTIMATORS {
        let parts = || ball(2.0, 0.7, 0.3, true);
        let mut space = fluence(
            Coordinates::Cartesian,
            [2, 2, 2],
            scaled(DVec3::splat(2.0), DVec3::NEG_ONE),
        );
        space.estimator = estimator;
        space.optical_length = Some(Bins {
            min: 1.0,
            max: 5.0,
            count: 3,
        });
        let mut skin = through(&parts().objects, 0, [3, 2], false);
        let frequencies = FrequencyDomain::new(&[1e8, 4e8], 0.1);
        space.frequency_domain = frequencies.clone();
        skin.frequency_domain = frequencies;
        let meters = [Meter::Fluence(space), Meter::Irradiance(skin)];
        let shapes: Vec<_> = meters.iter().map(Meter::readings).collect();
        for (meter, readings) in shapes.iter().enumerate() {
            for (reading, (name, axes)) in readings.iter().enumerate() {
                let bins: usize = axes.iter().map(ReadingAxis::len).product();
                let weight = |i: usize| 1.0 + (i * 7 % 5) as f64;
                let mut weights: Vec<Vec<Vec<f64>>> = shapes
                    .iter()
                    .map(|readings| vec![Vec::new(); readings.len()])
                    .collect();
                weights[meter][reading] = (0..bins).map(weight).collect();
                let of = ReadingFunctional::Weighted(&weights);
                let sums = by(parts(), &meters, &BY_ALL, of, 200);
                let of = ReadingFunctional::Each { meter, reading };
                let rows = by(parts(), &meters, &BY_ALL, of, 200);
                for (sum, rows) in sums.iter().zip(&rows) {
                    let shape: Vec<usize> = axes.iter().map(ReadingAxis::len).collect();
                    assert_eq!(rows.shape[..axes.len()], shape, "{name}");
                    assert_eq!(rows.shape[axes.len()..], sum.shape[..], "{name}");
                    let numbers = sum.values.len();
                    for (i, value) in sum.values.iter().enumerate() {
                        let all = (0..bins).map(|row| weight(row) * rows.values[row * numbers + i]);
                        let (found, size) =
                            all.fold((0.0, 0.0), |(s, size), v: f64| (s + v, size + v.abs()));
                        assert!(
                            (found - value).abs() <= 1e-9 * size,
                            "{name} {found} {value}"
                        );
                    }
                }
            }
        }
    }
}
