//! Renders by replicates: unbiased, with correct error estimates, and independent of parts and of
//! the number of threads.
//!
//! False alarms: 2.5e-4 for errors and for means of each kind of replicates and estimator, so
//! 1.5e-3 for the file.

use crate::common::{camera, container, fog, in_passes, parts, path_tracer, sky, vacuum};
use eikonal::field::Constant;
use glam::DVec3;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::film::{Decomposition, Film};
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::{Handle, Measure, RenderOptions, Rendering, State, Target, render};
use morgana_transport::sampling::Replicates;
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use std::ops::{ControlFlow, Range};
use testkit::{Moments, z_test::max_abs_z};

const FALSE_ALARM: f64 = 2.5e-4;
const EIGHT: Replicates = Replicates::new(8).unwrap();
const SAMPLES: u64 = 40;
const SEEDS: u64 = 400;

/// Fog around an opaque ball, under a sky.
fn scene() -> Scene {
    let fogs = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let mut ball = container(
        Sphere::around(DVec3::NEG_Y * 0.3, 0.3).unwrap(),
        Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.5)).unwrap()),
    );
    ball.sides = None;
    let media = vec![vacuum(), fog(Constant::new(1.0), 1.0, 0.7, 0.3)];
    let sensor = camera(DVec3::new(0.0, -0.4, 3.0), DVec3::ZERO);
    let parts = parts(vec![fogs, ball], media, vec![sky()], sensor);
    Scene::new(parts).unwrap()
}

fn bdpt() -> Integrator {
    Integrator::Bdpt(Bdpt::default())
}

/// Options for everything that a film can keep, in replicates of eight.
fn options(integrator: Integrator, range: Range<u64>, seed: u64) -> RenderOptions {
    RenderOptions {
        first: range.start,
        replicates: EIGHT,
        decomposition: Decomposition {
            bounces: Some(2),
            ..Decomposition::default()
        },
        reweight: true,
        strategies: integrator == bdpt(),
        ..RenderOptions::new(integrator, range.end - range.start, seed)
    }
}

fn shoot(scene: &Scene, options: &RenderOptions) -> Rendering {
    let scenes = std::slice::from_ref(scene);
    render(scenes, options, |_| ControlFlow::Continue(()))
}

/// Means and reported variances of the pixels, over many renders.
fn renders(
    integrator: Integrator,
    replicates: Replicates,
    samples: u64,
) -> Vec<(Vec<f32>, Vec<f32>)> {
    let scene = scene();
    let options = |seed| RenderOptions {
        replicates,
        ..RenderOptions::new(integrator, samples, seed)
    };
    let film = |seed| shoot(&scene, &options(seed)).film;
    (0..SEEDS)
        .map(film)
        .map(|film| (film.mean(), film.variance()))
        .collect()
}

/// Moments over renders of each pixel's mean.
fn means(renders: &[(Vec<f32>, Vec<f32>)]) -> Vec<Moments> {
    let pixels = 0..renders[0].0.len();
    let moments = pixels.map(|i| {
        let mut moments = Moments::default();
        renders.iter().for_each(|r| moments.push(f64::from(r.0[i])));
        moments
    });
    moments.collect()
}

/// Excess of the reported variances over the variances of the means, over all pixels: relative to
/// the latter, and in standard errors.
fn excess(claims: &[(Vec<f32>, Vec<f32>)], renders: &[(Vec<f32>, Vec<f32>)]) -> (f64, f64) {
    let truth: f64 = means(renders).iter().map(Moments::variance).sum();
    let mut difference = Moments::default();
    let centres: Vec<f64> = means(renders).iter().map(Moments::mean).collect();
    let bessel = SEEDS as f64 / (SEEDS - 1) as f64;
    for (claim, render) in claims.iter().zip(renders) {
        let claimed: f64 = claim.1.iter().map(|v| f64::from(*v)).sum();
        let squares = render.0.iter().zip(&centres);
        let actual: f64 = squares.map(|(m, c)| (f64::from(*m) - c).powi(2)).sum();
        difference.push(claimed - bessel * actual);
    }
    (difference.mean() / truth, difference.z(0.0))
}

#[test]
fn errors_are_what_they_claim_and_means_agree() {
    claims_are_true(path_tracer(), (EIGHT, SAMPLES));
    claims_are_true(path_tracer(), (Replicates::new(64).unwrap(), 192));
}

/// Subpaths from emitters are independent of one another, and of the sensor's subpaths.
#[test]
fn so_they_are_with_subpaths_from_both_ends() {
    claims_are_true(bdpt(), (EIGHT, SAMPLES));
}

fn claims_are_true(integrator: Integrator, (replicates, samples): (Replicates, u64)) {
    let (single, replicates) = (
        renders(integrator, Replicates::SINGLE, samples),
        renders(integrator, replicates, samples),
    );
    let zs = [(&single, &single), (&replicates, &replicates)].map(|(a, b)| excess(a, b).1);
    max_abs_z(&zs, FALSE_ALARM).unwrap();
    // Check the power of the test: counted as independent samples, replicates would report the
    // variances of independent renders.
    let (ratio, z) = excess(&single, &replicates);
    assert!(ratio > 0.3 && z > 8.0, "{ratio} {z}");
    // The means are unbiased, too.
    let pairs = means(&single).into_iter().zip(means(&replicates));
    let zs = pairs.map(|(a, b)| {
        let variance = (a.variance() + b.variance()) / SEEDS as f64;
        (a.mean() - b.mean()) / variance.sqrt()
    });
    max_abs_z(&zs.collect::<Vec<_>>(), FALSE_ALARM).unwrap();
}

/// A part contains the replicates that begin in its range.
#[test]
fn parts_in_any_order_are_the_whole() {
    let scene = scene();
    for integrator in [path_tracer(), bdpt()] {
        let whole = shoot(&scene, &options(integrator, 0..SAMPLES, 5)).film;
        assert_eq!(whole.counts(), [SAMPLES; 16]);
        for cuts in [&[0, 3, 8, 17, 18, 40][..], &[0, 24, 33]] {
            let parts = cuts.windows(2).map(|cut| {
                let scenes = std::slice::from_ref(&scene);
                let options = options(integrator, cut[0]..cut[1], 5);
                let mut state = State::new(scenes, &options);
                let handle = Handle::default();
                state.advance(scenes, &options, &handle, |_| ControlFlow::Continue(()));
                state
            });
            let mut parts: Vec<State> = parts.collect();
            let mut merged = parts.pop().unwrap();
            parts.iter().for_each(|part| merged.merge(part).unwrap());
            assert_eq!(merged.film(), &whole);
        }
    }
}

#[test]
fn a_render_that_goes_on_is_the_whole_on_any_number_of_threads() {
    let scenes = [scene()];
    let target = Some(Target {
        error: 0.01,
        measure: Measure::Image,
    });
    let targeted = RenderOptions {
        target,
        ..options(path_tracer(), 0..1 << 12, 5)
    };
    let [path, both] = [path_tracer(), bdpt()].map(|i| options(i, 0..SAMPLES, 5));
    for options in [path, both, targeted] {
        let whole = shoot(&scenes[0], &options);
        assert_eq!(whole.reached, options.target.is_some());
        let state = in_passes(&scenes, &options);
        assert_eq!(state.film(), &whole.film);
    }
}

/// Layers and strategies of replicates add up to the image, to the rounding of single precision in
/// some dozens of means, and have equal numbers of samples.
#[test]
fn parts_of_light_are_in_replicates_too() {
    let rendering = shoot(&scene(), &options(bdpt(), 0..SAMPLES, 5));
    let image = rendering.film.mean();
    let films = rendering.strategies.iter().map(|s| &s.weighted);
    for film in films.clone() {
        assert_eq!(film.counts(), [SAMPLES; 16]);
    }
    let by_strategy = films.map(Film::mean).collect::<Vec<_>>();
    let slots = rendering.film.layers().unwrap().decomposition().layers();
    let by_layer = (0..slots).map(|layer| rendering.film.layer_mean(layer));
    for parts in [by_strategy, by_layer.collect()] {
        for (i, whole) in image.iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part[i]).sum();
            assert!((sum - whole).abs() < 1e-5 * whole, "{sum} {whole}");
        }
    }
}

/// Samples of estimators whose paths from emitters contribute to many pixels stay single.
#[test]
fn other_estimators_take_single_samples() {
    let particle = Integrator::Particle(ParticleTracer {
        max_depth: None,
        rr_depth: 5,
    });
    let [single, replicates] = [Replicates::SINGLE, EIGHT].map(|replicates| {
        let options = RenderOptions {
            replicates,
            ..RenderOptions::new(particle, 8, 5)
        };
        shoot(&scene(), &options).film
    });
    assert_eq!(single, replicates);
}
