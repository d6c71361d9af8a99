//! Sensors and lights in places where connections degenerate: images are finite, nothing panics,
//! and failed connections are counted.

use crate::common::{camera, container, fog, glass, parts, path_tracer, shoot_by, sky, vacuum};
use eikonal::Field;
use eikonal::field::{Constant, Fisheye, Luneburg};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::Rendering;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Orthographic, Sensor};
use morgana_transport::shape::{Rectangle, Sphere};

fn integrators() -> [Integrator; 3] {
    [
        path_tracer(),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    ]
}

fn ball(index: impl Into<Field>, sigma_t: f64, emitter: Emitter, sensor: Sensor) -> Parts {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let media = vec![vacuum(), fog(index, sigma_t, 0.9, 0.0)];
    parts(
        vec![container(ball, Bsdf::Null)],
        media,
        vec![emitter],
        sensor,
    )
}

fn point(position: DVec3) -> Emitter {
    Emitter::Point {
        position,
        intensity: Spectrum::ONE,
    }
}

fn beam(from: DVec3, direction: DVec3) -> Emitter {
    let profile = BeamProfile::Disc { radius: 0.5 };
    Emitter::Collimated(Collimated::new(from, direction, profile, Spectrum::ONE))
}

/// Asserts that every estimator's image is finite, and that no contribution was left out as not
/// finite.
fn check(name: &str, parts: &Parts) -> [Rendering; 3] {
    check_with(name, parts, 24)
}

fn check_with(name: &str, parts: &Parts, samples: u64) -> [Rendering; 3] {
    integrators().map(|integrator| {
        let rendering = shoot_by(integrator, parts.clone(), samples, 1);
        let by = integrator.name();
        for pixel in rendering.film.pixels(0) {
            assert!(pixel.mean().is_finite(), "{name} by {by}");
            assert!(pixel.mean()[0] >= 0.0, "{name} by {by}");
            assert_eq!(pixel.count, samples);
        }
        println!("{name} by {by}: {:?}", rendering.stats);
        assert_eq!(rendering.stats.not_finite, 0, "{name} by {by}");
        let c = rendering.stats.connections;
        let failed = c.not_converged + c.ray_lost + c.degenerate;
        assert_eq!(
            c.attempts,
            c.found + failed,
            "{name} by {by}: every attempt counts"
        );
        rendering
    })
}

#[test]
fn a_light_at_the_sensor() {
    for (name, at) in [
        ("outside", DVec3::Z * 3.0),
        ("in fog", DVec3::new(0.1, 0.2, 0.3)),
    ] {
        let lit = ball(Constant::new(1.2), 1.0, point(at), camera(at, DVec3::ZERO));
        check(name, &lit);
    }
}

#[test]
fn a_light_on_an_interface() {
    let index = Luneburg::new(1.2, DVec3::ZERO, 1.0).unwrap();
    for wall in [Bsdf::Null, glass()] {
        let sensor = camera(DVec3::Z * 3.0, DVec3::ZERO);
        let mut scene = ball(index, 1.0, point(DVec3::Z), sensor);
        scene.objects[0].bsdf = wall;
        scene.reflections = 1;
        check("light on a wall", &scene);
    }
}

/// All rays of the beam meet at the camera.
#[test]
fn a_sensor_at_a_focus() {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    for (name, at) in [
        ("at the pole", DVec3::Z),
        ("just inside", DVec3::Z * (1.0 - 1e-9)),
    ] {
        let scene = ball(
            index,
            0.5,
            beam(-DVec3::Z * 2.0, DVec3::Z),
            camera(at, DVec3::ZERO),
        );
        check(name, &scene);
    }
}

/// Every ray from the light passes through the camera, inside the lens and without fog.
#[test]
fn a_light_at_the_conjugate_of_the_sensor() {
    let index = Fisheye::new(2.0, DVec3::ZERO, 0.5).unwrap();
    let x = DVec3::new(0.3, 0.2, 0.35);
    let conjugate = -x * (0.25 / x.length_squared());
    for sigma_t in [0.0, 0.5] {
        let sensor = camera(x, conjugate);
        let parts = ball(index, sigma_t, point(conjugate), sensor);
        check_with("conjugate", &parts, 2);
    }
}

#[test]
fn a_light_on_a_diffuse_surface() {
    let mut scene = ball(
        Constant::new(1.1),
        0.5,
        point(DVec3::ZERO),
        camera(DVec3::Z * 3.0, DVec3::ZERO),
    );
    scene.objects.push(Object {
        name: "screen".into(),
        shape: Rectangle::new(DAffine3::from_mat3(DMat3::IDENTITY * 0.5))
            .unwrap()
            .into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.5)).unwrap()),
        sides: None,
        emitter: None,
    });
    check("light on a screen", &scene);
}

/// Parallel light and parallel views have no connection; the sensor's rays find directly visible
/// light.
#[test]
fn parallel_light_and_parallel_views() {
    let to_world = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z),
        translation: DVec3::Z * 3.0,
    };
    let sensor = || Sensor::Orthographic(Orthographic::new(to_world, 1.0));
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    check(
        "beam",
        &ball(index, 1.0, beam(-DVec3::Z * 2.0, DVec3::Z), sensor()),
    );
    let seen = check("sky", &ball(index, 0.0, sky(), sensor()));
    for rendering in seen {
        for pixel in rendering.film.pixels(0) {
            assert!((pixel.mean()[0] - 1.0).abs() < 1e-6);
        }
    }
}

/// Values beyond single precision are counted and left out, so that no pixel becomes infinite.
#[test]
fn light_too_bright_for_an_image() {
    let sensor = camera(DVec3::Z * 4.0, DVec3::ZERO);
    for (intensity, fits) in [(1e30, true), (1e60, false), (1e300, false)] {
        let light = Emitter::Point {
            position: DVec3::ZERO,
            intensity: Spectrum::splat(intensity),
        };
        for integrator in integrators() {
            let parts = ball(Constant::new(1.0), 1.0, light.clone(), sensor.clone());
            let rendering = shoot_by(integrator, parts, 24, 1);
            let by = integrator.name();
            assert!(rendering.film.mean().iter().all(|v| v.is_finite()), "{by}");
            assert_eq!(rendering.stats.not_finite == 0, fits, "{by}");
            assert_eq!(rendering.film.mean().iter().any(|v| *v > 0.0), fits, "{by}");
        }
    }
}
