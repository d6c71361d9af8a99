//! Invariants of every scene: unpolarised light from all around stays unpolarised, degrees of
//! polarisation are at most one, and intensities agree with scalar renders.

use crate::polarization::{polarized, stokes};
use eikonal::field::{Constant, Field, Gaussian, Luneburg};
use glam::DVec3;
use morgana_transport::bsdf::{Bsdf, Conductor, Dielectric, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::PathTracer;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::render::RenderOptions;
use morgana_transport::scene::{Object, SceneBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Sphere;
use morgana_transport::{Scene, Spectrum};

/// A ball of haze that bends rays, in front of a small ball.
fn ball(index: impl Into<Field>, phase: Phase, wall: Bsdf, small: Bsdf) -> SceneBuilder {
    let sphere = |x: DVec3, r| Sphere::around(x, r).unwrap();
    let haze = Medium::homogeneous("haze", index, 1.0, 1.0).with_phase(phase);
    Scene::builder()
        .film(8, 8)
        .channels(2)
        .camera(Camera::perspective([0.5, 0.3, -4.0], [0.2, 0.0, 0.0], 40.0))
        .medium(haze)
        .object(
            Object::builder("ball", sphere(DVec3::ZERO, 1.0))
                .bsdf(wall)
                .interior("haze"),
        )
        .object(Object::builder("small", sphere(DVec3::X * 1.8, 0.7)).bsdf(small))
}

fn glass() -> Bsdf {
    Bsdf::Dielectric(Dielectric::default())
}

fn gold() -> Bsdf {
    let (eta, k) = (
        Spectrum([0.2, 1.3, 0.0, 0.0]),
        Spectrum([3.4, 1.8, 0.0, 0.0]),
    );
    Bsdf::Conductor(Conductor::new(eta, k, Spectrum::ONE).unwrap())
}

fn grey() -> Bsdf {
    Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.5)).unwrap())
}

/// In the furnace, refraction and scattering cancel the polarisation by reflection. |z| < 4.9 for
/// 96 comparisons: a false-alarm rate of 1e-4.
#[test]
fn light_from_all_around_stays_unpolarised() {
    let index = Gaussian::new(1.4, 0.2, DVec3::X * 0.2, 0.3).unwrap();
    let scene = ball(index, Phase::rayleigh(), glass(), Bsdf::Null);
    let scene = scene
        .emitter(Emitter::constant(1.0))
        .film(4, 4)
        .channels(2)
        .build()
        .unwrap();
    let rendering = polarized(&scene, None, 4096, 2);
    let mut errors = 0.0;
    for pixel in 0..16 {
        for parameter in 1..4 {
            for channel in 0..2 {
                let mean = rendering.film.mean_at(Some(parameter), channel, pixel);
                let error = rendering
                    .film
                    .variance_at(Some(parameter), channel, pixel)
                    .sqrt();
                assert!(
                    mean.abs() < 4.9 * error + 1e-6,
                    "{pixel} {parameter}: {mean} ± {error}"
                );
                errors += error / 96.0;
            }
        }
        let first = rendering.film.mean_at(Some(0), 0, pixel);
        let error = rendering.film.variance_at(Some(0), 0, pixel).sqrt();
        assert!(
            (first - 1.0).abs() < 4.9 * error + 1e-5,
            "{first} ± {error}"
        );
    }
    assert!(errors > 1e-3 && errors < 0.02, "{errors}");
}

/// Each contribution is a valid Stokes vector, and so are sums of them.
#[test]
fn degrees_of_polarisation_are_at_most_one() {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.2).unwrap();
    let phase = Phase::blend(
        [Phase::rayleigh(), Phase::henyey_greenstein(0.6).unwrap()],
        0.3,
    );
    let bulb = Emitter::point([0.0, 3.0, -1.0], 60.0);
    let scene = ball(index, phase.unwrap(), glass(), gold()).emitter(bulb);
    let scene = scene.emitter(Emitter::constant(0.1)).build().unwrap();
    let rendering = polarized(&scene, Some(8), 16, 3);
    let mut most = 0.0f32;
    for channel in 0..2 {
        for pixel in 0..64 {
            let [i, q, u, v] =
                std::array::from_fn(|k| rendering.film.mean_at(Some(k), channel, pixel));
            let degree = (q * q + u * u + v * v).sqrt() / i;
            assert!(degree < 1.0 + 1e-5, "{pixel} {channel}: {degree}");
            most = most.max(degree);
        }
    }
    assert!(most > 0.2, "{most}");
}

/// Without polarising elements, the first parameter is the scalar render bit for bit, and the
/// others vanish.
#[test]
fn without_polarisation_nothing_changes() {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.2).unwrap();
    let phase = Phase::henyey_greenstein(0.6).unwrap();
    let scene = ball(index, phase, Bsdf::Null, grey());
    let scene = scene
        .emitter(Emitter::point([0.0, 3.0, -1.0], 60.0))
        .build()
        .unwrap();
    let with = polarized(&scene, Some(6), 8, 4);
    let path = PathTracer {
        max_depth: Some(6),
        rr_depth: 50,
    };
    let without = scene.render(&RenderOptions::new(path, 8, 4));
    assert_eq!(with.film.mean(), without.film.mean());
    assert_eq!(with.film.layer_mean(0), without.film.mean());
    for layer in 1..4 {
        assert!(with.film.layer_mean(layer).iter().all(|v| *v == 0.0));
    }
}

/// Scalar renders of Rayleigh scattering are right for light that is scattered once.
#[test]
fn single_scattering_has_the_scalar_intensity() {
    let scene = ball(
        Constant::new(1.0),
        Phase::rayleigh(),
        Bsdf::Null,
        Bsdf::Null,
    );
    let scene = scene
        .emitter(Emitter::point([0.0, 3.0, -1.0], 60.0))
        .build()
        .unwrap();
    let with = polarized(&scene, Some(2), 8, 4);
    let path = PathTracer {
        max_depth: Some(2),
        rr_depth: 50,
    };
    let without = scene.render(&RenderOptions::new(path, 8, 4));
    for (a, b) in with.film.mean().iter().zip(without.film.mean()) {
        assert!((a - b).abs() <= 1e-6 * b, "{a} {b}");
    }
    let [i, q, u, v] = stokes(&with);
    assert!(i == 0.0 || (q.hypot(u) > 0.0 && v.abs() < 1e-6 * i));
}
