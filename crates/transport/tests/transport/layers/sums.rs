//! Sums of layers that must be equal to rounding, or bit for bit.

use super::{bins, estimators, means, shoot};
use crate::common::{camera, container, fog, glass, parts, sky, vacuum};
use eikonal::Field;
use eikonal::field::{Constant, Gaussian};
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::path::Workspace;
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::sampling::Sampler;
use morgana_transport::scene::Parts;
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;

/// A ball of fog, under a point light and a sky.
fn ball(index: impl Into<Field>, wall: Bsdf) -> Parts {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), wall);
    let light = Emitter::Point {
        position: DVec3::new(1.0, 1.5, 1.0),
        intensity: Spectrum::splat(60.0),
    };
    let mut parts = parts(
        vec![ball],
        vec![vacuum(), fog(index, 1.0, 0.9, 0.3)],
        vec![light, sky()],
        camera(DVec3::Z * 3.5, DVec3::ZERO),
    );
    parts.film.filter = morgana_transport::film::Filter::Tent { radius: 1.0 };
    parts
}

fn lens() -> Parts {
    ball(Gaussian::new(1.3, 0.3, DVec3::ZERO, 0.3).unwrap(), glass())
}

fn everything() -> Decomposition {
    Decomposition {
        length: bins(6.0, 0.5, 6),
        bounces: Some(2),
        emitters: Some(2),
        parts: None,
    }
}

#[test]
fn layers_add_up_to_the_image() {
    for integrator in estimators() {
        let rendering = shoot((integrator, everything()), &lens(), 24, 3);
        let film = &rendering.film;
        let layers = everything().layers();
        let planes: Vec<Vec<f32>> = (0..layers).map(|l| film.layer_mean(l)).collect();
        let lit = planes.iter().filter(|p| p.iter().any(|v| *v > 0.0)).count();
        assert!(lit > layers / 4, "{lit} of {layers} layers");
        let scale = film.summary().0;
        for (i, value) in film.mean().into_iter().enumerate() {
            let sum: f64 = planes.iter().map(|p| f64::from(p[i])).sum();
            let tolerance = 1e-6 * (f64::from(value) + scale);
            assert!((sum - f64::from(value)).abs() < tolerance, "{sum} {value}");
        }
        let sum: f64 = means(&rendering).iter().sum();
        // Rounding bound for a sum of 24 samples.
        let bound = 24.0 * 2f64.powi(-33);
        assert!((sum / scale - 1.0).abs() < bound, "{sum} {scale}");
    }
}

#[test]
fn layers_change_nothing_about_the_image() {
    for integrator in estimators() {
        let with = shoot((integrator, everything()), &lens(), 8, 4);
        let without = shoot((integrator, Decomposition::default()), &lens(), 8, 4);
        assert!(with.film.pixels(0).eq(without.film.pixels(0)));
        assert_eq!(with.film.summary(), without.film.summary());
        assert!(without.film.layers().is_none());
    }
}

/// A single bin that contains everything equals the image, including errors.
#[test]
fn one_layer_is_the_image() {
    let one = Decomposition {
        length: bins(0.0, 1e3, 1),
        ..Decomposition::default()
    };
    for integrator in estimators() {
        let film = shoot((integrator, one), &lens(), 16, 5).film;
        let (mean, error) = film.summary();
        let (layer_mean, layer_error) = film.layer_summary(0);
        assert!((layer_mean / mean - 1.0).abs() < 1e-12);
        assert!(
            (layer_error / error - 1.0).abs() < 1e-9,
            "{layer_error} {error}"
        );
        for (a, b) in film.layer_variance(0).iter().zip(film.variance()) {
            assert!((a - b).abs() <= 1e-5 * b, "{a} {b}");
        }
        assert_eq!(film.layer_summary(1).0 + film.layer_summary(2).0, 0.0);
    }
}

#[test]
fn layers_do_not_depend_on_threads_and_passes() {
    for integrator in estimators() {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let run = || shoot((integrator, everything()), &lens(), 10, 5).film;
            pool.build().unwrap().install(run)
        };
        let one = with(1);
        assert_eq!(one, with(2));
        assert_eq!(one, with(5));
        let options = RenderOptions {
            decomposition: everything(),
            ..RenderOptions::new(integrator, 40, 5)
        };
        let scene = [Scene::new(lens()).unwrap()];
        let stopped = render(&scene, &options, |progress| {
            if progress.done >= 5 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        let short = shoot((integrator, everything()), &lens(), stopped.samples, 5);
        assert_eq!(stopped.film, short.film);
    }
}

/// Light of some samples by number of bounces.
fn by_bounces(scene: &Scene, max_depth: Option<u32>) -> [f64; 4] {
    let tracer = PathTracer {
        max_depth,
        ..PathTracer::default()
    };
    let mut ws = Workspace::new(scene.tolerance());
    let mut found = Vec::new();
    for sample in 0..4096 {
        let mut sampler = Sampler::new(6, 0, sample);
        let ray = scene.sensor().ray(sampler.next_2d(), sampler.next_2d());
        let integrator = Integrator::Path(tracer);
        integrator.sample(scene, ray, 1, &mut sampler, &mut ws, &mut found);
    }
    let mut sums = [0.0; 4];
    for light in &found {
        if let Some(sum) = sums.get_mut(light.path.bounces as usize) {
            *sum += light.weighted()[0];
        }
    }
    sums
}

/// Without bent rays and pilots, the path tracer draws identical paths whatever the longest length.
/// A longest length cuts off light with more bounces, and nothing else.
#[test]
fn a_longest_path_leaves_out_more_bounces() {
    let mut parts = ball(Constant::new(1.0), Bsdf::Null);
    parts.emitters.remove(0);
    let scene = Scene::new(parts).unwrap();
    let all = by_bounces(&scene, None);
    for depth in 1..=4 {
        let cut = by_bounces(&scene, Some(depth as u32));
        assert_eq!(cut[..depth], all[..depth]);
        assert_eq!(cut[depth..], [0.0; 4][depth..]);
        assert!(all[depth - 1] > 0.0);
    }
}

/// Scaled layers of emitters add up to the image of scaled emitters.
#[test]
fn emitters_can_be_weighed_afterwards() {
    let by_emitter = Decomposition {
        emitters: Some(2),
        ..Decomposition::default()
    };
    let mut other = lens();
    other.emitters[0] = Emitter::Point {
        position: DVec3::new(1.0, 1.5, 1.0),
        intensity: Spectrum::splat(15.0),
    };
    other.emitters[1] = Emitter::Environment(morgana_transport::emitter::Environment::Constant(
        Spectrum::splat(2.0),
    ));
    // Compare means: the brightness of emitters determines how paths are sampled.
    for integrator in estimators() {
        let film = shoot((integrator, by_emitter), &lens(), 96, 7).film;
        let [(dim, dim_error), (bright, bright_error)] = [0, 1].map(|l| film.layer_summary(l));
        let (mean, error) = shoot((integrator, by_emitter), &other, 96, 8)
            .film
            .summary();
        let weighed = 0.25 * dim + 2.0 * bright;
        let error = error.hypot(0.25 * dim_error + 2.0 * bright_error);
        assert!(
            (weighed - mean).abs() < 4.4 * error,
            "{weighed} {mean} ± {error}"
        );
        assert!(error < 0.1 * mean, "{error} {mean}");
        assert!(dim > 0.05 * bright && bright > 0.05 * dim);
    }
}
