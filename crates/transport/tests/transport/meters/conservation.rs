//! Conservation of power: emitted power is absorbed, escapes, is cut off or is lost.

use crate::meters::support::*;
use eikonal::field::{Constant, LinearIndex};
use glam::{DAffine3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Conductor, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::meter::{Coordinates, Estimator, Meter};
use morgana_transport::render::EnergyBalance;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Cube, Rectangle, Sphere};
use morgana_transport::volume::VolumeTexture;
use std::f64::consts::PI;
use testkit::z_test::max_abs_z;

/// An emitter over a graded ball of haze and a glass cube, with a grey floor and a golden wall.
pub fn room(channels: usize) -> Parts {
    let plain = |name: &str, to_world: DAffine3, bsdf: Bsdf| Object {
        name: name.into(),
        shape: Rectangle::new(to_world).unwrap().into(),
        bsdf,
        sides: None,
        emitter: None,
    };
    let floor = DAffine3::from_translation(DVec3::new(0.0, 0.0, -1.5))
        * DAffine3::from_scale(DVec3::splat(3.0));
    let wall = DAffine3::from_translation(DVec3::new(-2.5, 0.0, 0.0))
        * DAffine3::from_rotation_y(PI / 2.0)
        * DAffine3::from_scale(DVec3::splat(3.0));
    let light =
        DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.0)) * DAffine3::from_rotation_x(PI);
    let gold = Spectrum([0.9, 0.7, 0.3, 0.0]);
    let mut light = plain(
        "light",
        light,
        Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
    );
    light.emitter = Some(0);
    let index = LinearIndex::new(1.3, DVec3::X * 0.1, DVec3::ZERO).unwrap();
    let mut haze = fog(index, 1.0, 0.8, 0.5);
    haze.sigma_t = VolumeTexture::Uniform(Spectrum([1.0, 1.5, 2.0, 0.0]));
    let mut tinted = fog(Constant::new(1.5), 0.5, 0.0, 0.0);
    tinted.sigma_t = VolumeTexture::Uniform(Spectrum([0.1, 0.5, 1.0, 0.0]));
    let mut cube = container(
        Cube::new(scaled(DVec3::splat(0.5), DVec3::new(1.8, 0.0, 0.0))).unwrap(),
        glass(),
    );
    cube.sides = Some(morgana_transport::scene::Sides {
        interior: 2,
        exterior: 0,
    });
    let objects = vec![
        container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null),
        cube,
        light,
        plain(
            "floor",
            floor,
            Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.5)).unwrap()),
        ),
        plain(
            "wall",
            wall,
            Bsdf::Conductor(Conductor::new(Spectrum::ZERO, Spectrum::ONE, gold).unwrap()),
        ),
    ];
    let emitters = vec![
        Emitter::Area {
            object: 2,
            radiance: Spectrum([1.0, 0.8, 0.6, 0.0]),
        },
        Emitter::Point {
            position: DVec3::new(0.2, 0.1, -0.3),
            intensity: Spectrum([0.3, 0.3, 0.3, 0.0]),
        },
    ];
    let mut parts = parts(objects, vec![vacuum(), haze, tinted], emitters, nobody());
    parts.film.channels = channels;
    parts
}

fn total(balance: &EnergyBalance) -> f64 {
    let b = balance;
    b.media.mean + b.surfaces.mean + b.escaped.mean + b.cut.mean + b.lost.mean + b.residual.mean
}

#[test]
fn every_particle_is_accounted_for() {
    // Turn off roulette and spectral sampling, so that nothing is random in the balance.
    for max_depth in [None, Some(3)] {
        let mut options = options(5_000, 6);
        options.rr_depth = u32::MAX;
        options.max_depth = max_depth;
        let found = run(room(1), &[], &options);
        let b = &found.balance;
        // Rounding bound of sums.
        let bound = 2f64.powi(-33);
        assert!((total(b) / b.emitted - 1.0).abs() < bound, "{b:?}");
        assert!(
            b.residual.mean.abs() < bound * b.emitted && b.lost.mean == 0.0,
            "{b:?}"
        );
        for share in [b.media, b.surfaces, b.escaped] {
            assert!(share.mean > 0.05 * b.emitted, "{b:?}");
        }
        assert_eq!(b.cut.mean > 0.0, max_depth.is_some());
    }
}

#[test]
fn roulette_and_spectral_sampling_are_fair() {
    let found = run(room(3), &[], &options(particles(40_000), 7));
    let b = &found.balance;
    println!("{b:?}");
    assert!((total(b) / b.emitted - 1.0).abs() < 2f64.powi(-33));
    assert!(b.residual.error > 0.0);
    max_abs_z(&[b.residual.mean / b.residual.error], FAMILY).unwrap();
}

#[test]
fn what_meters_absorb_is_what_media_absorb() {
    // The box contains both media.
    let to_world = scaled(DVec3::new(4.0, 3.0, 3.0), DVec3::new(-1.2, -1.5, -1.5));
    let mut zs = Vec::new();
    for estimator in [Estimator::TrackLength, Estimator::Collision] {
        let mut meter = fluence(Coordinates::Cartesian, [1, 1, 1], to_world);
        meter.estimator = estimator;
        let found = run(
            room(1),
            &[Meter::Fluence(meter)],
            &options(particles(40_000), 8),
        );
        let absorbed = reading(&found, 0, "absorbed");
        let (mean, error) = (absorbed.mean[0] * 36.0, absorbed.error[0] * 36.0);
        let media = found.balance.media;
        println!("{mean} ± {error}, media {media:?}");
        match estimator {
            // Both use the same collisions.
            Estimator::Collision => assert!((mean / media.mean - 1.0).abs() < 1e-12),
            Estimator::TrackLength => zs.push((mean - media.mean) / error.hypot(media.error)),
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn what_a_closed_surface_lets_in_it_lets_out_or_keeps() {
    let parts = room(1);
    let meters: Vec<Meter> = (0..2)
        .map(|i| Meter::Irradiance(through(&parts.objects, i, [1, 1], false)))
        .collect();
    let mut options = options(5_000, 9);
    options.rr_depth = u32::MAX;
    let found = run(parts, &meters, &options);
    let [ball, cube] = [0, 1].map(|i| &reading(&found, i, "power").mean);
    let kept = (ball[1] - ball[0]) + (cube[1] - cube[0]);
    // The point light is inside the ball.
    let inside = 0.3 * 4.0 * PI;
    let media = found.balance.media;
    // Each particle starts in the ball or not; this choice is the only random part of the balance.
    let chance = 5.0 * media.error;
    println!("{kept} + {inside}, media {media:?}");
    assert!((kept + inside - media.mean).abs() < chance);
}

#[test]
fn nothing_escapes_a_black_box() {
    let mut black = container(
        Cube::new(scaled(DVec3::splat(2.0), DVec3::ZERO)).unwrap(),
        Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
    );
    black.shape = black.shape.with_flipped_normals(true);
    let light = Emitter::Point {
        position: DVec3::ZERO,
        intensity: Spectrum::ONE,
    };
    let objects = vec![black];
    let mut meter = through(&objects, 0, [1, 1], true);
    meter.cosines = None;
    let media = vec![vacuum(), fog(Constant::new(1.0), 1.0, 0.5, 0.0)];
    let parts = parts(objects, media, vec![light], nobody());
    let mut options = options(5_000, 10);
    options.rr_depth = u32::MAX;
    let found = run(parts, &[Meter::Irradiance(meter)], &options);
    let b = found.balance;
    assert_eq!(b.escaped.mean, 0.0);
    // Arrivals at an opaque surface count on the side opposite to the normal.
    let power = reading(&found, 0, "power");
    assert_eq!(power.mean[0], 0.0);
    assert!(
        (power.mean[1] - b.surfaces.mean).abs() < 1e-12 * b.emitted,
        "{b:?}"
    );
    assert!((b.media.mean + b.surfaces.mean - 4.0 * PI).abs() < 1e-9);
    // Sum over the six parts.
    let parts = reading(&found, 0, "irradiance");
    let side = parts.mean.iter().skip(6);
    let sum: f64 = side.map(|irradiance| irradiance * 16.0).sum();
    assert!((sum - power.mean[1]).abs() < 1e-9);
}
