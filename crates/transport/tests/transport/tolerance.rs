//! Accuracy of rays: a pilot loosens the tolerance as far as noise hides the error; without noise,
//! the scene's tolerance applies.
//!
//! Nothing here is a statistical test: all compared renders have common random numbers.

use crate::common::{self, camera, container, fog, parts, path_tracer, vacuum};
use eikonal::Tolerance;
use eikonal::field::{Constant, Field, Gaussian};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::{Measure, RenderOptions, Rendering, Target};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Perspective, Sensor};
use morgana_transport::shape::{Rectangle, Sphere};
use morgana_transport::{Bins, Scene, Spectrum};

const SAMPLES: u64 = 64;

/// A ball whose index varies beside the axis of the view, in fog or in clear matter.
fn ball(index: impl Into<Field>, sigma_t: f64, objects: Vec<Object>, sensor: Sensor) -> Parts {
    let ball = container(Sphere::around(DVec3::ZERO, 0.8).unwrap(), Bsdf::Null);
    let objects = std::iter::once(ball).chain(objects).collect();
    let media = vec![vacuum(), fog(index, sigma_t, 0.9, 0.3)];
    let mut parts = parts(objects, media, vec![common::sky()], sensor);
    (parts.film.width, parts.film.height) = (16, 16);
    parts
}

fn graded() -> Gaussian {
    Gaussian::new(1.0, 0.05, DVec3::X * 0.2, 0.4).unwrap()
}

fn foggy() -> Scene {
    let view = camera(DVec3::Z * 4.0, DVec3::ZERO);
    Scene::new(ball(graded(), 1.0, Vec::new(), view)).unwrap()
}

/// A black half plane behind the ball. Its edge is in the middle of a view so narrow that a small
/// error of rays moves it out of view.
fn edge(aim: f64, tolerance: f64) -> Scene {
    let edge = Object {
        name: "edge".into(),
        shape: Rectangle::new(DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::new(5.0, 5.0, 1.0)),
            translation: DVec3::new(-5.0, 0.0, -3.0),
        })
        .unwrap()
        .into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: None,
    };
    let direction = DVec3::new(aim, 0.0, -1.0).normalize();
    let left = DVec3::Y.cross(direction).normalize();
    let to_world = DAffine3 {
        matrix3: DMat3::from_cols(left, direction.cross(left), direction),
        translation: DVec3::Z * 4.0,
    };
    let view = Sensor::Perspective(Perspective::new(to_world, 1e-6, 1.0));
    let mut parts = ball(graded(), 0.0, vec![edge], view);
    parts.tolerance = Tolerance::new(tolerance);
    Scene::new(parts).unwrap()
}

fn options(integrator: Integrator, loosens_tolerance: bool) -> RenderOptions {
    RenderOptions {
        loosens_tolerance,
        ..RenderOptions::new(integrator, SAMPLES, 5)
    }
}

/// Mean over pixels of the absolute difference between two images, in standard errors of one of
/// them.
fn difference(a: &Rendering, b: &Rendering) -> f64 {
    let (errors, pairs) = (
        a.film.variance(),
        a.film.mean().into_iter().zip(b.film.mean()),
    );
    let all: Vec<f64> = pairs
        .zip(errors)
        .filter(|((a, b), v)| a != b || *v > 0.0)
        .map(|((a, b), v)| f64::from((a - b).abs()) / f64::from(v).sqrt())
        .collect();
    all.iter().sum::<f64>() / all.len() as f64
}

#[test]
fn rays_are_as_loose_as_noise_hides() {
    let scene = foggy();
    for integrator in [
        path_tracer(),
        Integrator::Bdpt(Bdpt::default()),
        Integrator::Particle(ParticleTracer::default()),
    ] {
        let [exact, loose] = [false, true].map(|l| scene.render(&options(integrator, l)));
        let default = Tolerance::default().get();
        assert_eq!(
            (exact.accuracy.tolerance, exact.accuracy.effect),
            (default, 0.0)
        );
        assert!(loose.accuracy.tolerance > default, "{}", integrator.name());
        let steps = |r: &Rendering| r.stats.work.evaluations as f64 / r.stats.paths as f64;
        assert!(
            steps(&loose) < 0.8 * steps(&exact),
            "{} {}",
            steps(&loose),
            steps(&exact)
        );
        let found = difference(&exact, &loose);
        assert!(found > 0.0 && found < 0.1, "{} {found}", integrator.name());
        assert!(loose.accuracy.effect_beside_noise(1024) <= 0.1);
    }
}

/// A displacement of rays that brings adjacent parts into the image has no noise to hide in.
#[test]
fn rays_are_exact_where_the_image_tells() {
    let exact = options(path_tracer(), false);
    let default = Tolerance::default().get();
    let mean = |aim, tolerance| edge(aim, tolerance).render(&exact).film.summary().0;
    let (mut low, mut high) = (-0.2, 0.2);
    assert!(mean(low, default) < 0.5 && mean(high, default) > 0.5);
    while high - low > 1e-8 {
        let aim = (low + high) / 2.0;
        if mean(aim, default) < 0.5 {
            low = aim;
        } else {
            high = aim;
        }
    }
    let [seen, moved] = [default, 1e-4].map(|tolerance| mean(low, tolerance));
    assert!(seen > 0.1 && seen < 0.9, "{seen}");
    assert!((seen - moved).abs() > 0.05, "{seen} {moved}");
    let rendering = edge(low, default).render(&options(path_tracer(), true));
    assert!(rendering.accuracy.tolerance < 1e-4);
}

/// Without bent rays nothing can be gained. Requested errors, and lengths that separate light, keep
/// the scene's tolerance.
#[test]
fn rays_are_exact_where_that_is_asked_for() {
    let straight = ball(
        Constant::new(1.0),
        1.0,
        Vec::new(),
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    );
    let straight = Scene::new(straight).unwrap();
    let (scene, loose) = (foggy(), options(path_tracer(), true));
    let length = Bins {
        min: 0.0,
        max: 10.0,
        count: 20,
    };
    let by_length = RenderOptions {
        decomposition: Decomposition {
            length: Some(length),
            ..Decomposition::default()
        },
        ..loose
    };
    let targeted = RenderOptions {
        target: Some(Target {
            error: 0.1,
            measure: Measure::Image,
        }),
        ..loose
    };
    for (scene, options) in [(&straight, loose), (&scene, by_length), (&scene, targeted)] {
        let tolerance = scene.render(&options).accuracy.tolerance;
        assert_eq!(tolerance, Tolerance::default().get());
    }
}
