//! `path`, `particle` and `bdpt` find the same light of apertures and fibres.

use crate::common::{camera, container, fog, glass, mean, parts, path_tracer, shoot_by, vacuum};
use crate::support::*;
use crate::volumes::{centred, uniform};
use eikonal::Field;
use eikonal::field::{Constant, Gaussian};
use glam::{DAffine3, DVec3};
use morgana_transport::Orientation;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{
    AngularProfile, Aperture, BeamProfile, Collimated, Divergence, Emitter, Fiber,
};
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Disk, Sphere};
use testkit::Family;
use testkit::batches::welch;

const BATCHES: u64 = 12;
/// Round-off of rays and solver: relative differences below this are none.
const ROUND_OFF: f64 = 1e-5;

/// The images' means of independent renders; ten times as many samples under `MORGANA_LONG_TESTS`.
fn batches(integrator: Integrator, scene: &Parts, samples: u64, seed: u64) -> Vec<f64> {
    let long = std::env::var_os("MORGANA_LONG_TESTS").is_some();
    let samples = if long { 10 * samples } else { samples };
    let render = |batch: u64| {
        let rendering = shoot_by(integrator, scene.clone(), samples, 1000 * seed + batch);
        mean(&rendering).0
    };
    (0..BATCHES).map(render).collect()
}

/// A fibre at a place that shines in a direction.
fn pointed(from: DVec3, direction: DVec3, radius: f64, divergence: Divergence) -> Fiber {
    let aperture = Aperture::new(from, direction, BeamProfile::Disc { radius });
    Fiber::new(
        aperture,
        AngularProfile::Uniform,
        divergence,
        Spectrum::splat(9.0),
    )
}

/// A ball of fog before a white screen.
fn ball(index: impl Into<Field>, wall: Bsdf, emitter: Emitter) -> Parts {
    let screen = Object {
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.8)).unwrap()),
        ..unseen(Disk::new(facing(DVec3::Z * -1.3, DVec3::Z, 2.0)).unwrap())
    };
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), wall);
    let eye = camera(DVec3::new(0.4, 0.3, 3.2), DVec3::ZERO);
    let media = vec![vacuum(), fog(index, 1.0, 0.8, 0.3)];
    let mut parts = parts(vec![ball, screen], media, vec![emitter], eye);
    parts.reflections = 2;
    parts
}

#[test]
fn three_estimators_agree() {
    let down = DVec3::new(-0.2, 0.1, -1.0);
    let outside = DVec3::new(0.3, -0.2, 1.4);
    let cone = Divergence::HalfAngle(0.35);
    let plain = || Constant::new(1.0);
    let lens = || Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.5).unwrap();
    let thrown = Aperture::picture(outside, turned(down), [0.9, 0.6], picture()).unwrap();
    let beam = Collimated::through(thrown.clone(), Spectrum::splat(9.0));
    let panel = Fiber::new(
        thrown,
        AngularProfile::Lambertian,
        Divergence::HalfAngle(1.2),
        Spectrum::splat(9.0),
    );
    let inside = pointed(
        DVec3::new(0.1, 0.2, 0.5),
        down,
        0.1,
        Divergence::NumericalAperture(0.5),
    );
    let gaussian = Fiber::new(
        Aperture::new(outside, down, BeamProfile::Gaussian { waist: 0.2 }),
        AngularProfile::Gaussian,
        cone,
        Spectrum::splat(9.0),
    );
    let focused = pointed(outside, down, 0.5, Divergence::HalfAngle(0.1)).with_focus(1.3);
    let glow = || uniform(glowing(), 2.0);
    let cases: [(&str, Parts, u64); 11] = [
        (
            "fibre before fog",
            ball(
                plain(),
                Bsdf::Null,
                pointed(outside, down, 0.2, cone).into(),
            ),
            400,
        ),
        (
            "fibre in fog",
            ball(plain(), Bsdf::Null, inside.clone().into()),
            400,
        ),
        (
            "fibre in graded fog",
            ball(lens(), Bsdf::Null, inside.into()),
            60,
        ),
        (
            "fibre before glass",
            ball(
                Constant::new(1.3),
                glass(),
                pointed(outside, down, 0.2, cone).into(),
            ),
            60,
        ),
        (
            "Gaussian fibre",
            ball(plain(), Bsdf::Null, gaussian.into()),
            400,
        ),
        (
            "focused fibre",
            ball(plain(), Bsdf::Null, focused.into()),
            400,
        ),
        ("rectangle", ball(lens(), Bsdf::Null, beam.into()), 60),
        ("panel", ball(plain(), Bsdf::Null, panel.into()), 400),
        ("volume in fog", ball(plain(), Bsdf::Null, glow()), 400),
        ("volume in graded fog", ball(lens(), Bsdf::Null, glow()), 60),
        (
            "volume in glass",
            ball(Constant::new(1.3), glass(), glow()),
            60,
        ),
    ];
    let particle = Integrator::Particle(ParticleTracer::default());
    let bdpt = Integrator::Bdpt(Bdpt::default());
    let mut family = Family::new(FAMILY);
    for (k, (name, scene, samples)) in cases.iter().enumerate() {
        let seed = 3 * k as u64;
        let all = [path_tracer(), particle, bdpt];
        let [path, particle, bdpt] =
            [0, 1, 2].map(|i| batches(all[i], scene, *samples, seed + i as u64));
        let show = |batches: &[f64]| {
            let m = testkit::batches::moments(batches);
            format!("{:.5} ± {:.5}", m.mean(), m.standard_error())
        };
        println!(
            "{name}: path {}, particle {}, bdpt {}",
            show(&path),
            show(&particle),
            show(&bdpt)
        );
        family.push(format!("{name}, path"), welch(&path, &bdpt, ROUND_OFF));
        family.push(
            format!("{name}, particle"),
            welch(&particle, &bdpt, ROUND_OFF),
        );
    }
    family.check().unwrap();
}

/// A box that is partly in the ball, and partly not.
fn glowing() -> DAffine3 {
    DAffine3 {
        translation: DVec3::new(0.5, -0.6, -0.4),
        ..centred(DVec3::new(0.4, 0.3, 0.5))
    }
}

/// An orientation with local +z along a direction.
fn turned(direction: DVec3) -> Orientation {
    let linear = facing(DVec3::ZERO, direction, 1.0).matrix3;
    Orientation::nearest(linear).unwrap().0
}
