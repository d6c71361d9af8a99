//! Scenes in which several rays connect a pair of points, and light that only connections find.

use crate::agreement::RATE;
use crate::agreement::case::{acoustic, diffuse, facing};
use crate::agreement::compare::{Effort, Row, compare, judge, table};
use crate::common::{container, fog, glass, parts, vacuum};
use eikonal::Field;
use eikonal::field::{Constant, Gaussian, Selfoc};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Perspective, Sensor};
use morgana_transport::shape::{Cube, Cylinder, Rectangle, Sphere};

const EFFORT: Effort = Effort {
    batches: 40,
    work: 6_000_000,
};

fn view(from: DVec3, toward: DVec3, fov: f64) -> Sensor {
    let to_world = facing(from, (toward - from).normalize(), 1.0);
    Sensor::Perspective(Perspective::new(to_world, fov.to_radians(), 1.0))
}

/// Adds an extended emitter that shines along −z, so that its light makes no sharp caustics.
fn lit_from(parts: &mut Parts, position: DVec3, half: f64) {
    let to_world = facing(position, -DVec3::Z, half);
    let mut light = diffuse(Rectangle::new(to_world).unwrap());
    light.emitter = Some(parts.emitters.len());
    parts.objects.push(light);
    parts.emitters.push(Emitter::Area {
        object: parts.objects.len() - 1,
        radiance: Spectrum::splat(1.0 / half.powi(2)),
    });
}

fn light(position: DVec3) -> Emitter {
    Emitter::Point {
        position,
        intensity: Spectrum::splat(4.0),
    }
}

/// A white screen across z.
fn screen(z: f64, half: f64) -> Object {
    diffuse(Rectangle::new(facing(DVec3::Z * z, DVec3::Z, half)).unwrap())
}

fn ambient(n: f64) -> morgana_transport::medium::Medium {
    let mut ambient = vacuum();
    ambient.index = Constant::new(n).into();
    ambient
}

fn scene(
    shape: impl Into<morgana_transport::shape::Shape>,
    index: impl Into<Field>,
    n: f64,
) -> Parts {
    let media = vec![ambient(n), fog(index, 0.0, 0.0, 0.0)];
    let sensor = view(DVec3::Z * 4.0, DVec3::ZERO, 40.0);
    parts(
        vec![container(shape, Bsdf::Null)],
        media,
        Vec::new(),
        sensor,
    )
}

fn check(name: &str, parts: &Parts, seed: u64, effort: Effort, particles: bool) -> Row {
    let particles = particles.then_some(effort);
    let started = std::time::Instant::now();
    let row = compare(name, parts, effort, seed, particles);
    let table = table(std::slice::from_ref(&row), RATE, effort);
    let line = table.lines().nth(2).unwrap();
    println!("{:.1} s {line}", started.elapsed().as_secs_f64());
    row
}

/// A screen behind a strong lens. A point emitter lights it along up to three rays, and the camera
/// sees it along as many.
fn behind_a_lens() -> Parts {
    let lens = Gaussian::new(1.0, 0.5, DVec3::ZERO, 0.3).unwrap();
    let ball = Sphere::around(DVec3::ZERO, 1.2).unwrap();
    let mut parts = scene(ball, lens, 1.0);
    parts.objects.push(screen(-2.0, 0.6));
    parts.emitters = vec![light(DVec3::new(0.1, 0.05, 2.0))];
    parts.sensor = view(DVec3::new(0.9, 0.6, 2.5), DVec3::Z * -2.0, 12.0);
    parts
}

/// Thin fog in a graded rod longer than a pitch, lit by an emitter at its end.
fn rod() -> Parts {
    let index = || Selfoc::new(1.5, 0.8, DVec3::ZERO, DVec3::Z).unwrap();
    let shape = Cylinder::between(DVec3::ZERO, DVec3::Z * 9.0, 0.6, true).unwrap();
    let mut parts = scene(shape, index(), 1.5);
    parts.media[1] = fog(index(), 0.1, 0.9, 0.0);
    parts.emitters = vec![light(DVec3::new(0.1, 0.05, -0.5))];
    parts.sensor = view(DVec3::new(3.0, 0.2, 7.5), DVec3::Z * 7.5, 22.0);
    parts
}

/// Fog in a standing sound wave, with a beam through it.
fn sound() -> Parts {
    let shape = Cube::new(DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(
        2.0, 1.0, 1.0,
    ))))
    .unwrap();
    let mut parts = scene(shape, acoustic(1.33, 3), 1.33);
    parts.media[1] = fog(acoustic(1.33, 3), 0.4, 0.9, 0.5);
    parts.emitters = vec![Emitter::Collimated(Collimated::new(
        DVec3::new(-2.5, 0.1, 0.05),
        DVec3::X,
        BeamProfile::Disc { radius: 0.5 },
        Spectrum::splat(4.0),
    ))];
    parts.sensor = view(DVec3::new(0.5, 0.8, 4.0), DVec3::ZERO, 50.0);
    parts
}

/// A screen behind a glass ball, lit and seen past the ball and through it. The test leaves out
/// particles: few of them reach the screen through the ball, and these are bright, so that their
/// mean is not normal at this effort.
fn glass_ball() -> Parts {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let mut parts = scene(ball, Constant::new(1.5), 1.0);
    parts.objects[0].bsdf = glass();
    parts.objects.push(screen(-2.2, 1.0));
    lit_from(&mut parts, DVec3::new(0.3, 0.2, 3.0), 0.5);
    parts.sensor = view(DVec3::new(0.5, -0.4, 4.0), DVec3::Z * -2.2, 20.0);
    parts
}

/// The emitter's mirror image in the ball. The ray from the camera that finds the image passes
/// close to the emitter before it is reflected. Searches choose the closest approach, so they
/// rarely reach the second one.
#[test]
fn a_light_is_mirrored_in_a_glass_ball() {
    let mut parts = glass_ball();
    parts.reflections = 2;
    let row = check("image in a glass ball, area", &parts, 1005, EFFORT, false);
    judge(&[row], &[], RATE).unwrap();
}

/// Connections that omit all rays except one, or that use 1/d² as geometry term, fail this test
/// (`scripts/planted.py`): `path` finds the light of a delta emitter by connections alone.
#[test]
fn estimators_agree_on_all_branches() {
    let lens = behind_a_lens();
    let rows = [
        check("behind a Gaussian lens, point", &lens, 1001, EFFORT, true),
        check("fog in a long rod, point", &rod(), 1009, EFFORT, true),
        check("mode 3 of sound, beam in fog", &sound(), 1003, EFFORT, true),
        check(
            "behind a glass ball, area",
            &glass_ball(),
            1004,
            EFFORT,
            false,
        ),
    ];
    judge(&rows, &[], RATE).unwrap();
}
