//! Renders that end once their measured error is small enough.
//!
//! The coverage test compares 100 renders with the true value. If errors were normal and stopping
//! caused no bias, 95 % of them would lie within two of their target errors; 86 % or fewer would
//! have a probability below 1e-3 (binomial). The reported errors show that renders do not stop far
//! too late.

use crate::common::{camera, container, fog, parts, path_tracer, sky, vacuum};
use eikonal::field::{Constant, Gaussian};
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::{Measure, RenderOptions, Rendering, Target, render};
use morgana_transport::scene::Parts;
use morgana_transport::shape::Sphere;
use std::ops::ControlFlow;

fn estimators() -> [Integrator; 3] {
    [
        path_tracer(),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    ]
}

/// A ball of fog under a sky, in a film of 4 × 4 pixels.
fn ball(bends: bool) -> Parts {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let medium = if bends {
        fog(
            Gaussian::new(1.0, 0.3, DVec3::ZERO, 0.3).unwrap(),
            1.0,
            0.7,
            0.3,
        )
    } else {
        fog(Constant::new(1.0), 1.0, 0.7, 0.3)
    };
    parts(
        vec![ball],
        vec![vacuum(), medium],
        vec![sky()],
        camera(DVec3::Z * 2.5, DVec3::ZERO),
    )
}

fn shoot(
    scene: &Scene,
    integrator: Integrator,
    target: Option<Target>,
    most: u64,
    seed: u64,
) -> Rendering {
    let options = RenderOptions {
        target,
        ..RenderOptions::new(integrator, most, seed)
    };
    render(std::slice::from_ref(scene), &options, |_| {
        ControlFlow::Continue(())
    })
}

fn target(error: f64, measure: Measure) -> Option<Target> {
    Some(Target { error, measure })
}

#[test]
fn a_stopped_render_is_a_render_of_as_many_samples() {
    let scene = Scene::new(ball(true)).unwrap();
    let targets = [(0.01, 0.05), (0.02, 0.1), (0.012, 0.06)];
    for (integrator, (image, pixel)) in estimators().into_iter().zip(targets) {
        for (error, measure) in [(image, Measure::Image), (pixel, Measure::Pixel)] {
            let wanted = target(error, measure);
            let with = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let run = || shoot(&scene, integrator, wanted, 1 << 14, 3);
                pool.build().unwrap().install(run)
            };
            let one = with(1);
            assert!(one.reached && one.samples > 40, "{error}: {}", one.samples);
            assert!(one.error(measure) <= error);
            assert_eq!(one.film, with(3).film);
            assert_eq!(
                one.film,
                shoot(&scene, integrator, None, one.samples, 3).film
            );
        }
    }
}

#[test]
fn samples_bound_a_render_with_a_target() {
    let scene = Scene::new(ball(false)).unwrap();
    let rendering = shoot(&scene, path_tracer(), target(1e-9, Measure::Image), 50, 1);
    assert_eq!((rendering.reached, rendering.samples), (false, 50));
    // The error of an image without light is unknown.
    let mut dark = ball(false);
    dark.emitters.clear();
    let scene = Scene::new(dark).unwrap();
    let rendering = shoot(&scene, path_tracer(), target(0.5, Measure::Image), 50, 1);
    assert!(!rendering.reached);
}

#[test]
fn stopped_renders_are_as_exact_as_they_claim() {
    const RENDERS: u64 = 100;
    let scene = Scene::new(ball(false)).unwrap();
    let truth = shoot(&scene, path_tracer(), None, 40_000, 99)
        .film
        .summary();
    for (integrator, wanted) in [(path_tracer(), 0.01), (estimators()[2], 0.01)] {
        assert!(truth.1 < 0.1 * wanted * truth.0);
        let (mut within, mut sum, mut samples) = (0, 0.0, 0);
        for seed in 0..RENDERS {
            let rendering = shoot(
                &scene,
                integrator,
                target(wanted, Measure::Image),
                1 << 14,
                seed,
            );
            let (mean, error) = rendering.film.summary();
            assert!(
                error > 0.6 * wanted * mean,
                "far too late: {}",
                rendering.samples
            );
            within += u64::from((mean / truth.0 - 1.0).abs() < 2.0 * wanted);
            sum += (mean / truth.0 - 1.0) / RENDERS as f64;
            samples += rendering.samples;
        }
        let spp = samples / RENDERS;
        println!("{within} of {RENDERS}, bias {sum:.1e}, {spp} spp");
        assert!(spp > 60, "the minimum decides: {spp}");
        assert!(
            within as f64 > 0.86 * RENDERS as f64,
            "{within} of {RENDERS}"
        );
    }
}
