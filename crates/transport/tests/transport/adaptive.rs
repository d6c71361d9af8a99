//! Adaptive sampling: samples distributed among pixels by their noise. Tests that images are
//! unbiased, that reported errors are right and smaller than with even samples, and that parts and
//! numbers of threads do not change the result.
//!
//! False alarms: 2.5e-4 for errors and for means of each kind of replicates, and for the pilot's
//! estimates; 1.25e-3 for the file.

use crate::common::{camera, container, fog, parts, path_tracer, samples, vacuum};
use eikonal::Field;
use eikonal::field::{Acoustic, AcousticMode, Gaussian};
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::film::{Decomposition, Film};
use morgana_transport::integrator::{Bdpt, Integrator};
use morgana_transport::render::{Handle, MergeError, RenderOptions, State, memory, render};
use morgana_transport::sampling::Replicates;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Orthographic, Sensor};
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum, Stop};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::{ControlFlow, Range};
use testkit::{Moments, z_test::max_abs_z};

const FALSE_ALARM: f64 = 2.5e-4;
/// Number of instants of a period of sound, in scenes with sound.
const INSTANTS: usize = 3;
const SAMPLES: u64 = 48;
const SEEDS: u64 = 40;

/// A visible emitter whose edge has the most noise, and fog of varying index in front of one
/// corner.
fn scene(index: impl Into<Field>) -> Parts {
    let fogs = container(
        Sphere::around(DVec3::new(0.5, 0.2, 0.8), 0.4).unwrap(),
        Bsdf::Null,
    );
    let light = Object {
        name: "light".into(),
        shape: Sphere::around(DVec3::ZERO, 0.55).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: Some(0),
    };
    let emitter = Emitter::Area {
        object: 1,
        radiance: Spectrum::splat(3.0),
    };
    let media = vec![vacuum(), fog(index, 1.0, 0.9, 0.3)];
    let sensor = camera(DVec3::Z * 4.0, DVec3::ZERO);
    let mut parts = parts(vec![fogs, light], media, vec![emitter], sensor);
    (parts.film.width, parts.film.height) = (23, 19);
    parts
}

fn lens() -> Scene {
    let index = Gaussian::new(1.0, 0.1, DVec3::new(0.5, 0.2, 0.8), 0.2).unwrap();
    Scene::new(scene(index)).unwrap()
}

/// The scene with sound, at three instants.
fn sound() -> Scene {
    let mode = AcousticMode::new(0.05, 0, 5.0, 0.0).unwrap();
    let index = Acoustic::new(1.0, DVec3::ZERO, DVec3::Z, DVec3::X, vec![mode]).unwrap();
    Scene::over_period(scene(index), INSTANTS, None, &Stop::default()).unwrap()
}

fn options(range: Range<u64>, seed: u64, adaptive: bool) -> RenderOptions {
    RenderOptions {
        first: range.start,
        adaptive,
        ..RenderOptions::new(path_tracer(), range.end - range.start, seed)
    }
}

fn film(scene: &Scene, options: &RenderOptions) -> Film {
    render(std::slice::from_ref(scene), options, |_| {
        ControlFlow::Continue(())
    })
    .film
}

/// Statistics over many renders: moments of each pixel's mean, and moments of the excess of the
/// reported variances over the measured ones.
struct Observed {
    pixels: Vec<Moments>,
    excess: Moments,
}

fn observe(scene: &Scene, replicates: Replicates, adaptive: bool) -> Observed {
    let seeds = 0..SEEDS;
    let films = seeds.map(|seed| {
        let options = RenderOptions {
            replicates,
            ..options(0..SAMPLES, seed, adaptive)
        };
        let film = film(scene, &options);
        (film.mean(), film.variance())
    });
    let films: Vec<_> = films.collect();
    let moments = |pixel: usize| {
        let mut moments = Moments::default();
        films.iter().for_each(|f| moments.push(f.0[pixel].into()));
        moments
    };
    let pixels: Vec<Moments> = (0..films[0].0.len()).map(moments).collect();
    let bessel = SEEDS as f64 / (SEEDS - 1) as f64;
    let mut excess = Moments::default();
    for (mean, claimed) in &films {
        let claimed: f64 = claimed.iter().map(|v| f64::from(*v)).sum();
        let squares = mean.iter().zip(&pixels);
        let actual: f64 = squares
            .map(|(m, p)| (f64::from(*m) - p.mean()).powi(2))
            .sum();
        excess.push(claimed - bessel * actual);
    }
    Observed { pixels, excess }
}

/// Adaptive sampling reduces the errors. The mean number of samples is equal, which
/// `pixels_get_their_shares` checks.
#[test]
fn errors_are_smaller_and_true_and_means_agree() {
    for replicates in [Replicates::SINGLE, Replicates::new(8).unwrap()] {
        let scene = lens();
        let [even, adaptive] = [false, true].map(|adaptive| observe(&scene, replicates, adaptive));
        let variance = |o: &Observed| o.pixels.iter().map(Moments::variance).sum::<f64>();
        let ratio = variance(&adaptive) / variance(&even);
        // Evenly distributed samples leave less noise for adaptive sampling to reduce.
        let most = if replicates == Replicates::SINGLE {
            0.75
        } else {
            0.8
        };
        assert!(ratio < most, "{replicates:?}: {ratio}");
        let zs = [even.excess.z(0.0), adaptive.excess.z(0.0)];
        max_abs_z(&zs, FALSE_ALARM).unwrap();
        let pairs = even.pixels.iter().zip(&adaptive.pixels);
        let z = |(a, b): (&Moments, &Moments)| {
            let variance = (a.variance() + b.variance()) / SEEDS as f64;
            match a.mean() - b.mean() {
                0.0 => 0.0,
                difference => difference / variance.sqrt(),
            }
        };
        max_abs_z(&pairs.map(z).collect::<Vec<_>>(), FALSE_ALARM).unwrap();
    }
}

/// Twelve small emitters in a row, one in each pixel. Few samples hit an emitter, so that the pilot
/// has little information.
fn lights() -> Scene {
    let place = |i: usize| DVec3::X * (i as f64 - 5.5) * 0.1;
    let light = |i| Object {
        name: "light".into(),
        shape: Sphere::around(place(i), 0.015).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: Some(i),
    };
    let emitter = |object| Emitter::Area {
        object,
        radiance: Spectrum::ONE,
    };
    let film = DAffine3::from_scale_rotation_translation(
        DVec3::new(0.6, 0.6, 1.0),
        DQuat::from_rotation_y(PI),
        DVec3::Z * 4.0,
    );
    let sensor = Sensor::Orthographic(Orthographic::new(film, 12.0));
    let objects = (0..12).map(light).collect();
    let emitters = (0..12).map(emitter).collect();
    let mut parts = parts(objects, vec![vacuum()], emitters, sensor);
    (parts.film.width, parts.film.height) = (12, 1);
    Scene::new(parts).unwrap()
}

/// Means are unbiased. If the sample counts depended on samples of the image itself, bright samples
/// would count for less.
#[test]
fn what_a_pilot_sees_by_chance_does_not_bias_the_image() {
    let scene = lights();
    let mean = |adaptive| {
        let film = |seed| {
            film(&scene, &options(0..SAMPLES, seed, adaptive))
                .summary()
                .0
        };
        let means: Vec<f64> = (0..samples(6_000, 2_000))
            .into_par_iter()
            .map(film)
            .collect();
        let mut moments = Moments::default();
        means.iter().for_each(|mean| moments.push(*mean));
        moments
    };
    let [even, adaptive] = [mean(false), mean(true)];
    let covered = PI * 0.15 * 0.15;
    max_abs_z(&[even.z(covered), adaptive.z(covered)], FALSE_ALARM).unwrap();
}

/// Samples are even up to the 16th. From then on the mean number of samples is the requested one.
#[test]
fn pixels_get_their_shares() {
    let scene = lens();
    let counts = |samples| film(&scene, &options(0..samples, 1, true)).counts();
    assert!(counts(16).iter().all(|n| *n == 16));
    let counts = counts(1016);
    let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(
        (516..700).contains(least) && (1500..8017).contains(most),
        "{least} {most}"
    );
    let mean = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    assert!((mean / 1016.0 - 1.0).abs() < 0.005, "{mean}");
}

/// All instants of a period have equally many samples.
#[test]
fn pixels_get_whole_periods_and_replicates() {
    for (replicates, unit) in [(Replicates::SINGLE, 3), (Replicates::new(8).unwrap(), 24)] {
        let options = RenderOptions {
            replicates,
            ..options(0..240, 1, true)
        };
        let counts = film(&sound(), &options).counts();
        assert!(counts.iter().all(|n| n.is_multiple_of(unit)), "{counts:?}");
        assert!(counts.iter().any(|n| *n != 240));
    }
}

fn state(scene: &Scene, replicates: Replicates, range: Range<u64>) -> State {
    let scenes = std::slice::from_ref(scene);
    let options = RenderOptions {
        replicates,
        decomposition: Decomposition {
            bounces: Some(1),
            ..Decomposition::default()
        },
        ..options(range, 5, true)
    };
    let mut state = State::new(scenes, &options);
    let handle = Handle::default();
    state.advance(scenes, &options, &handle, |_| ControlFlow::Continue(()));
    assert!(state.fits(scenes, &options));
    state
}

#[test]
fn parts_in_any_order_are_the_whole() {
    for (scene, replicates) in [
        (lens(), Replicates::SINGLE),
        (lens(), Replicates::new(8).unwrap()),
        (sound(), Replicates::SINGLE),
    ] {
        let state = |range| state(&scene, replicates, range);
        let whole = state(0..SAMPLES);
        for cuts in [
            &[0, 7, 16, 17, 30, 48][..],
            &[0, 16, 24, 48],
            &[0, 40, 41, 48],
        ] {
            let parts = cuts.windows(2).map(|cut| state(cut[0]..cut[1]));
            let mut parts: Vec<State> = parts.collect();
            for _ in 0..parts.len() {
                parts.rotate_left(1);
                let mut merged = parts[0].clone();
                parts[1..].iter().for_each(|p| merged.merge(p).unwrap());
                assert_eq!(merged.film(), whole.film());
            }
        }
    }
}

/// A render may also be interrupted while its pilot determines the sample counts.
#[test]
fn a_render_that_goes_on_is_the_whole_on_any_number_of_threads() {
    let scenes = [lens()];
    let options = options(0..SAMPLES, 5, true);
    let whole = film(&scenes[0], &options);
    let mut state = State::new(&scenes, &options);
    let handle = Handle::default();
    for (run, threads) in [1, 2, 7].into_iter().cycle().enumerate() {
        if state.done().count() == SAMPLES {
            break;
        }
        assert!(run < 100, "no progress");
        // Let some runs get a little further before the interruption.
        let mut left = run % 5;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            state.advance(&scenes, &options, &handle, |_| match left {
                0 => ControlFlow::Break(()),
                _ => {
                    left -= 1;
                    ControlFlow::Continue(())
                }
            });
        });
    }
    assert_eq!(state.film(), &whole);
}

/// Parts with even samples do not merge with parts with adaptive samples. Parts that do not know
/// the sample counts yet do.
#[test]
fn parts_of_other_renders_are_refused() {
    let scenes = [lens()];
    let part = |range: Range<u64>, seed, adaptive| {
        let options = options(range, seed, adaptive);
        let mut state = State::new(&scenes, &options);
        let handle = Handle::default();
        state.advance(&scenes, &options, &handle, |_| ControlFlow::Continue(()));
        state
    };
    let late = part(30..40, 1, true);
    for other in [part(0..8, 1, false), part(20..30, 2, true)] {
        assert_eq!(late.clone().merge(&other), Err(MergeError::Different));
        assert_eq!(other.clone().merge(&late), Err(MergeError::Different));
    }
    let mut early = part(0..8, 1, true);
    early.merge(&late).unwrap();
    assert!(!early.fits(&scenes, &options(0..8, 1, false)));
    assert!(early.fits(&scenes, &options(0..8, 1, true)));
}

/// All pixels have equally many samples if the samples are reweighted, or contribute to the whole
/// image.
#[test]
fn other_renders_are_even() {
    let scene = lens();
    let sorted = RenderOptions {
        reweight: true,
        ..options(0..40, 1, true)
    };
    let both = RenderOptions {
        renderer: Integrator::Bdpt(Bdpt::default()).into(),
        ..options(0..40, 1, true)
    };
    for options in [sorted, both] {
        let counts = film(&scene, &options).counts();
        assert!(counts.iter().all(|n| *n == 40));
    }
}

/// Adaptive sampling takes memory only where it is used: the pilot's variance, work and benefit,
/// and the sample count, none of them copied.
#[test]
fn shares_are_part_of_the_memory() {
    let sensor = camera(DVec3::Z * 4.0, DVec3::ZERO);
    let parts = parts(Vec::new(), vec![vacuum()], Vec::new(), sensor);
    let scene = Scene::new(parts).unwrap();
    let of = |adaptive, integrator| {
        let options = RenderOptions {
            adaptive,
            ..RenderOptions::new(integrator, 64, 1)
        };
        memory(&scene, &options)
    };
    let pixels = scene.film().width * scene.film().height;
    let bdpt = Integrator::Bdpt(Bdpt::default());
    assert_eq!(
        of(true, path_tracer()) - of(false, path_tracer()),
        (3 * 4 + 2) * pixels
    );
    assert_eq!(of(true, bdpt), of(false, bdpt));
}
