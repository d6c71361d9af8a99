//! Agreement of `path`, `particle` and `bdpt` for light of apertures and fibres.

use crate::common::{Batches, camera, container, fog, glass, mean, parts, path_tracer, vacuum};
use crate::sources::support::*;
use crate::sources::volumes::{centred, uniform};
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
use testkit::batches::{moments, welch};

const BATCHES: u64 = 12;
/// Relative differences below this are round-off of rays and solver, and do not count.
const ROUND_OFF: f64 = 1e-5;

/// Image means of independent renders.
fn batches(integrator: Integrator, scene: &Parts, samples: u64, seed: u64) -> Vec<f64> {
    let (all, samples) = (
        Batches::new(integrator, scene.clone(), seed),
        effort(samples),
    );
    let mean = |batch: u64| mean(&all.render(batch, samples)).0;
    (0..BATCHES).map(mean).collect()
}

/// A fibre at a point.
fn pointed(from: DVec3, radius: f64, divergence: Divergence) -> Fiber {
    let aperture = Aperture::new(from, DOWN, BeamProfile::Disc { radius });
    let power = Spectrum::splat(9.0);
    Fiber::new(aperture, AngularProfile::Uniform, divergence, power)
}

/// A ball of fog in front of a white screen.
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

/// A scene, and its number of samples per pixel.
struct Case {
    name: &'static str,
    scene: Parts,
    samples: u64,
    /// True if particles are compared. Behind glass, a few particles carry much of the light, so
    /// that batch means are far from normal.
    by_particles: bool,
}

impl Case {
    fn new(name: &'static str, index: impl Into<Field>, emitter: impl Into<Emitter>) -> Self {
        let index = index.into();
        Case {
            name,
            samples: if index.is_constant() { 200 } else { 30 },
            scene: ball(index, Bsdf::Null, emitter.into()),
            by_particles: true,
        }
    }

    fn in_glass(name: &'static str, emitter: impl Into<Emitter>) -> Self {
        Case {
            name,
            samples: 30,
            scene: ball(Constant::new(1.3), glass(), emitter.into()),
            by_particles: false,
        }
    }
}

/// Origin of light from outside the ball, and its direction.
const OUTSIDE: DVec3 = DVec3::new(0.3, -0.2, 1.4);
const DOWN: DVec3 = DVec3::new(-0.2, 0.1, -1.0);

fn cases() -> Vec<Case> {
    let power = Spectrum::splat(9.0);
    let cone = Divergence::HalfAngle(0.35);
    let plain = || Constant::new(1.0);
    let lens = || Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.5).unwrap();
    let before = || pointed(OUTSIDE, 0.2, cone);
    let inside = || {
        let place = DVec3::new(0.1, 0.2, 0.5);
        pointed(place, 0.1, Divergence::NumericalAperture(0.5))
    };
    let waist = Aperture::new(OUTSIDE, DOWN, BeamProfile::Gaussian { waist: 0.2 });
    let gaussian = Fiber::new(waist, AngularProfile::Gaussian, cone, power);
    let focused = pointed(OUTSIDE, 0.5, Divergence::HalfAngle(0.1)).with_focus(1.3);
    let thrown = Aperture::picture(OUTSIDE, turned(DOWN), [0.9, 0.6], picture()).unwrap();
    let beam = Collimated::through(thrown.clone(), power);
    let wide = Divergence::HalfAngle(1.2);
    let panel = Fiber::new(thrown, AngularProfile::Lambertian, wide, power);
    let glow = || uniform(glowing(), 2.0);
    vec![
        Case::new("fibre before fog", plain(), before()),
        Case::new("fibre in fog", plain(), inside()),
        Case::new("fibre in graded fog", lens(), inside()),
        Case::in_glass("fibre before glass", before()),
        Case::new("Gaussian fibre", plain(), gaussian),
        Case::new("focused fibre", plain(), focused),
        Case::new("rectangle", lens(), beam),
        Case::new("panel", plain(), panel),
        Case::new("volume in fog", plain(), glow()),
        Case::new("volume in graded fog", lens(), glow()),
        Case::in_glass("volume in glass", glow()),
    ]
}

#[test]
fn three_estimators_agree() {
    let particle = Integrator::Particle(ParticleTracer::default());
    let bdpt = Integrator::Bdpt(Bdpt::default());
    let mut family = Family::new(FAMILY);
    for (k, case) in cases().iter().enumerate() {
        let name = case.name;
        let render = |i: u64, integrator| {
            let all = batches(integrator, &case.scene, case.samples, 3 * k as u64 + i);
            let m = moments(&all);
            println!("{name}, {i}: {:.5} ± {:.5}", m.mean(), m.standard_error());
            all
        };
        let reference = render(2, bdpt);
        let path = render(0, path_tracer());
        family.push(format!("{name}, path"), welch(&path, &reference, ROUND_OFF));
        if case.by_particles {
            let particles = render(1, particle);
            let p = welch(&particles, &reference, ROUND_OFF);
            family.push(format!("{name}, particle"), p);
        }
    }
    family.check().unwrap();
}

/// A box partly inside the ball.
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
