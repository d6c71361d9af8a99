//! A panel with one lit half, compared with closed forms. Particles cannot find such a narrow view;
//! a meter detects them.
//!
//! False-alarm rate: 5e-4 for each of the two tests, with fixed seeds.

use crate::common::{mean, parts, path_tracer, shoot_by, vacuum};
use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{Emitter, TexturedArea};
use morgana_transport::integrator::{Bdpt, Integrator};
use morgana_transport::meter::{IrradianceMeter, Meter, Positions};
use morgana_transport::render::{Handle, MeasureOptions, measure};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Perspective, Sensor};
use morgana_transport::shape::{Rectangle, Shape};
use morgana_transport::texture::{Checkerboard, Texture};
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;
use testkit::z_test::max_abs_z;

const RATE: f64 = 5e-4;
const REFLECTANCE: f64 = 0.6;
/// The visible point on the floor.
const PLACE: DVec3 = DVec3::new(0.5, 0.2, 0.0);

/// View factor from a small area to a parallel rectangle at unit height with a corner above the
/// area, with the signs of the sides.
fn corner(a: f64, b: f64) -> f64 {
    let [p, q] = [a, b].map(|s| s.hypot(1.0));
    ((a / p) * (b / p).atan() + (b / q) * (a / q).atan()) / (2.0 * PI)
}

/// Irradiance on the floor below the lit half, of radiance 1, with x from 0 to 1 and y from −1 to
/// 1.
fn irradiance(x: f64, y: f64) -> f64 {
    let [right, left, up, down] = [1.0 - x, x, 1.0 - y, 1.0 + y];
    let corners = [(right, up), (right, down), (left, up), (left, down)];
    PI * corners.iter().map(|(a, b)| corner(*a, *b)).sum::<f64>()
}

fn plane(to_world: DAffine3, reflectance: f64) -> Object {
    Object {
        name: "plane".into(),
        shape: Rectangle::new(to_world).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(reflectance)).unwrap()),
        sides: None,
        emitter: None,
    }
}

/// The panel at unit height over a floor of half-width `half` about [`PLACE`].
fn scene(half: f64, sensor: Sensor) -> Parts {
    let down = DAffine3::from_rotation_y(PI);
    let mut panel = plane(DAffine3::from_translation(DVec3::Z) * down, 0.0);
    panel.emitter = Some(0);
    // u falls along the world's x, and the second colour applies to u > ½.
    let colours = [1.0, 0.0].map(|v| Texture::Uniform(Spectrum::splat(v)));
    let board = Checkerboard::new(colours, DAffine2::from_scale(DVec2::X));
    let light = TexturedArea::new(0, &panel.shape, Texture::Checkerboard(Arc::new(board)));
    let light = Emitter::Textured(Arc::new(light.unwrap()));
    let floor = DAffine3::from_translation(PLACE) * DAffine3::from_scale(DVec3::splat(half));
    let floor = plane(floor, REFLECTANCE);
    parts(vec![panel, floor], vec![vacuum()], vec![light], sensor)
}

#[test]
fn irradiance_below_the_panel() {
    // The view is so narrow that it sees only the point.
    let eye = PLACE + DVec3::new(-3.0, 0.0, 0.8);
    let left = DVec3::Y;
    let forward = (PLACE - eye).normalize();
    let axes = DMat3::from_cols(left, forward.cross(left), forward);
    let to_world = DAffine3::from_mat3_translation(axes, eye);
    let sensor = Sensor::Perspective(Perspective::new(to_world, 1e-3, 1.0));
    let expected = REFLECTANCE / PI * irradiance(PLACE.x, PLACE.y);
    let estimators = [
        ("path", path_tracer(), 4000),
        ("bdpt", Integrator::Bdpt(Bdpt::default()), 2000),
    ];
    let mut zs = Vec::new();
    for (name, integrator, samples) in estimators {
        let (mean, error) = mean(&shoot_by(
            integrator,
            scene(2.0, sensor.clone()),
            samples,
            3,
        ));
        println!("{name}: {mean} ± {error}, expected {expected}");
        zs.push((mean - expected) / error);
    }
    max_abs_z(&zs, RATE).unwrap();
}

#[test]
fn meters_below_the_panel() {
    const HALF: f64 = 0.2;
    let parts = scene(HALF, Sensor::Absent(DAffine3::IDENTITY));
    let shape: &Shape = &parts.objects[1].shape;
    let meter = IrradianceMeter::at(1, Positions::new(shape, [1, 1], false));
    let scene = Scene::new(parts).unwrap();
    let options = MeasureOptions {
        first: 0,
        particles: 100_000,
        seed: 4,
        max_depth: None,
        rr_depth: 5,
    };
    let meters = [Meter::Irradiance(meter)];
    let go_on = |_| ControlFlow::Continue(());
    let found = measure(&[scene], &meters, &options, &Handle::default(), go_on).unwrap();
    // Expect π times the lit area.
    assert!((found.emitted[0] / (2.0 * PI) - 1.0).abs() < 1e-14);
    let reading = found.readings[0].iter().find(|r| r.name == "irradiance");
    let reading = reading.unwrap();
    const N: usize = 20;
    let at = |k: usize, middle: f64| middle + HALF * ((2 * k + 1) as f64 / N as f64 - 1.0);
    let point = |i: usize| irradiance(at(i % N, PLACE.x), at(i / N, PLACE.y));
    let expected = (0..N * N).map(point).sum::<f64>() / (N * N) as f64;
    // Arriving light counts on the side opposite to the normal.
    let (mean, error) = (reading.mean[1], reading.error[1]);
    println!("{mean} ± {error}, expected {expected}");
    max_abs_z(&[(mean - expected) / error], RATE).unwrap();
}
