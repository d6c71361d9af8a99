//! Slabs with published or exact results.
//!
//! A sensor at normal incidence receives light from a slab under uniform light from one side. By
//! reciprocity, its radiance is the slab's reflectance or transmittance for a pencil beam along the
//! sensor's axis. Each z-test is at |z| < 4, a false-alarm rate of 6e-5; there are five.

use crate::common::{camera, container, estimate, fog, glass, parts, vacuum};
use eikonal::Field;
use eikonal::field::{Constant, LinearIndex};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{Emitter, Environment};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::SensorRay;
use morgana_transport::shape::{Cube, Rectangle, Shape};
use morgana_transport::{Orientation, Scene, Spectrum};
use std::f64::consts::PI;

fn check(name: &str, (mean, error): (f64, f64), exact: f64) {
    println!("{name}: {mean} ± {error}, expected {exact}");
    assert!(
        (mean - exact).abs() < 4.0 * error,
        "{name}: {mean} ± {error}, expected {exact}"
    );
    assert!(error < 0.01 * exact, "{name}: too noisy to say anything");
}

/// The cube, `width` wide, between two planes of constant z.
fn slab(width: f64, z: [f64; 2]) -> Cube {
    let half = DVec3::new(0.5 * width, 0.5 * width, 0.5 * (z[1] - z[0]));
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(half),
        translation: DVec3::Z * (0.5 * (z[0] + z[1])),
    };
    Cube::new(to_world).unwrap()
}

/// Number of pixel rows of the half sky. The middle two rows are 1.6 mrad apart; the radiance fades
/// between them.
const ROWS: usize = 2000;

/// Radiance 1 from directions with z > 0, or with z < 0.
fn half_sky(above: bool) -> Emitter {
    let lit = |row: usize| (row < ROWS / 2) == above;
    let pixels = (0..ROWS).map(|row| Spectrum::splat(if lit(row) { 1.0 } else { 0.0 }));
    let y_is_up = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
    let (y_is_up, _) = Orientation::nearest(y_is_up).unwrap();
    Emitter::Environment(Environment::image(1, ROWS, pixels.collect(), y_is_up).unwrap())
}

fn at_normal_incidence(parts: Parts, samples: u64, seed: u64) -> (f64, f64) {
    let scene = Scene::new(parts).unwrap();
    let ray = SensorRay {
        origin: DVec3::Z * 2.0,
        direction: -DVec3::Z,
    };
    estimate(&scene, (samples, seed), |_| (ray, 1.0))
}

/// van de Hulst 1980; Wang, Jacques and Zheng, "MCML", 1995, table 1; here to six digits from
/// adding-doubling: albedo 0.9, g = 0.75, optical thickness 2, no index mismatch.
#[test]
fn mcml_matched_slab() {
    let scene = |above| {
        parts(
            vec![container(slab(1e4, [-0.02, 0.0]), Bsdf::Null)],
            vec![vacuum(), fog(Constant::new(1.0), 100.0, 0.9, 0.75)],
            vec![half_sky(above)],
            camera(DVec3::Z * 2.0, DVec3::ZERO),
        )
    };
    check(
        "reflectance",
        at_normal_incidence(scene(true), 150_000, 1),
        0.097395,
    );
    check(
        "transmittance",
        at_normal_incidence(scene(false), 30_000, 2),
        0.660958,
    );
}

/// Giovanelli 1955; MCML, table 2; here to six digits from H functions: a half space of index 1.5,
/// albedo 0.9, isotropic, represented by a hundred mean free paths.
#[test]
fn mcml_mismatched_half_space() {
    let scene = parts(
        vec![container(slab(1e4, [-1.0, 0.0]), glass())],
        vec![vacuum(), fog(Constant::new(1.5), 100.0, 0.9, 0.0)],
        vec![half_sky(true)],
        camera(DVec3::Z * 2.0, DVec3::ZERO),
    );
    check(
        "reflectance",
        at_normal_incidence(scene, 60_000, 3),
        0.259919,
    );
}

/// A black plate at height `z` that radiates n² times as much as a plate of emissive power `m` in
/// vacuum.
fn plate(z: f64, up: bool, emitter: usize) -> Object {
    let turn = if up { 1.0 } else { -1.0 };
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::new(100.0, 100.0 * turn, turn)),
        translation: DVec3::Z * z,
    };
    Object {
        name: "plate".into(),
        shape: Shape::from(Rectangle::new(to_world).unwrap()),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: Some(emitter),
    }
}

/// A graded, transparent slab between black plates (docs/theory.md#radiance): only the fraction
/// n_min²/n² of the flux from the optically denser plate can reach the other plate.
#[test]
fn graded_slab_between_black_plates() {
    let (low, high) = (1.2, 1.5);
    let index: Field = LinearIndex::new(low, DVec3::Z * (high - low), DVec3::ZERO)
        .unwrap()
        .into();
    let (m_low, m_high) = (1.0, 0.3);
    let radiance = |n: f64, m: f64| Spectrum::splat(n * n * m / PI);
    let emitters = vec![
        Emitter::Area {
            object: 1,
            radiance: radiance(low, m_low),
        },
        Emitter::Area {
            object: 2,
            radiance: radiance(high, m_high),
        },
    ];
    let objects = vec![
        container(slab(210.0, [-0.1, 1.1]), Bsdf::Null),
        plate(0.0, true, 0),
        plate(1.0, false, 1),
    ];
    let media = vec![vacuum(), fog(index, 0.0, 0.0, 0.0)];
    let sensor = camera(DVec3::Z * 0.5, DVec3::ZERO);
    let scene = Scene::new(parts(objects, media, emitters, sensor)).unwrap();
    let irradiance = |z: f64, inward: f64, seed| {
        estimate(&scene, (20_000, seed), |sampler| {
            let d =
                morgana_transport::sampling::sphere::cosine_hemisphere_sample(sampler.next_2d());
            let ray = SensorRay {
                origin: DVec3::Z * z,
                direction: DVec3::new(d.x, d.y, d.z * inward),
            };
            (ray, PI)
        })
    };
    let shared = low * low;
    // The dense plate sees the other plate within a cone, and itself beyond the critical angle.
    let on_high = shared * m_low + (high * high - shared) * m_high;
    check("dense side", irradiance(1.0 - 1e-7, -1.0, 4), on_high);
    check_exact("thin side", irradiance(1e-7, 1.0, 5), shared * m_high);
}

/// Checks a value without noise: from the thin side every ray reaches the other plate.
fn check_exact(name: &str, (mean, error): (f64, f64), exact: f64) {
    println!("{name}: {mean} ± {error}, expected {exact}");
    assert!(
        (mean - exact).abs() < 1e-5 * exact + 4.0 * error,
        "{name}: {mean} ± {error}"
    );
}
