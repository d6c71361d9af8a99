//! Means over a period of sound, compared with separate renders of its instants, at a false-alarm
//! rate of 1e-3 per test.

use crate::common::{camera, container, fog, parts, path_tracer, vacuum};
use eikonal::Field;
use eikonal::field::{Acoustic, AcousticMode};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::integrator::{Integrator, ParticleTracer};
use morgana_transport::meter::{Coordinates, Estimator, FluenceMeter, Meter, MeterGrid};
use morgana_transport::render::{
    Handle, MeasureOptions, Measurement, RenderOptions, Rendering, measure, render,
};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::Sensor;
use morgana_transport::shape::{Disk, Sphere};
use morgana_transport::{Scene, Spectrum, Stop};
use std::f64::consts::TAU;
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;

const RATE: f64 = 1e-3;
/// Number of instants of a period.
const K: usize = 4;

fn sound(modes: Vec<AcousticMode>) -> Field {
    let sound = Acoustic::new(1.0, DVec3::ZERO, DVec3::Z, DVec3::X, modes);
    sound.unwrap().into()
}

fn strong() -> Field {
    sound(vec![AcousticMode::new(0.15, 0, 5.0, 0.0).unwrap()])
}

/// A ball of thin fog, seen against a small emitter behind it.
fn picture() -> Parts {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let to_world =
        DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(0.3)), DVec3::Z * -1.5);
    let light = Object {
        name: "light".into(),
        shape: Disk::new(to_world).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: Some(0),
    };
    let emitter = Emitter::Area {
        object: 1,
        radiance: Spectrum::ONE,
    };
    let sensor = camera(DVec3::Z * 3.0, DVec3::ZERO);
    let media = vec![vacuum(), fog(strong(), 0.5, 0.9, 0.5)];
    parts(vec![ball, light], media, vec![emitter], sensor)
}

/// The scene parts at one instant.
fn at_instant(parts: &Parts, i: usize) -> Parts {
    let mut parts = parts.clone();
    parts.media[1].index = parts.media[1].index.at_phase(TAU * i as f64 / K as f64);
    parts
}

fn averaged(parts: Parts) -> Scene {
    Scene::over_period(parts, K, None, &Stop::default())
        .unwrap_or_else(|problems| panic!("{problems:?}"))
}

fn shoot(scene: Scene, integrator: Integrator, samples: u64, seed: u64) -> Rendering {
    let options = RenderOptions::new(integrator, samples, seed);
    render(&[scene], &options, |_| ControlFlow::Continue(()))
}

/// Means of pixels and their variances.
fn pixels(rendering: &Rendering) -> Vec<(f64, f64)> {
    let of = |p: morgana_transport::film::Pixel| (p.mean()[0], p.variance_of_mean()[0]);
    rendering.film.pixels(0).map(of).collect()
}

fn zs(a: &[(f64, f64)], b: &[(f64, f64)]) -> Vec<f64> {
    let z = |(a, b): (&(f64, f64), &(f64, f64))| (a.0 - b.0) / (a.1 + b.1).sqrt().max(1e-12);
    a.iter().zip(b).map(z).collect()
}

/// Variances of averaged renders include the spread over instants, which the mean does not have.
/// They are upper bounds, and false alarms are rarer than stated.
#[test]
fn an_averaged_image_is_the_mean_of_the_instants_images() {
    let particle = Integrator::Particle(ParticleTracer::default());
    for (integrator, samples) in [(path_tracer(), 400), (particle, 200)] {
        let all = pixels(&shoot(
            averaged(picture()),
            integrator,
            K as u64 * samples,
            1,
        ));
        let instants: Vec<_> = (0..K)
            .map(|i| {
                let scene = Scene::new(at_instant(&picture(), i)).unwrap();
                pixels(&shoot(scene, integrator, samples, 2 + i as u64))
            })
            .collect();
        let mean = |p: usize| {
            let (mean, variance) = instants.iter().fold((0.0, 0.0), |(mean, variance), image| {
                (mean + image[p].0, variance + image[p].1)
            });
            (mean / K as f64, variance / (K * K) as f64)
        };
        let mean: Vec<_> = (0..all.len()).map(mean).collect();
        max_abs_z(&zs(&all, &mean), RATE).unwrap();
        // Check the power of the test: no instant looks like the mean.
        let differs = |image: &Vec<(f64, f64)>| max_abs_z(&zs(&all, image), 1e-9).is_err();
        assert!(
            differs(&instants[0]) && differs(&instants[2]),
            "{}",
            integrator.name()
        );
    }
}

#[test]
fn one_instant_is_the_scene_itself() {
    let one = Scene::over_period(picture(), 1, None, &Stop::default()).unwrap();
    assert_eq!(one.instants(), 1);
    let plain = shoot(Scene::new(picture()).unwrap(), path_tracer(), 8, 3);
    assert_eq!(shoot(one, path_tracer(), 8, 3).film, plain.film);
}

#[test]
fn threads_and_passes_leave_no_trace() {
    let reference = shoot(averaged(picture()), path_tracer(), 40, 5);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let found = pool
            .build()
            .unwrap()
            .install(|| shoot(averaged(picture()), path_tracer(), 40, 5));
        assert_eq!(found.film, reference.film);
    }
}

/// An interrupted render has seen all instants equally often.
#[test]
fn passes_are_whole_periods() {
    let options = RenderOptions::new(path_tracer(), u64::MAX, 1);
    let mut passes = 0;
    let scene = averaged(picture());
    let stopped = render(&[scene], &options, |_| {
        passes += 1;
        match passes {
            3 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    });
    assert_eq!(stopped.samples % K as u64, 0);
    assert!(stopped.samples > 0);
}

/// A beam along the axis of the sound, which focuses and defocuses it.
fn beam() -> Parts {
    let mut parts = picture();
    parts.objects.truncate(1);
    parts.emitters = vec![Emitter::Collimated(Collimated::new(
        DVec3::Z * -2.0,
        DVec3::Z,
        BeamProfile::Disc { radius: 0.5 },
        Spectrum::ONE,
    ))];
    parts.sensor = Sensor::Absent(DAffine3::IDENTITY);
    parts
}

fn fluence(scene: Scene, particles: u64, seed: u64) -> Vec<(f64, f64)> {
    let grid = MeterGrid::new(Coordinates::Cylindrical, [4, 1, 3], DAffine3::IDENTITY);
    let meter = Meter::Fluence(FluenceMeter {
        grid: grid.unwrap(),
        estimator: Estimator::TrackLength,
        optical_length: None,
        weight_windows: false,
        sidebands: None,
        frequency_domain: None,
    });
    let options = MeasureOptions {
        first: 0,
        particles,
        seed,
        max_depth: None,
        rr_depth: 5,
    };
    let go_on = |_| ControlFlow::Continue(());
    let found = measure(&[scene], &[meter], &options, &Handle::default(), go_on);
    let Measurement { readings, .. } = found.unwrap();
    let reading = &readings[0][0];
    let errors = reading.error.iter().map(|e| e * e);
    reading.mean.iter().copied().zip(errors).collect()
}

#[test]
fn averaged_fluence_is_the_mean_of_the_instants() {
    let particles = 4000;
    let all = fluence(averaged(beam()), K as u64 * particles, 1);
    let instants: Vec<_> = (0..K)
        .map(|i| {
            let scene = Scene::new(at_instant(&beam(), i)).unwrap();
            fluence(scene, particles, 2 + i as u64)
        })
        .collect();
    let mean = |c: usize| {
        let sum = |f: fn(&(f64, f64)) -> f64| instants.iter().map(|r| f(&r[c])).sum::<f64>();
        (sum(|r| r.0) / K as f64, sum(|r| r.1) / (K * K) as f64)
    };
    let mean: Vec<_> = (0..all.len()).map(mean).collect();
    max_abs_z(&zs(&all, &mean), RATE).unwrap();
    assert!(max_abs_z(&zs(&all, &instants[0]), 1e-9).is_err());
}

#[test]
fn there_must_be_one_period() {
    let mut still = picture();
    still.media[1].index = eikonal::field::Constant::new(1.0).into();
    let problems = Scene::over_period(still, K, None, &Stop::default()).unwrap_err();
    assert!(problems[0].message.contains("no medium has sound"));
    let mut two = picture();
    let modes = [5.0, 6.0].map(|k| AcousticMode::new(0.01, 0, k, 0.0).unwrap());
    two.media[1].index = sound(modes.into());
    let problems = Scene::over_period(two, K, None, &Stop::default()).unwrap_err();
    assert!(problems[0].message.contains("several wavelengths"));
}

/// Media with sounds of different frequencies have no common period. Media with equal frequencies
/// do, and so do media one of whose frequencies is unknown.
#[test]
fn sounds_of_different_media_must_have_one_frequency() {
    let at = |hz: f64| {
        let mode = AcousticMode::from_frequency(0.01, 0, hz, 5.0, 0.0);
        sound(vec![mode.unwrap()])
    };
    let both = |other: Field| {
        let mut parts = picture();
        parts.media[1].index = at(1.0);
        let mut second = parts.media[1].clone();
        second.name = "oil".into();
        second.index = other;
        parts.media.push(second);
        Scene::over_period(parts, K, None, &Stop::default())
    };
    assert!(both(at(1.0)).is_ok());
    assert!(both(strong()).is_ok());
    let problems = both(at(1.5)).unwrap_err();
    let expected = "the sound in medium 'fog' has 1 Hz, that in medium 'oil' has 1.5 Hz";
    assert!(problems[0].message.contains(expected), "{problems:?}");
}

/// A sound that vanishes at ωt = 0 has an index jump at the boundary at later instants. The warning
/// appears once for all instants.
#[test]
fn doubts_of_all_instants_are_said_once() {
    for time_phase in [0.0, 0.25 * TAU] {
        let mode = AcousticMode::new(0.15, 0, 5.0, 0.0).unwrap();
        let mut parts = picture();
        parts.media[1].index = sound(vec![mode.with_time_phase(time_phase).unwrap()]);
        let jumps = |scene: &Scene| {
            let warnings = scene.warnings().iter();
            let jumps = warnings.filter(|w| w.message.contains("index jumps"));
            jumps.count()
        };
        let first = Scene::new(parts.clone()).unwrap();
        assert_eq!(jumps(&first), usize::from(time_phase == 0.0));
        let all = Scene::over_period(parts, 2 * K, None, &Stop::default()).unwrap();
        assert_eq!(jumps(&all), 1, "{time_phase}");
    }
}
