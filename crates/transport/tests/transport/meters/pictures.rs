//! Energy balance of images by particles. It agrees with the balance of meters, although images use
//! other particles, which are connected to the camera.

use crate::common::{camera, shoot_by};
use crate::meters::conservation::room;
use crate::meters::support::*;
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer, PhotonMapping, Vcm};
use morgana_transport::render::{EnergyBalance, RenderOptions, Share, render};
use morgana_transport::scene::Parts;
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;

fn seen(channels: usize) -> Parts {
    let mut parts = room(channels);
    parts.sensor = camera(DVec3::new(5.0, 1.0, 2.0), DVec3::ZERO);
    parts
}

fn entries(b: &EnergyBalance) -> [Share; 3] {
    [b.media, b.surfaces, b.escaped]
}

/// Each entry agrees with the entry of a measurement, and the remainder with zero.
#[test]
fn pictures_and_meters_agree_on_where_the_light_goes() {
    let estimators = [
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
        Integrator::Vcm(Vcm::default()),
        Integrator::Photon(PhotonMapping {
            photons: Some(500),
            ..PhotonMapping::default()
        }),
    ];
    let mut zs = Vec::new();
    for channels in [1, 3] {
        let measured = run(room(channels), &[], &options(particles(200_000), 21)).balance;
        for (seed, estimator) in (22..).zip(estimators) {
            let samples = particles(if matches!(estimator, Integrator::Particle(_)) {
                200
            } else {
                30
            });
            let rendering = shoot_by(estimator, seen(channels), samples, seed);
            let b = rendering.balance.expect("particles are followed");
            println!("{} {b:?}", estimator.name());
            assert!((b.emitted / measured.emitted - 1.0).abs() < 1e-12);
            assert!(b.lost.mean == 0.0 && b.cut.mean == 0.0);
            zs.push(b.residual.mean / b.residual.error);
            assert!(b.residual.error < 0.05 * b.emitted);
            for (ours, other) in entries(&b).into_iter().zip(entries(&measured)) {
                zs.push((ours.mean - other.mean) / ours.error.hypot(other.error));
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// The energy balance does not depend on threads, or on the division of samples into passes.
#[test]
fn balances_of_pictures_have_the_same_bits() {
    let scene = [Scene::new(seen(3)).unwrap()];
    let options = RenderOptions::new(Integrator::Particle(ParticleTracer::default()), 12, 3);
    let balance = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| render(&scene, &options, |_| ControlFlow::Continue(())))
            .balance
    };
    let reference = balance(1);
    assert!(reference.is_some());
    assert_eq!(balance(2), reference);
    assert_eq!(balance(5), reference);
}

#[test]
fn paths_from_the_camera_keep_no_balance() {
    let rendering = shoot_by(crate::common::path_tracer(), seen(1), 1, 1);
    assert!(rendering.balance.is_none());
}
