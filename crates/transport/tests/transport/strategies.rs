//! Single strategies of bidirectional path tracing, and renders that must be equal bit for bit.

use crate::common::{camera, container, fog, parts, sky, vacuum};
use eikonal::field::Gaussian;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::film::Film;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::{RenderOptions, Rendering, render};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Rectangle, Shape, Sphere};
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;
use testkit::Family;
use testkit::batches::{moments, welch};

/// False-alarm rate of each test of means, over all its comparisons.
const RATE: f64 = 1e-3;
const BATCHES: u64 = 12;

/// A black emitter, the second object of a scene and its first emitter.
fn light(shape: impl Into<Shape>) -> (Object, Emitter) {
    let light = Object {
        name: "light".into(),
        shape: shape.into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: Some(0),
    };
    let emitter = Emitter::Area {
        object: 1,
        radiance: Spectrum::ONE,
    };
    (light, emitter)
}

/// A graded ball of fog beside a large emitter that shines along −y.
fn light_beside_fog() -> Parts {
    let index = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.4).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let to_world = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::X * 1.5, DVec3::Z * 1.5, -DVec3::Y),
        translation: DVec3::Y * 1.4,
    };
    let (light, emitter) = light(Rectangle::new(to_world).unwrap());
    let sensor = camera(DVec3::new(0.0, -0.4, 3.0), DVec3::ZERO);
    let media = vec![vacuum(), fog(index, 1.0, 0.9, 0.3)];
    parts(vec![ball, light], media, vec![emitter], sensor)
}

fn options(integrator: Integrator, samples: u64, seed: u64) -> RenderOptions {
    RenderOptions {
        strategies: true,
        ..RenderOptions::new(integrator, samples, seed)
    }
}

fn shoot(parts: &Parts, options: &RenderOptions) -> Rendering {
    let scene = Scene::new(parts.clone()).unwrap();
    render(&[scene], options, |_| ControlFlow::Continue(()))
}

fn image_mean(film: &Film) -> f64 {
    let pixels = film.pixels(0);
    let count = pixels.len() as f64;
    pixels.map(|p| p.mean()[0]).sum::<f64>() / count
}

fn bdpt(max_depth: Option<u32>) -> Integrator {
    Integrator::Bdpt(Bdpt {
        max_depth,
        ..Bdpt::default()
    })
}

/// Three strategies find single scattering, each completely on its own.
#[test]
fn three_strategies_find_the_same_single_scattering() {
    let parts = light_beside_fog();
    let wanted = [(0, 3), (1, 2), (2, 1)];
    let mut means = vec![Vec::new(); 3];
    for batch in 0..BATCHES {
        let rendering = shoot(&parts, &options(bdpt(Some(2)), 320, 100 + batch));
        for (mean, key) in means.iter_mut().zip(wanted) {
            let image = rendering.strategies.iter().find(|i| (i.s, i.t) == key);
            mean.push(image_mean(&image.unwrap().unweighted));
        }
    }
    for (mean, key) in means.iter().zip(wanted) {
        let m = moments(mean);
        println!("{key:?}: {} ± {}", m.mean(), m.standard_error());
        assert!(m.standard_error() < 0.03 * m.mean());
    }
    let mut family = Family::new(RATE);
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let name = format!("{:?} and {:?}", wanted[a], wanted[b]);
        family.push(name, welch(&means[a], &means[b], 0.0));
    }
    family.check().unwrap();
}

/// For any weights, the image is the sum of the strategies' shares, and no strategy contributes
/// more than it finds.
#[test]
fn weighted_images_add_up() {
    let rendering = shoot(&light_beside_fog(), &options(bdpt(None), 16, 3));
    let image = rendering.film.pixels(0);
    assert!(rendering.strategies.len() > 6);
    // Only hits find a visible emitter.
    assert!(rendering.strategies.iter().all(|i| (i.s, i.t) != (1, 1)));
    for (i, pixel) in image.enumerate() {
        let share = |s: &morgana_transport::render::StrategyImage| {
            s.weighted.pixels(0).nth(i).unwrap().mean()[0]
        };
        let sum: f64 = rendering.strategies.iter().map(share).sum();
        assert!(
            (sum - pixel.mean()[0]).abs() < 1e-12 * (1.0 + sum),
            "pixel {i}"
        );
        for s in &rendering.strategies {
            let found = s.unweighted.pixels(0).nth(i).unwrap().mean()[0];
            assert!(share(s) <= found * (1.0 + 1e-12));
        }
    }
}

fn both() -> [Integrator; 2] {
    let particle = Integrator::Particle(ParticleTracer::default());
    [particle, bdpt(None)]
}

/// A scene in which connections search for further branches.
fn lens() -> Parts {
    let mut parts = light_beside_fog();
    let index = Gaussian::new(1.0, 0.5, DVec3::ZERO, 0.25).unwrap();
    parts.media[1] = fog(index, 1.0, 0.9, 0.3);
    parts.emitters.push(sky());
    parts
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    for integrator in both() {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let run = || shoot(&lens(), &options(integrator, 12, 5));
            pool.build().unwrap().install(run)
        };
        let one = with(1);
        assert!(one.stats.connections.searches > 0);
        for threads in [2, 5] {
            let many = with(threads);
            assert_eq!(one.film, many.film);
            assert_eq!(one.stats, many.stats);
            for (a, b) in one.strategies.iter().zip(&many.strategies) {
                assert_eq!((&a.weighted, &a.unweighted), (&b.weighted, &b.unweighted));
            }
        }
    }
}

/// An interrupted render equals a render of equally many samples, however these were divided into
/// passes.
#[test]
fn results_do_not_depend_on_passes() {
    for integrator in both() {
        let scene = [Scene::new(lens()).unwrap()];
        let long = options(integrator, 40, 6);
        let stopped = render(&scene, &long, |progress| {
            if progress.done >= 9 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        let short = shoot(&lens(), &options(integrator, stopped.samples, 6));
        assert!(stopped.samples >= 9);
        assert_eq!(stopped.film, short.film);
        assert_eq!(stopped.stats, short.stats);
    }
}
