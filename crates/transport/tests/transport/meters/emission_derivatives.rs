//! Derivatives of readings with respect to emission of media, compared with readings and the
//! conservation of power (docs/theory.md#derivatives-of-light).

use crate::meters::derivatives::{by, grid};
use crate::meters::support::*;
use eikonal::field::{Luneburg, Placement};
use glam::DVec3;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::derivative::RadiometricParameter;
use morgana_transport::medium::{MediumLabel, MediumLabels};
use morgana_transport::meter::{Estimator, Meter, ReadingAxis};
use morgana_transport::render::ReadingFunctional;
use morgana_transport::scene::Parts;
use morgana_transport::shape::Sphere;
use morgana_transport::volume::{GridFilter, GridSamples, LabelGrid, VolumeGrid, VolumeTexture};
use std::f64::consts::PI;
use std::sync::Arc;
use testkit::z_test::{max_abs_z, two_sample_z};

/// Support of the medium's radiances.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MadeOf {
    One,
    Voxels,
    Labels,
}

const SIGMA_T: f64 = 1.5;
const ALBEDO: f64 = 0.6;

/// An emitting ball, n² = 2 − r², in vacuum.
fn glow(made_of: MadeOf, values: &[f64]) -> Parts {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let mut medium = fog(index, SIGMA_T, ALBEDO, 0.3);
    let cube = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let of_labels = |values: &[f64]| {
        let labels = LabelGrid::new([2, 1, 2], vec![0, 1, 1, 0], cube);
        let labels = Arc::new(labels.unwrap());
        let all: Vec<Spectrum> = values.iter().map(|v| Spectrum::splat(*v)).collect();
        let grid = VolumeGrid::by_label(labels.clone(), &all, 1).unwrap();
        (labels, VolumeTexture::Grid(Arc::new(grid)))
    };
    medium.emission = Some(match made_of {
        MadeOf::One => VolumeTexture::Uniform(Spectrum::splat(values[0])),
        MadeOf::Voxels => {
            let samples = GridSamples {
                size: [1, 1, 2],
                channels: 1,
                data: values.iter().map(|v| *v as f32).collect(),
            };
            let (filter, range) = (GridFilter::Trilinear, [0.0, 100.0]);
            let grid = VolumeGrid::new(samples, cube, Placement::Centers, filter, range);
            VolumeTexture::Grid(Arc::new(grid.unwrap()))
        }
        MadeOf::Labels => {
            let label = |i: usize| MediumLabel {
                name: i.to_string(),
                extinction: Spectrum::splat(SIGMA_T),
                absorption: Spectrum::splat(SIGMA_T * (1.0 - ALBEDO)),
                velocity: None,
                fluorescence: None,
            };
            let (labels, emission) = of_labels(values);
            medium.labels = MediumLabels::new(labels, vec![label(0), label(1)]);
            medium.sigma_t = of_labels(&[SIGMA_T; 2]).1;
            medium.albedo = of_labels(&[ALBEDO; 2]).1;
            emission
        }
    });
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    parts(vec![ball], vec![vacuum(), medium], vec![], nobody())
}

fn meters(parts: &Parts, estimator: Estimator) -> [Meter; 2] {
    let skin = through(&parts.objects, 0, [1, 2], false);
    [grid([1, 2, 2], estimator), Meter::Irradiance(skin)]
}

/// Readings are linear in emission: the derivative by one value is the reading without the others.
#[test]
fn derivatives_by_emission_are_readings_of_each_value() {
    let mut zs = Vec::new();
    for made_of in [MadeOf::Voxels, MadeOf::Labels] {
        for estimator in [Estimator::TrackLength, Estimator::Collision] {
            let parts = || glow(made_of, &[0.6, 1.7]);
            let meters = meters(&parts(), estimator);
            let alone = [[1.0, 0.0], [0.0, 1.0]].map(|values| {
                let count = particles(8_000);
                run(glow(made_of, &values), &meters, &options(count, 3))
            });
            for (meter, number, name) in [(0, 0, "fluence"), (0, 1, "absorbed"), (1, 0, "power")] {
                let of = ReadingFunctional::Each {
                    meter,
                    reading: number,
                };
                let parameters = [RadiometricParameter::Radiance(0)];
                let found = by(parts(), &meters, &parameters, of, particles(8_000));
                let own: &[usize] = match made_of {
                    MadeOf::Voxels => &[2, 1, 1, 1],
                    _ => &[2, 1],
                };
                assert!(found[0].shape.ends_with(own), "{made_of:?}");
                let all = found[0].values.iter().zip(&found[0].errors);
                for (i, (value, error)) in all.enumerate() {
                    let exact = reading(&alone[i % 2], meter, name);
                    let (mean, spread) = (exact.mean[i / 2], exact.error[i / 2]);
                    println!("{made_of:?} {name} {i}: {value} ± {error}, {mean} ± {spread}");
                    assert!(mean > 0.0 || *value == 0.0);
                    zs.push(two_sample_z(*value, *error, mean, spread));
                }
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Absorbed and escaping power add up to the emitted power, 4π ∫ μ_a n² B dV, where ∫ n² dV = 4π ·
/// 7/15. The derivatives of the sum follow.
#[test]
fn derivatives_of_media_that_emit_conserve_power() {
    let radiance = 0.8;
    let absorption = SIGMA_T * (1.0 - ALBEDO);
    let power = 4.0 * PI * absorption * radiance * 4.0 * PI * 7.0 / 15.0;
    let parameters = [
        (RadiometricParameter::Radiance(0), power / radiance),
        (RadiometricParameter::Emission(0), power),
        (RadiometricParameter::Absorption(1), power / absorption),
        (RadiometricParameter::Scattering(1), 0.0),
        (RadiometricParameter::Extinction(1), power / SIGMA_T),
        (
            RadiometricParameter::Albedo(1),
            -power * SIGMA_T / absorption,
        ),
        (RadiometricParameter::MeanCosine(1), 0.0),
    ];
    let mut zs = Vec::new();
    for estimator in [Estimator::TrackLength, Estimator::Collision] {
        let parts = glow(MadeOf::One, &[radiance]);
        let meters = meters(&parts, estimator);
        let counts = |meter: &Meter| {
            let readings = meter.readings().into_iter();
            let weights = readings.map(|(name, axes)| {
                let bins = axes.iter().map(ReadingAxis::len).product();
                match name {
                    // The grid fills the cube [−1, 1]³.
                    "absorbed" => vec![8.0 / 4.0; bins],
                    "power" => (0..bins)
                        .map(|i| f64::from(u8::from(i < bins / 2)))
                        .collect(),
                    _ => Vec::new(),
                }
            });
            weights.collect()
        };
        let weights: Vec<Vec<Vec<f64>>> = meters.iter().map(counts).collect();
        let asked = parameters.map(|(parameter, _)| parameter);
        let of = ReadingFunctional::Weighted(&weights);
        let found = by(parts, &meters, &asked, of, particles(16_000));
        for ((parameter, exact), found) in parameters.iter().zip(&found) {
            let (value, error) = (found.values[0], found.errors[0]);
            println!("{estimator:?} {parameter:?}: {value} ± {error}, {exact}");
            assert!(error < 0.05 * power);
            zs.push((value - exact) / error);
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}
