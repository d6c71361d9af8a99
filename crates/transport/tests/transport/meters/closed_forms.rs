//! Readings with exact closed forms.

use crate::meters::support::*;
use eikonal::field::{Constant, Luneburg};
use glam::DVec3;
use morgana_transport::Bins;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::meter::{Coordinates, Estimator, Meter};
use morgana_transport::render::MeasureState;
use morgana_transport::scene::Parts;
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::volume::VolumeTexture;
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::PI;
use testkit::z_test::max_abs_z;

/// A beam along z through the cube [−1, 1]³ of a purely absorbing medium.
fn absorber(sigma: [f64; 3], channels: usize) -> Parts {
    let mut medium = fog(Constant::new(1.3), 1.0, 0.0, 0.0);
    medium.sigma_t = VolumeTexture::Uniform(Spectrum([sigma[0], sigma[1], sigma[2], 0.0]));
    let mut ambient = vacuum();
    ambient.index = Constant::new(1.3).into();
    let cube = container(
        Cube::new(scaled(DVec3::ONE, DVec3::ZERO)).unwrap(),
        Bsdf::Null,
    );
    let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.5);
    let mut parts = parts(vec![cube], vec![ambient, medium], vec![light], nobody());
    parts.film.channels = channels;
    parts
}

/// ∫ exp(−σ z) over slices of [0, 2].
fn slices(sigma: f64, count: usize) -> impl Iterator<Item = f64> {
    let edge = move |i: usize| 2.0 * i as f64 / count as f64;
    let value = move |i| ((-sigma * edge(i)).exp() - (-sigma * edge(i + 1)).exp()) / sigma;
    (0..count).map(value)
}

#[test]
fn a_beam_is_attenuated_exponentially() {
    // Slices lie across the beam: ∫ Φ dV = P ∫ exp(−σ z) dz, over the volume 4 · 0.2.
    let to_world = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let mut all = Vec::new();
    for estimator in [Estimator::TrackLength, Estimator::Collision] {
        let mut meter = fluence(Coordinates::Cartesian, [1, 1, 10], to_world);
        meter.estimator = estimator;
        let parts = absorber([1.5; 3], 1);
        let found = run(parts, &[Meter::Fluence(meter)], &options(40_000, 1));
        let exact: Vec<f64> = slices(1.5, 10).map(|v| v / 0.8).collect();
        let absorbed: Vec<f64> = exact.iter().map(|v| 1.5 * v).collect();
        all.extend(zs(reading(&found, 0, "fluence"), &exact));
        all.extend(zs(reading(&found, 0, "absorbed"), &absorbed));
    }
    max_abs_z(&all, FAMILY).unwrap();
}

#[test]
fn channels_are_attenuated_each_by_its_own() {
    let to_world = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let sigma = [0.3, 1.0, 3.0];
    let mut all = Vec::new();
    for estimator in [Estimator::TrackLength, Estimator::Collision] {
        let mut meter = fluence(Coordinates::Cartesian, [1, 1, 4], to_world);
        meter.estimator = estimator;
        let found = run(
            absorber(sigma, 3),
            &[Meter::Fluence(meter)],
            &options(40_000, 2),
        );
        let of = |c: usize| slices(sigma[c], 4).map(|v| v / 2.0).collect::<Vec<f64>>();
        let channels = [of(0), of(1), of(2)];
        let exact: Vec<f64> = (0..12).map(|i| channels[i % 3][i / 3]).collect();
        let absorbed: Vec<f64> = (0..12).map(|i| sigma[i % 3] * exact[i]).collect();
        all.extend(zs(reading(&found, 0, "fluence"), &exact));
        all.extend(zs(reading(&found, 0, "absorbed"), &absorbed));
        assert_eq!(found.emitted, [1.0; 3]);
    }
    max_abs_z(&all, FAMILY).unwrap();
}

#[test]
fn optical_length_tells_depth() {
    // Light at depth z has the optical length 1.3 (1 + z).
    let to_world = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let mut meter = fluence(Coordinates::Cartesian, [1, 1, 5], to_world);
    meter.optical_length = Some(Bins {
        min: 1.3,
        max: 3.9,
        count: 5,
    });
    let found = run(
        absorber([0.7; 3], 1),
        &[Meter::Fluence(meter)],
        &options(20_000, 3),
    );
    let fluence = reading(&found, 0, "fluence");
    assert_eq!(fluence.axes[0].name, "opl");
    let slices: Vec<f64> = slices(0.7, 5).map(|v| v / 1.6).collect();
    for (i, (mean, error)) in fluence.mean.iter().zip(&fluence.error).enumerate() {
        let (bin, z) = (i / 5, i % 5);
        if bin == z {
            assert!(
                (mean - slices[z]).abs() < 4.5 * error + 1e-12,
                "{i}: {mean} ± {error}"
            );
        } else {
            assert!(mean.abs() < 1e-9, "{i}: {mean}");
        }
    }
}

/// In an isotropic enclosure L = n² L₀, so Φ = 4π n² L₀ for any scattering. Particles do not use
/// n²; the factor follows from the bending of their paths alone.
#[test]
fn fluence_in_a_furnace_is_that_of_the_index_squared() {
    let ball = |bsdf| container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), bsdf);
    let graded = fog(Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap(), 1.0, 1.0, 0.3);
    let glassy = fog(Constant::new(1.5), 2.0, 1.0, 0.0);
    let mut all = Vec::new();
    for (bsdf, medium, seed) in [(Bsdf::Null, graded, 4), (glass(), glassy, 5)] {
        let squared = |r: f64| medium.index.n2(DVec3::X * r);
        // The mean of n² over a shell, exact for polynomials in r².
        let mean = |i: usize| {
            let (a, b) = (0.2 * i as f64, 0.2 * (i + 1) as f64);
            if medium.index.is_constant() {
                squared(a)
            } else {
                2.0 - 0.6 * (b.powi(5) - a.powi(5)) / (b.powi(3) - a.powi(3))
            }
        };
        let exact: Vec<f64> = (0..5).map(|i| 4.0 * PI * mean(i)).collect();
        for estimator in [Estimator::TrackLength, Estimator::Collision] {
            let mut meter = shells(5);
            meter.estimator = estimator;
            let media = vec![vacuum(), medium.clone()];
            let parts = parts(vec![ball(bsdf.clone())], media, vec![sky()], nobody());
            let found = run(
                parts,
                &[Meter::Fluence(meter)],
                &options(particles(40_000), seed),
            );
            all.extend(zs(reading(&found, 0, "fluence"), &exact));
        }
    }
    max_abs_z(&all, FAMILY).unwrap();
}

/// A ball of tissue around a point light. Each channel has its scattering and absorption
/// coefficient.
fn tissue(coefficients: &[[f64; 2]]) -> Parts {
    let of = |value: fn(&[f64; 2]) -> f64| {
        let channel = |c: usize| coefficients.get(c).map_or(0.0, value);
        VolumeTexture::Uniform(Spectrum(std::array::from_fn(channel)))
    };
    let mut medium = fog(Constant::new(1.0), 1.0, 0.5, 0.9);
    medium.sigma_t = of(|[scattering, absorption]| scattering + absorption);
    medium.albedo = of(|[scattering, absorption]| scattering / (scattering + absorption));
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let light = Emitter::Point {
        position: DVec3::ZERO,
        intensity: Spectrum::ONE,
    };
    let mut parts = parts(vec![ball], vec![vacuum(), medium], vec![light], nobody());
    parts.film.channels = coefficients.len();
    parts
}

/// Particles scatter hundreds of times, and channels have different media. Each channel has the
/// error of a separate measurement, to within a factor.
#[test]
fn channels_stay_together_over_many_collisions() {
    let coefficients = [[60.0, 0.2], [30.0, 0.1], [50.0, 1.0]];
    let measured = |coefficients: &[[f64; 2]], seed| {
        let found = run(
            tissue(coefficients),
            &[Meter::Fluence(shells(4))],
            &options(4_000, seed),
        );
        let fluence = reading(&found, 0, "fluence");
        (fluence.mean.clone(), fluence.error.clone())
    };
    let (means, errors) = measured(&coefficients, 1);
    let mut all = Vec::new();
    for (channel, coefficients) in coefficients.iter().enumerate() {
        let (alone, error) = measured(&[*coefficients], 2);
        for shell in 0..4 {
            let i = 3 * shell + channel;
            println!(
                "{} ± {}, alone {} ± {}",
                means[i], errors[i], alone[shell], error[shell]
            );
            all.push((means[i] - alone[shell]) / errors[i].hypot(error[shell]));
            // Three channels share the collisions.
            assert!(errors[i] < 4.0 * error[shell], "{channel}, {shell}");
        }
    }
    max_abs_z(&all, FAMILY).unwrap();
}

/// Under a sky of radiance 1 the fluence is 4π everywhere, however small the scene's objects are;
/// under the sun it is the sun's irradiance. False alarms 2 · 4 · 6e-5.
#[test]
fn light_from_infinity_fills_grids_beyond_the_scene() {
    let cells = fluence(
        Coordinates::Cartesian,
        [2, 2, 1],
        scaled(DVec3::splat(4.0), DVec3::splat(-2.0)),
    );
    let meters = [Meter::Fluence(cells)];
    let sun = Emitter::Directional {
        direction: DVec3::new(0.6, 0.0, 0.8),
        irradiance: Spectrum::ONE,
    };
    for (light, expected) in [(Emitter::constant(1.0), 4.0 * PI), (sun, 1.0)] {
        let ball = container(Sphere::around(DVec3::ZERO, 0.1).unwrap(), Bsdf::Null);
        let mut parts = parts(vec![ball], vec![vacuum(), vacuum()], vec![light], nobody());
        let dim = Scene::new(parts.clone()).unwrap();
        let refused = MeasureState::new(&[dim], &meters).unwrap_err().to_string();
        assert!(refused.contains("meter 0: grid: must lie in"), "{refused}");
        parts.measured = meters[0].aabb();
        let measured = run(parts, &meters, &options(20_000, 3));
        let found = reading(&measured, 0, "fluence");
        for (mean, error) in found.mean.iter().zip(&found.error) {
            assert!(*error < 0.02 * expected, "no power to tell: {error}");
            assert!((mean - expected).abs() < 4.0 * error, "{mean} ± {error}");
        }
    }
}
