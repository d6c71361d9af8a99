//! Emitting media, compared with closed forms.

use crate::common::{container, fog, glass, parts, sky, vacuum};
use crate::sources::support::*;
use crate::sources::volumes::{against, centred, eye, view};
use eikonal::field::{Constant, LinearSquare, Placement};
use glam::{DAffine3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::Medium;
use morgana_transport::path::emit;
use morgana_transport::scene::{Object, Parts, ProblemSeverity, Sides, Subject};
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::PI;
use std::sync::Arc;
use testkit::z_test::max_abs_z;
use testkit::{Moments, Rng};

/// Values on a grid over a box from −`half` to `half`.
fn gridded(
    size: usize,
    half: DVec3,
    filter: GridFilter,
    value: impl Fn(usize) -> f32,
) -> VolumeTexture {
    let samples = GridSamples {
        size: [size; 3],
        channels: 1,
        data: (0..size.pow(3)).map(value).collect(),
    };
    let (placement, allowed) = (Placement::Centers, [0.0, f64::MAX]);
    let grid = VolumeGrid::new(samples, centred(half), placement, filter, allowed);
    VolumeTexture::Grid(Arc::new(grid.unwrap()))
}

fn cube(half: DVec3) -> Cube {
    Cube::new(DAffine3::from_scale(half)).unwrap()
}

/// The radiance of an absorbing box of thickness d without scattering is B (1 − e^{−σd}).
#[test]
fn thick_media_are_black_bodies() {
    let half = DVec3::new(1.0, 1.0, 0.5);
    let mut zs = Vec::new();
    for sigma in [0.3, 4.0f64] {
        let medium = fog(Constant::new(1.0), sigma, 0.0, 0.0).with_emission(0.8);
        let hull = container(cube(half), Bsdf::Null);
        let scene = parts(vec![hull], vec![vacuum(), medium], vec![], view());
        zs.extend(against(&scene, 0.8 * (1.0 - (-sigma).exp()), 2000));
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Under a sky of radiance B, everything is in equilibrium: the radiance is n² B everywhere for any
/// index, extinction and albedo. A ball inside that neither absorbs nor emits changes nothing.
#[test]
fn a_furnace_of_a_medium_is_even() {
    let half = DVec3::splat(0.7);
    let index = LinearSquare::new(1.7f64.sqrt(), DVec3::new(0.3, 0.2, -0.25), DVec3::ZERO);
    let sigma = gridded(4, half, GridFilter::Trilinear, |i| (i * 7 % 5) as f32 * 0.6);
    let hot = Medium {
        sigma_t: sigma,
        ..fog(index.unwrap(), 0.0, 0.4, 0.5).with_emission(1.0)
    };
    let clear = Medium::transparent("clear", hot.index.clone());
    let sides = Sides {
        interior: 2,
        exterior: 1,
    };
    let ball = Sphere::around(DVec3::new(0.05, 0.0, 0.04), 0.6).unwrap();
    let ball = Object {
        sides: Some(sides),
        ..container(ball, Bsdf::Null)
    };
    let objects = vec![container(cube(half), glass()), ball];
    let mut scene = parts(objects, vec![vacuum(), hot, clear], vec![sky()], eye());
    scene.reflections = 4;
    max_abs_z(&against(&scene, 1.0, 400), FAMILY).unwrap();
}

/// Returns the z-score of the mean power of light subpaths from the only emitter, compared with the
/// power that media emit.
fn power_of_starts(parts: Parts, expected: f64) -> f64 {
    let scene = Scene::new(parts).unwrap();
    let mut rng = Rng::new(6);
    let mut moments = Moments::default();
    for _ in 0..effort(60_000) {
        let start = emit(
            &scene,
            0,
            1.0,
            Spectrum::ONE,
            [rng.uniform(), rng.uniform()],
        );
        moments.push(start.map_or(0.0, |(_, ray)| ray.throughput[0]));
    }
    let (mean, error) = (moments.mean(), moments.standard_error());
    println!("{mean} ± {error}, expected {expected}");
    moments.z(expected)
}

/// Light starts everywhere in an emitting layer, even if the layer lies between the points at which
/// the medium is probed first. The layer is in a dark medium or beside another layer. Light does
/// not start in a ball of another medium. Power is 4π ∫ σ_a n² B dV.
#[test]
fn light_starts_wherever_a_medium_emits() {
    let (half, size, sigma, n) = (DVec3::splat(0.5), 44, 2.0, 1.3f64);
    let layer = |i: usize| i / (size * size);
    let layers = |first: f32| {
        let radiance = |layer: usize| match layer {
            0 => first,
            16 => 30.0,
            _ => 0.0,
        };
        let emission = gridded(size, half, GridFilter::Nearest, |i| radiance(layer(i)));
        let medium = Medium {
            emission: Some(emission),
            ..fog(Constant::new(n), sigma, 0.25, 0.0)
        };
        let hull = container(cube(half), Bsdf::Null);
        parts(vec![hull], vec![vacuum(), medium], vec![], view())
    };
    let density = 4.0 * PI * 0.75 * sigma * n * n;
    let mut zs = vec![];
    for first in [0.0, 3.0] {
        let expected = density * (30.0 + f64::from(first)) / size as f64;
        zs.push(power_of_starts(layers(first), expected));
    }
    let medium = fog(Constant::new(n), sigma, 0.25, 0.0).with_emission(1.0);
    let ball = Sphere::around(DVec3::splat(0.05), 0.4).unwrap();
    let sides = Sides {
        interior: 2,
        exterior: 1,
    };
    let ball = Object {
        sides: Some(sides),
        ..container(ball, Bsdf::Null)
    };
    let objects = vec![container(cube(half), Bsdf::Null), ball];
    let around = parts(objects, vec![vacuum(), medium, vacuum()], vec![], view());
    let volume = 1.0 - 4.0 / 3.0 * PI * 0.4f64.powi(3);
    zs.push(power_of_starts(around, density * volume));
    max_abs_z(&zs, FAMILY).unwrap();
}

/// The emitter of a medium has approximately the medium's power, in each channel.
#[test]
fn media_are_emitters_of_their_power() {
    let hull = container(Sphere::around(DVec3::ZERO, 0.5).unwrap(), Bsdf::Null);
    let colour = Spectrum([1.0, 2.0, 0.0, 0.0]);
    let medium = fog(Constant::new(1.3), 2.0, 0.25, 0.0).with_emission(colour);
    let mut parts = parts(vec![hull], vec![vacuum(), medium], vec![sky()], view());
    parts.film.channels = 3;
    let scene = Scene::new(parts.with_emissive_media()).unwrap();
    assert_eq!(scene.emitters().len(), 2);
    assert!(matches!(&scene.emitters()[1], Emitter::Volume(v) if v.medium() == Some(1)));
    let power = scene.powers(3).nth(1).unwrap();
    let expected = 4.0 * PI * (PI / 6.0) * 1.5 * 1.3f64.powi(2);
    assert!(
        (power[0] / expected - 1.0).abs() < 0.06,
        "{power:?} {expected}"
    );
    assert!((power[1] / power[0] - 2.0).abs() < 1e-6);
}

/// A medium without bounds cannot be a start for light.
#[test]
fn emission_without_bounds_is_refused() {
    let refused = |media: Vec<Medium>, id: usize| {
        let hull = container(cube(DVec3::ONE), Bsdf::Null);
        let problems = Scene::new(parts(vec![hull], media, vec![sky()], view())).unwrap_err();
        assert!(problems[0].message.contains("no bounds"), "{problems:?}");
        assert_eq!(problems[0].subject, Subject::Medium(id));
        assert_eq!(problems[0].severity, ProblemSeverity::Error);
    };
    let hot = |b: f64| fog(Constant::new(1.0), 1.0, 0.0, 0.0).with_emission(b);
    refused(vec![hot(1.0), vacuum()], 0);
    refused(vec![vacuum(), hot(f64::INFINITY)], 1);
}
