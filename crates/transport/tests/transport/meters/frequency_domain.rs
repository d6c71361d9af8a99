//! Modulated light: exact in an infinite medium and along a beam, equal for all estimators, with
//! errors that hold, and with derivatives in closed form.

use crate::meters::support::*;
use eikonal::field::{Constant, LinearIndex};
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::derivative::RadiometricParameter;
use morgana_transport::emitter::Emitter;
use morgana_transport::frequency_domain::FrequencyDomain;
use morgana_transport::meter::{Coordinates, Estimator, FluenceMeter, Meter};
use morgana_transport::render::{
    Handle, Measurement, MeterDerivativeOptions, ReadingFunctional, meter_derivatives,
};
use morgana_transport::scene::Parts;
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::{Bins, Scene, Spectrum};
use std::f64::consts::{PI, TAU};
use testkit::z_test::max_abs_z;

const INDEX: f64 = 1.4;
/// Radius of the medium that represents an infinite one.
const RADIUS: f64 = 100.0;
/// Volume of the cell of [`everywhere`]; readings are per volume.
const VOLUME: f64 = 4.0 / 3.0 * PI * RADIUS * RADIUS * RADIUS;
/// Wave numbers of the modulation in vacuum. The second has a phase of 45° in [`infinite`].
const WAVE_NUMBERS: [f64; 3] = [0.2, 1.0 / INDEX, 3.0];

/// Returns frequencies with the given wave numbers in vacuum.
fn domain(wave_numbers: &[f64]) -> FrequencyDomain {
    let hertz: Vec<f64> = wave_numbers.iter().map(|k| k * 1e8).collect();
    FrequencyDomain::new(&hertz, 299_792_458.0 / (TAU * 1e8)).unwrap()
}

/// An emitter of unit power in the middle of a medium of absorption 1 and scattering `scattering`,
/// which no light leaves.
fn infinite(scattering: f64) -> Parts {
    let extinction = 1.0 + scattering;
    let medium = fog(
        Constant::new(INDEX),
        extinction,
        scattering / extinction,
        0.0,
    );
    let light = Emitter::Point {
        position: DVec3::ZERO,
        intensity: Spectrum::splat(0.25 / PI),
    };
    let ball = container(Sphere::around(DVec3::ZERO, RADIUS).unwrap(), Bsdf::Null);
    parts(vec![ball], vec![vacuum(), medium], vec![light], nobody())
}

/// A single cell that contains everything.
fn everywhere() -> FluenceMeter {
    let radius = scaled(DVec3::splat(RADIUS), DVec3::ZERO);
    FluenceMeter {
        frequency_domain: Some(domain(&WAVE_NUMBERS)),
        ..fluence(Coordinates::Spherical, [1, 1, 1], radius)
    }
}

/// Means of all readings of one meter by name, flat.
fn means(found: &Measurement, name: &str) -> Vec<f64> {
    reading(found, 0, name).mean.iter().copied().collect()
}

/// The fluence of a pulse is e^−s over all of space, at the distance s = L/n, for any scattering.
/// Its transform at the wave number k is 1/(1 − ikn).
#[test]
fn an_infinite_medium_delays_light_as_its_absorption_says() {
    let exact = |k: f64| {
        let k = k * INDEX;
        [1.0, k].map(|part| part / (1.0 + k * k))
    };
    let mut all = Vec::new();
    for (scattering, estimator) in [
        (4.0, Estimator::TrackLength),
        (4.0, Estimator::Collision),
        (0.0, Estimator::TrackLength),
    ] {
        let meter = FluenceMeter {
            estimator,
            ..everywhere()
        };
        let options = options(particles(8_000), 5);
        let found = run(infinite(scattering), &[Meter::Fluence(meter)], &options);
        let parts = WAVE_NUMBERS.map(exact);
        let per_volume = |value: f64| value / VOLUME;
        let expected: [(&str, [f64; 3]); 4] = [
            ("fluence_in_phase", parts.map(|[x, _]| per_volume(x))),
            ("fluence_quadrature", parts.map(|[_, y]| per_volume(y))),
            (
                "fluence_amplitude",
                parts.map(|[x, y]| per_volume(x.hypot(y))),
            ),
            ("fluence_phase", parts.map(|[x, y]| y.atan2(x))),
        ];
        for (name, exact) in &expected {
            let reading = reading(&found, 0, name);
            all.extend(zs(reading, exact));
            assert!(reading.few.iter().all(|few| !few));
        }
    }
    max_abs_z(&all, FAMILY).unwrap();
}

/// The scatter of amplitudes and phases over 400 runs is that of their stated errors, in parts
/// whose covariance matters. A standard deviation of 400 normal numbers deviates from 1 by more
/// than 0.14 with a probability of 1e-4.
#[test]
fn amplitudes_and_phases_scatter_as_they_say() {
    let k = WAVE_NUMBERS.map(|k| k * INDEX);
    let exact = [
        ("fluence_amplitude", k.map(|k| 1.0 / k.hypot(1.0) / VOLUME)),
        ("fluence_phase", k.map(f64::atan)),
    ];
    let meters = [Meter::Fluence(everywhere())];
    let runs = 400;
    let mut squares = [[0.0; 3]; 2];
    for seed in 0..runs {
        let found = run(infinite(2.0), &meters, &options(512, 100 + seed));
        for (sums, (name, exact)) in squares.iter_mut().zip(&exact) {
            let reading = reading(&found, 0, name);
            for (i, sum) in sums.iter_mut().enumerate() {
                *sum += ((reading.mean[i] - exact[i]) / reading.error[i]).powi(2);
            }
        }
    }
    for square in squares.into_iter().flatten() {
        let deviation = (square / runs as f64).sqrt();
        println!("{deviation}");
        assert!((deviation - 1.0).abs() < 0.14, "{squares:?}");
    }
}

/// A beam that nothing scatters has a phase of its optical length, in cells and behind them, and
/// an amplitude of its power.
#[test]
fn a_beam_has_the_phase_of_its_length() {
    let medium = fog(Constant::new(INDEX), 1e-9, 0.0, 0.0);
    let cube = Cube::new(scaled(DVec3::ONE, DVec3::ZERO)).unwrap();
    let cube = container(cube, Bsdf::Null);
    let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.5);
    let scene = || {
        parts(
            vec![cube.clone()],
            vec![vacuum(), medium.clone()],
            vec![light.clone()],
            nobody(),
        )
    };
    let wave_numbers = [0.3, 0.5];
    let grid = fluence(
        Coordinates::Cartesian,
        [1, 1, 4],
        scaled(DVec3::splat(2.0), DVec3::NEG_ONE),
    );
    let cells = Meter::Fluence(FluenceMeter {
        frequency_domain: Some(domain(&wave_numbers)),
        ..grid
    });
    let mut skin = through(&scene().objects, 0, [1, 1], true);
    skin.frequency_domain = Some(domain(&wave_numbers));
    let found = run(scene(), &[cells, Meter::Irradiance(skin)], &options(64, 1));
    let phases = reading(&found, 0, "fluence_phase");
    let amplitudes = reading(&found, 0, "fluence_amplitude");
    let power = reading(&found, 1, "power_phase");
    for (i, k) in wave_numbers.into_iter().enumerate() {
        for cell in 0..4 {
            let middle = 1.0 + INDEX * (0.25 + 0.5 * cell as f64);
            let bin = 4 * i + cell;
            assert!((phases.mean[bin] - k * middle).abs() < 1e-9);
            // The amplitude is the mean over a cell of length 0.5.
            let half = 0.25 * k * INDEX;
            let expected = half.sin() / half / 4.0;
            assert!((amplitudes.mean[bin] - expected).abs() < 1e-9);
        }
        // Sides 0 and 1, each with six parts: light leaves through the last one.
        let leaves = power.mean[12 * i + 5];
        assert!((leaves - k * (1.0 + 2.0 * INDEX)).abs() < 1e-9, "{leaves}");
    }
}

/// Light in a medium whose index varies, by track lengths and by collisions. Gates add up to
/// readings without gates, and light in a narrow gate has the phase of the gate.
#[test]
fn estimators_and_gates_agree_along_curved_rays() {
    let index = LinearIndex::new(1.4, DVec3::new(0.0, 0.3, 0.0), DVec3::ZERO).unwrap();
    let medium = fog(index, 3.0, 0.9, 0.5);
    let scene = || {
        let cube = Cube::new(scaled(DVec3::ONE, DVec3::ZERO)).unwrap();
        let cube = container(cube, Bsdf::Null);
        let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.5);
        parts(
            vec![cube],
            vec![vacuum(), medium.clone()],
            vec![light],
            nobody(),
        )
    };
    let (k, width) = (0.8, 0.25);
    let gates = Bins {
        min: 0.0,
        max: 30.0,
        count: 120,
    };
    let meter = |estimator, optical_length| {
        let grid = fluence(
            Coordinates::Cartesian,
            [2, 2, 2],
            scaled(DVec3::splat(2.0), DVec3::NEG_ONE),
        );
        Meter::Fluence(FluenceMeter {
            estimator,
            optical_length,
            frequency_domain: Some(domain(&[k])),
            ..grid
        })
    };
    let measured = |meter, seed| run(scene(), &[meter], &options(particles(20_000), seed));
    let tracks = measured(meter(Estimator::TrackLength, None), 3);
    let collisions = measured(meter(Estimator::Collision, None), 4);
    let mut all = Vec::new();
    for name in ["fluence_in_phase", "fluence_quadrature", "fluence_phase"] {
        let [a, b] = [&tracks, &collisions].map(|found| reading(found, 0, name));
        for i in 0..8 {
            all.push((a.mean[i] - b.mean[i]) / a.error[i].hypot(b.error[i]));
        }
    }
    max_abs_z(&all, FAMILY).unwrap();
    // Random points on arcs differ with gates, by less than a thousandth.
    let gated = measured(meter(Estimator::TrackLength, Some(gates)), 3);
    let fluence = means(&gated, "fluence");
    for (name, factor) in [
        ("fluence_in_phase", f64::cos as fn(f64) -> f64),
        ("fluence_quadrature", f64::sin),
    ] {
        let [parts, all] = [&gated, &tracks].map(|found| means(found, name));
        let total: f64 = means(&tracks, "fluence").iter().sum();
        for (cell, without_gates) in all.into_iter().enumerate() {
            let of_cell = (0..gates.count).map(|gate| (gate, 8 * gate + cell));
            let (mut sum, mut transform) = (0.0, 0.0);
            for (gate, bin) in of_cell {
                let middle = width * (gate as f64 + 0.5);
                sum += parts[bin];
                transform += fluence[bin] * factor(k * middle);
                let slack = 0.5 * k * width * fluence[bin] + 1e-12;
                assert!((parts[bin] - fluence[bin] * factor(k * middle)).abs() <= slack);
            }
            assert!(
                (sum - without_gates).abs() < 1e-3 * total,
                "{sum} {without_gates}"
            );
            // The transform of gates differs by the square of their width.
            assert!((sum - transform).abs() < 2e-3 * total, "{sum} {transform}");
        }
    }
}

/// Derivatives of 1/(μ_a − ikn) by the absorption: of ln A it is −μ_a/(μ_a² + k²n²), of the phase
/// −kn/(μ_a² + k²n²). Scattering has no effect.
#[test]
fn derivatives_by_absorption_have_closed_forms() {
    let scene = Scene::new(infinite(2.0)).unwrap();
    let meters = [Meter::Fluence(everywhere())];
    let names: Vec<&str> = meters[0].readings().iter().map(|(name, _)| *name).collect();
    let mut zs = Vec::new();
    for name in [
        "fluence_in_phase",
        "fluence_quadrature",
        "fluence_amplitude",
        "fluence_phase",
    ] {
        let options = MeterDerivativeOptions {
            particles: particles(40_000),
            seed: 3,
            max_depth: None,
            rr_depth: 5,
            parameters: &[
                RadiometricParameter::Absorption(1),
                RadiometricParameter::Scattering(1),
            ],
            of: ReadingFunctional::Each {
                meter: 0,
                reading: names.iter().position(|n| *n == name).unwrap(),
            },
        };
        let found = meter_derivatives(
            std::slice::from_ref(&scene),
            &meters,
            &options,
            &Handle::default(),
        );
        let found = found.unwrap().unwrap();
        for (i, k) in WAVE_NUMBERS.into_iter().enumerate() {
            let k = k * INDEX;
            let square = 1.0 + k * k;
            let expected = match name {
                "fluence_in_phase" => (k * k - 1.0) / (square * square) / VOLUME,
                "fluence_quadrature" => -2.0 * k / (square * square) / VOLUME,
                "fluence_amplitude" => -1.0 / square.powf(1.5) / VOLUME,
                _ => -k / square,
            };
            for (derivative, expected) in found.by.iter().zip([expected, 0.0]) {
                let (value, error) = (derivative.values[i], derivative.errors[i]);
                println!("{name}: {value} ± {error}, expected {expected}");
                // The value at which amplitude and phase are linear has an error of about a
                // hundredth.
                zs.push((value - expected) / error.hypot(0.01 * expected));
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}
