//! Optical lengths in closed form: parallel light seen by a parallel view has a single length.

use super::{bins, bounded, means, shoot};
use crate::common::{container, fog, parts, sky, vacuum};
use eikonal::field::{Constant, Luneburg};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::film::Decomposition;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Orthographic, Perspective, Sensor};
use morgana_transport::shape::{Cube, Disk, Shape, Sphere};
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::FRAC_PI_2;

/// A map to `position`, with local z along ±z of the world.
fn facing(position: DVec3, along: f64, scale: f64) -> DAffine3 {
    DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::new(along, 1.0, along) * scale),
        translation: position,
    }
}

fn opaque(shape: impl Into<Shape>, reflectance: f64) -> Object {
    Object {
        name: "wall".into(),
        shape: shape.into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(reflectance)).unwrap()),
        sides: None,
        emitter: None,
    }
}

fn beam(z: f64, along: f64) -> Emitter {
    Emitter::Collimated(Collimated::new(
        DVec3::Z * z,
        DVec3::Z * along,
        BeamProfile::Disc { radius: 0.5 },
        Spectrum::ONE,
    ))
}

/// A parallel view from the plane z = 3 down to z = 0, through an absorbing medium of index 1.33 in
/// [0.5, 1.5].
fn tank(mut objects: Vec<Object>, emitter: Emitter) -> Parts {
    let water = Cube::new(facing(DVec3::Z, 1.0, 0.5)).unwrap();
    objects.insert(0, container(water, Bsdf::Null));
    let media = vec![vacuum(), fog(Constant::new(1.33), 0.4, 0.0, 0.0)];
    let view = Orthographic::new(facing(DVec3::Z * 3.0, -1.0, 0.4), 1.0);
    parts(objects, media, vec![emitter], Sensor::Orthographic(view))
}

/// Asserts that every estimator finds all of its light between two lengths.
fn all_within(parts: &Parts, low: f64, high: f64, depth: u32) {
    let decomposition = Decomposition {
        length: bins(low, high - low, 1),
        ..Decomposition::default()
    };
    for integrator in bounded(depth) {
        let rendering = shoot((integrator, decomposition), parts, 256, 1);
        let [inside, under, over] = means(&rendering)[..] else {
            panic!("three layers");
        };
        assert!(inside > 0.0, "{}: no light", integrator.name());
        let outside = (under, over);
        assert_eq!(outside, (0.0, 0.0), "{}: {inside}", integrator.name());
    }
}

fn all_at(parts: &Parts, length: f64) {
    all_within(parts, length - 1e-6, length + 1e-6, 2);
}

#[test]
fn a_beam_counts_from_its_disc() {
    let wall = opaque(Disk::new(facing(DVec3::ZERO, 1.0, 1.0)).unwrap(), 0.5);
    let parts = tank(vec![wall], beam(2.0, -1.0));
    all_at(&parts, 2.33 + 3.33);
}

#[test]
fn light_from_outside_counts_from_the_ball_around_the_scene() {
    let wall = opaque(Disk::new(facing(DVec3::ZERO, 1.0, 1.0)).unwrap(), 0.5);
    let sun = Emitter::Directional {
        direction: -DVec3::Z,
        irradiance: Spectrum::ONE,
    };
    let parts = tank(vec![wall], sun);
    let around = *Scene::new(parts.clone()).unwrap().around();
    all_at(&parts, around.center.z + around.radius + 0.33 + 3.33);
    // View a sky straight ahead.
    let mut parts = tank(vec![], sky());
    let around = *Scene::new(parts.clone()).unwrap().around();
    let ahead = 3.33 - (around.center.z - around.radius);
    all_at(&parts, ahead);
    let pinhole = Perspective::new(facing(DVec3::Z * 3.0, -1.0, 1.0), 0.02, 1.0);
    parts.sensor = Sensor::Perspective(pinhole);
    all_within(&parts, ahead - 2e-3, ahead + 2e-3, 2);
}

#[test]
fn an_area_light_counts_from_its_surface() {
    let mut light = opaque(Disk::new(facing(DVec3::ZERO, 1.0, 1.0)).unwrap(), 0.0);
    light.emitter = Some(0);
    let emitter = Emitter::Area {
        object: 1,
        radiance: Spectrum::ONE,
    };
    all_at(&tank(vec![light], emitter), 3.33);
}

/// A point light is 0.5 away from the visible part of a wall, which extends 0.06 to either side.
#[test]
fn a_point_light_counts_from_its_place() {
    let wall = opaque(Disk::new(facing(DVec3::ZERO, 1.0, 1.0)).unwrap(), 0.5);
    let light = Emitter::Point {
        position: DVec3::new(0.3, 0.0, 0.4),
        intensity: Spectrum::ONE,
    };
    let mut parts = tank(vec![wall], light);
    let view = Orthographic::new(facing(DVec3::Z * 3.0, -1.0, 0.06), 1.0);
    parts.sensor = Sensor::Orthographic(view);
    all_within(&parts, 0.5 + 3.33 - 0.06, 0.5 + 3.33 + 0.06, 2);
}

/// All parallel rays through a Luneburg ball of radius 1 have the optical length 1 + π/2 from the
/// plane that touches it to the focus opposite; here they go there and back. The wall stands 0.01
/// in front of the focus, because the irradiance at the focus is infinite; each way is therefore up
/// to 0.01/cos 30° shorter.
#[test]
fn all_rays_of_a_luneburg_ball_are_equally_long() {
    let lens = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let wall = Disk::new(facing(DVec3::Z * 0.99, -1.0, 0.08)).unwrap();
    let media = vec![
        vacuum(),
        fog(Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap(), 0.0, 0.0, 0.0),
    ];
    let view = Orthographic::new(facing(DVec3::Z * -1.2, 1.0, 0.35), 1.0);
    let parts = parts(
        vec![lens, opaque(wall, 0.5)],
        media,
        vec![beam(-1.5, 1.0)],
        Sensor::Orthographic(view),
    );
    let there_and_back = 2.0 * (1.0 + FRAC_PI_2) + 0.2 + 0.5;
    all_within(&parts, there_and_back - 0.0235, there_and_back - 0.0199, 2);
}
