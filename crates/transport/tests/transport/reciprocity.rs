//! Reciprocity: a point light at y and a pinhole at x change places.
//!
//! By docs/theory.md#densities-of-edges the fluence at x of a point light of intensity I at y is φ
//! = ∫ L dω = K(x, y) I/n(y)². K sums products of T/B over edges and of κ over vertices, which are
//! all symmetric. n(x)² of the sensor cancels n(x)² of the first edge, dω = dA/(B n(x)²). Hence φ(x
//! ← y) n(y)² = φ(y ← x) n(x)². The fluence is summed over pixels with their solid angles;
//! everything that scatters is in view.
//!
//! False-alarm rate: 1e-3 for the whole file.

use crate::common::{Batches, container, fog, glass, parts, path_tracer, vacuum};
use eikonal::Field;
use eikonal::field::LinearIndex;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::render::Rendering;
use morgana_transport::scene::{Object, Parts, Sides};
use morgana_transport::sensor::{Perspective, Sensor};
use morgana_transport::shape::Sphere;
use testkit::Family;
use testkit::batches::{moments, welch};

const RATE: f64 = 1e-3;
const BATCHES: u64 = 10;
const PIXELS: usize = 12;
const HALF: f64 = 0.5;

fn index(n: f64) -> Field {
    LinearIndex::new(n, DVec3::X * 0.1, DVec3::ZERO)
        .unwrap()
        .into()
}

/// A ball of fog inside a larger graded ball that contains light and sensor.
fn scene(wall: Bsdf, jump: f64, sensor: DVec3, light: DVec3) -> Parts {
    let outer = container(Sphere::around(DVec3::ZERO, 2.5).unwrap(), Bsdf::Null);
    let inner = Object {
        sides: Some(Sides {
            interior: 2,
            exterior: 1,
        }),
        ..container(Sphere::around(DVec3::ZERO, 0.6).unwrap(), wall)
    };
    let direction = -sensor.normalize();
    let left = DVec3::Y.cross(direction).normalize();
    let to_world = DAffine3 {
        matrix3: DMat3::from_cols(left, direction.cross(left), direction),
        translation: sensor,
    };
    let fov = 2.0 * HALF.atan();
    let emitter = Emitter::Point {
        position: light,
        intensity: Spectrum::ONE,
    };
    let clear = fog(index(1.3), 0.0, 0.0, 0.0);
    let media = vec![vacuum(), clear, fog(index(1.3 + jump), 2.0, 0.9, 0.3)];
    let sensor = Sensor::Perspective(Perspective::new(to_world, fov, 1.0));
    let mut parts = parts(vec![outer, inner], media, vec![emitter], sensor);
    parts.film.width = PIXELS;
    parts.film.height = PIXELS;
    parts.reflections = 2;
    parts
}

/// ∫ L dω over the image.
fn fluence(rendering: &Rendering) -> f64 {
    let side = 2.0 * HALF / PIXELS as f64;
    let at = |i: usize| side * (i as f64 + 0.5) - HALF;
    let pixels = rendering.film.pixels(0).enumerate();
    pixels
        .map(|(i, pixel)| {
            let (a, b) = (at(i % PIXELS), at(i / PIXELS));
            pixel.mean()[0] * side * side * (1.0 + a * a + b * b).powf(-1.5)
        })
        .sum()
}

#[test]
fn light_and_sensor_change_places() {
    let x = DVec3::new(1.6, 0.3, 0.9);
    let y = DVec3::new(-1.3, 0.9, 0.8);
    let squared = |x: DVec3| index(1.3).n(x).powi(2);
    assert!(squared(x) / squared(y) > 1.4);
    let estimators = [
        (path_tracer(), 8),
        (Integrator::Particle(ParticleTracer::default()), 48),
        (Integrator::Bdpt(Bdpt::default()), 6),
    ];
    let mut family = Family::new(RATE);
    for (name, wall, jump) in [("matched", Bsdf::Null, 0.0), ("glass", glass(), 0.2)] {
        for (k, (integrator, samples)) in estimators.into_iter().enumerate() {
            let reading = |sensor: DVec3, light: DVec3, seed: u64| -> Vec<f64> {
                let parts = scene(wall.clone(), jump, sensor, light);
                let all = Batches::new(integrator, parts, seed + k as u64);
                let fluence = |batch| fluence(&all.render(batch, samples));
                let batches = (0..BATCHES).map(fluence);
                batches.map(|fluence| fluence * squared(light)).collect()
            };
            let there = reading(x, y, 1000);
            let back = reading(y, x, 2000);
            let (a, b) = (moments(&there), moments(&back));
            let label = format!("{name}, {}", integrator.name());
            println!(
                "{label}: {:.5} ± {:.5}, back {:.5} ± {:.5}",
                a.mean(),
                a.standard_error(),
                b.mean(),
                b.standard_error()
            );
            assert!(
                a.standard_error() < 0.05 * a.mean(),
                "too noisy to show anything"
            );
            family.push(label, welch(&there, &back, 1e-4));
        }
    }
    family.check().unwrap();
}
