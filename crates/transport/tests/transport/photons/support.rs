//! Scenes for tests of photon maps.

use crate::common::{container, fog, glass, parts, vacuum};
use eikonal::Field;
use eikonal::field::{Constant, Luneburg};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::integrator::{Bdpt, Integrator, PhotonMapping, PhotonQuery};
use morgana_transport::photons::Kernel;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Orthographic, Sensor};
use morgana_transport::shape::{Cube, Sphere};
use std::f64::consts::PI;

/// A view along −z of the square of half width `half` around the origin.
pub fn view(half: f64) -> Sensor {
    let basis = DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z);
    Sensor::Orthographic(Orthographic::new(
        DAffine3 {
            matrix3: basis * half,
            translation: DVec3::Z * 3.0,
        },
        1.0,
    ))
}

/// A beam along x with a Gaussian profile: the light in fog is smooth.
pub fn beam(radius: f64) -> Emitter {
    Emitter::Collimated(Collimated::new(
        DVec3::NEG_X * 2.0,
        DVec3::X,
        BeamProfile::Gaussian { waist: radius },
        Spectrum::splat(4.0),
    ))
}

/// A ball of fog in a beam, in glass or without a wall.
pub fn ball(index: Field, wall: Bsdf, half: f64) -> Parts {
    let sphere = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    parts(
        vec![container(sphere, wall)],
        vec![vacuum(), fog(index, 1.0, 0.8, 0.3)],
        vec![beam(0.5)],
        view(half),
    )
}

/// A scene whose rays bend, without an index jump at the surface.
pub fn matched() -> Parts {
    ball(
        Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into(),
        Bsdf::Null,
        0.5,
    )
}

/// A scene whose rays bend, and are refracted and reflected at the surface.
pub fn in_glass() -> Parts {
    ball(
        Luneburg::new(1.3, DVec3::ZERO, 2.0).unwrap().into(),
        glass(),
        0.5,
    )
}

/// Standard deviation of the irradiance of the beam in the box.
const SPREAD: f64 = 0.2;

/// A box of fog, |x|, |y|, |z| ≤ 1, that a beam along x enters, seen around the beam's axis. Its
/// single scattering has a closed form: see [`InBox`].
pub fn boxed() -> Parts {
    let walls = Cube::new(DAffine3::IDENTITY).unwrap();
    parts(
        vec![container(walls, Bsdf::Null)],
        vec![vacuum(), fog(Constant::new(1.0), 1.0, 0.8, 0.0)],
        vec![beam(2.0 * SPREAD)],
        view(0.1),
    )
}

/// Closed forms for the view of the box in single scattering, without photons and with them.
pub struct InBox;

impl InBox {
    /// Radiance along the ray through (x, y, 0), with its light displaced along z by `dz` before
    /// scattering: σ_s p E ∫ e^{−(1 + x)} e^{−(1 − z)} exp(−(y² + (z + dz)²)/2s²) dz, s the beam's
    /// spread.
    fn moved(x: f64, y: f64, dz: f64) -> f64 {
        let n = 200;
        let across = |d: f64| (-0.5 * (d / SPREAD).powi(2)).exp();
        let sum: f64 = (0..n)
            .map(|i| -1.0 + (2 * i + 1) as f64 / n as f64)
            .map(|z| (z - 1.0).exp() * across(z + dz))
            .sum();
        let peak = 2.0 * 4.0 / (PI * (2.0 * SPREAD).powi(2));
        0.8 / (4.0 * PI) * peak * (-1.0 - x).exp() * across(y) * sum * 2.0 / n as f64
    }

    /// Mean over each of the 4 × 4 pixels, from the top left.
    pub fn pixels() -> Vec<f64> {
        let place = |i: usize, k: usize| 0.1 * (-1.0 + (i as f64 + (k as f64 + 0.5) / 4.0) / 2.0);
        let pixel = |i: usize| {
            let part = |k: usize| Self::moved(place(i % 4, k % 4), -place(i / 4, k / 4), 0.0);
            (0..16).map(part).sum::<f64>() / 16.0
        };
        (0..16).map(pixel).collect()
    }

    /// Mean over the image with photons, and without the known bias.
    pub fn blurred(kernel: Kernel, query: PhotonQuery) -> [f64; 2] {
        // The view is small: moving the light equals moving the view, and the mean of the image
        // factors out.
        let image = Self::pixels().iter().sum::<f64>() / 16.0 / Self::moved(0.0, 0.0, 0.0);
        let (rings, angles, planes) = match query {
            PhotonQuery::Beam => (200, 24, 1),
            PhotonQuery::Point | PhotonQuery::Indirect => (100, 24, 240),
        };
        let r = kernel.radius();
        let mut sums = [0.0; 2];
        for plane in 0..planes {
            let (dz, depth) = match query {
                PhotonQuery::Beam => (0.0, 1.0),
                PhotonQuery::Point | PhotonQuery::Indirect => {
                    let width = 2.0 * r / f64::from(planes);
                    ((f64::from(plane) + 0.5) * width - r, width)
                }
            };
            let along = Self::moved(0.0, 0.0, dz) * depth;
            let width = (r * r - dz * dz).sqrt() / f64::from(rings);
            for (ring, angle) in (0..rings * angles).map(|k| (k / angles, k % angles)) {
                let d = (f64::from(ring) + 0.5) * width;
                let turn = 2.0 * PI / f64::from(angles);
                let (dy, dx) = (f64::from(angle) * turn).sin_cos();
                let (k, b) = kernel.weigh(d * d + dz * dz).unwrap();
                let light = (-dx * d - 0.5 * (dy * d / SPREAD).powi(2)).exp();
                let weight = along * light * d * width * turn;
                sums[0] += k * weight;
                sums[1] += (k - b) * weight;
            }
        }
        sums.map(|sum| sum * image)
    }
}

/// A white ball within clear glass of varying index.
pub fn white_ball() -> Parts {
    let mut scene = ball(
        Luneburg::new(1.2, DVec3::ZERO, 2.0).unwrap().into(),
        glass(),
        0.35,
    );
    scene.media[1].sigma_t = morgana_transport::volume::VolumeTexture::Uniform(Spectrum::ZERO);
    let white = Object {
        name: "white".into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.8)).unwrap()),
        sides: None,
        ..container(Sphere::around(DVec3::ZERO, 0.6).unwrap(), Bsdf::Null)
    };
    scene.objects.push(white);
    scene.emitters = vec![Emitter::Collimated(Collimated::new(
        DVec3::new(-2.0, 1.0, 2.0),
        DVec3::new(2.0, -1.0, -2.0).normalize(),
        BeamProfile::Gaussian { waist: 0.8 },
        Spectrum::splat(4.0),
    ))];
    scene
}

/// Photon mapping with a number of photons and a radius.
pub fn photons(photons: usize, radius: f64, query: PhotonQuery) -> PhotonMapping {
    PhotonMapping {
        photons: Some(photons),
        radius: Some(radius),
        query,
        ..PhotonMapping::default()
    }
}

pub fn bdpt() -> Integrator {
    Integrator::Bdpt(Bdpt::default())
}
