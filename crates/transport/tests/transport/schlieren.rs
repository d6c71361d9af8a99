//! A knife edge in the focal plane turns deflections into brightness. Statistical tests with fixed
//! seeds; each comparison has a false-alarm rate of 6e-5 (four standard errors).

use crate::common::{container, fog, parts, path_tracer, shoot_by, sky, vacuum};
use eikonal::field::{Gaussian, Luneburg};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::medium::Medium;
use morgana_transport::scene::Object;
use morgana_transport::sensor::{ApertureStop, Sensor, Telecentric};
use morgana_transport::shape::{Rectangle, Shape, Sphere};
use std::f64::consts::{PI, TAU};

/// Distance of the source, which makes its rays nearly parallel.
const FAR_DISTANCE: f64 = 1e4;
/// Half-angle that the source subtends.
const HALF: f64 = 4e-3;
const STOP: f64 = 8e-3;

fn ball(radius: f64) -> Shape {
    Sphere::new(DAffine3::from_scale(DVec3::splat(radius)))
        .unwrap()
        .into()
}

/// A sensor at z = −5 that looks along +z and is in focus at the origin.
fn sensor(aspect: f64, stop: ApertureStop) -> Sensor {
    let map = DAffine3::from_mat3_translation(DMat3::IDENTITY, DVec3::NEG_Z * 5.0);
    Sensor::Telecentric(Telecentric::new(map, aspect, 5.0, stop))
}

/// A square source of radiance 1 that faces −z.
fn source() -> Object {
    let map = DAffine3::from_scale_rotation_translation(
        DVec3::splat(HALF * FAR_DISTANCE),
        DQuat::from_rotation_y(PI),
        DVec3::Z * FAR_DISTANCE,
    );
    Object {
        name: "source".into(),
        shape: Rectangle::new(map).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: Some(0),
    }
}

/// The edge covers slopes above zero along x. A pixel whose rays turn by ε along x sees the source
/// through slopes from −h − X/R − ε to 0. Its brightness is proportional to h + X/R + ε, with ε =
/// −√(2π) Δ b e^(−b²/2w²)/w behind a weak Gaussian bump at X = b.
#[test]
fn brightness_is_proportional_to_the_deflection() {
    const PIXELS: usize = 16;
    let (delta, w) = (1e-3, 0.4);
    let bump = Gaussian::new(1.0, delta, DVec3::ZERO, w).unwrap();
    let media = vec![vacuum(), Medium::transparent("bump", bump)];
    let emitter = Emitter::Area {
        object: 1,
        radiance: Spectrum::ONE,
    };
    let objects = vec![container(ball(3.0), Bsdf::Null), source()];
    let stop = ApertureStop::with_knife(STOP, DVec2::X, 0.0);
    let sensor = sensor(PIXELS as f64, stop);
    let mut parts = parts(objects, media, vec![emitter], sensor);
    (parts.film.width, parts.film.height) = (PIXELS, 1);
    let rendering = shoot_by(path_tracer(), parts, 10_000, 3);
    // Fraction of the open half disc that shines through unbent rays.
    let unit = 2.0 * HALF * HALF / (0.5 * PI * STOP * STOP);
    let (mut ay, mut aa, mut variance) = (0.0, 0.0, 0.0);
    for (i, pixel) in rendering.film.pixels(0).enumerate() {
        let x = 1.0 - 2.0 * (i as f64 + 0.5) / PIXELS as f64;
        let deflection = -TAU.sqrt() * delta * x / w * (-x * x / (2.0 * w * w)).exp();
        let a = deflection / HALF;
        let y = pixel.mean()[0] / unit - 1.0 - x / (FAR_DISTANCE * HALF);
        let s2 = pixel.variance_of_mean()[0] / (unit * unit);
        // The mean over a pixel, and terms of Δ², cost 5e-3 of the largest contrast, 0.38.
        let z = (y - a) / (s2.sqrt() + 2e-3);
        assert!(z.abs() < 4.0, "pixel {i}: {y} for {a}");
        ay += a * y;
        aa += a * a;
        variance += a * a * s2;
    }
    let (slope, error) = (ay / aa, variance.sqrt() / aa);
    assert!(error < 0.02, "{error}");
    assert!((slope - 1.0).abs() < 4.0 * error, "{slope} ± {error}");
}

/// Paths have equal contributions from either end.
#[test]
fn estimators_agree() {
    let media = |albedo: f64| {
        let lens = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
        vec![vacuum(), fog(lens, 1.0, albedo, 0.3)]
    };
    let render = |emitter: Emitter, albedo: f64, integrator: Integrator, samples: u64| {
        let stop = ApertureStop::with_knife(0.3, DVec2::new(1.0, 1.0), 0.1);
        let objects = vec![container(ball(1.0), Bsdf::Null)];
        let parts = parts(objects, media(albedo), vec![emitter], sensor(1.0, stop));
        shoot_by(integrator, parts, samples, 7).film.summary()
    };
    let light = |integrator: Integrator, samples: u64| {
        let light = Emitter::Point {
            position: DVec3::new(0.0, 2.0, 1.0),
            intensity: Spectrum::splat(10.0),
        };
        render(light, 0.9, integrator, samples)
    };
    let (particle, bdpt) = (
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    );
    let compare = |a: (f64, f64), b: (f64, f64)| {
        let z = (a.0 - b.0) / a.1.hypot(b.1);
        assert!(a.1 < 0.02 * a.0 && b.1 < 0.02 * b.0, "{a:?} {b:?}");
        assert!(z.abs() < 4.0, "{a:?} {b:?}");
    };
    compare(light(path_tracer(), 600), light(particle, 8000));
    compare(light(path_tracer(), 600), light(bdpt, 600));
    // A furnace: radiance 1 wherever the camera looks.
    let (mean, error) = render(sky(), 1.0, bdpt, 200);
    assert!(
        error < 0.02 && (mean - 1.0).abs() < 4.0 * error + 1e-9,
        "{mean} ± {error}"
    );
}
