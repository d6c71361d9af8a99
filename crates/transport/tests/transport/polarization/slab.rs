//! Scattering slabs under the sun.

use crate::polarization::field::sun;
use crate::polarization::{horizontal, polarized};
use eikonal::field::Constant;
use glam::{DAffine3, DVec3};
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::scene::{Object, SceneBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Cube;
use num_complex::Complex64;
use testkit::z_test::max_abs_z;
use testkit::{Moments, Rng};

/// Direction in which the sun's light travels.
pub const TRAVELS: DVec3 = DVec3::new(0.6, 0.0, -0.8);

/// A slab of depth `thickness` and conservative scattering below z = 0, under the sun, seen along a direction.
pub fn slab(thickness: f64, phase: Phase, view: DVec3, up: DVec3) -> Scene {
    scene(thickness, phase, TRAVELS, [view, up])
        .build()
        .unwrap()
}

/// A slab under the sun of any direction, seen along a view with an up direction.
pub fn scene(thickness: f64, phase: Phase, travels: DVec3, [view, up]: [DVec3; 2]) -> SceneBuilder {
    let air = Medium::homogeneous("air", Constant::new(1.0), 1.0, 1.0);
    let half = DVec3::new(1e3, 1e3, 0.5 * thickness);
    let below = DAffine3::from_scale_rotation_translation(
        half,
        glam::DQuat::IDENTITY,
        DVec3::Z * (-0.5 * thickness),
    );
    Scene::builder()
        .film(1, 1)
        .channels(1)
        .camera(Camera::orthographic(-9.0 * view, DVec3::ZERO, 1e-3).with_up(up))
        .medium(air.with_phase(phase))
        .object(
            Object::builder("slab", Cube::new(below).unwrap())
                .bsdf(Bsdf::Null)
                .interior("air"),
        )
        .emitter(sun(travels))
}

/// A complex field across the direction of light.
#[derive(Clone, Copy)]
pub struct Field {
    /// Its real part.
    pub re: DVec3,
    /// Its imaginary part.
    pub im: DVec3,
}

impl Field {
    /// Component along an axis.
    pub fn dot(&self, axis: DVec3) -> Complex64 {
        Complex64::new(self.re.dot(axis), self.im.dot(axis))
    }

    /// |E|².
    pub fn square(&self) -> f64 {
        self.re.length_squared() + self.im.length_squared()
    }

    /// The field scaled to |E|² = 1.
    fn unit(self) -> Field {
        let scale = self.square().sqrt().recip();
        Field {
            re: self.re * scale,
            im: self.im * scale,
        }
    }
}

/// Scattering of fields by a medium.
pub trait Scatterer {
    /// Field scattered from one direction to another, in a unit in which |E|² is at most 1.
    fn scattered(&self, field: Field, from: DVec3, to: DVec3) -> Field;
    /// Mean of |E|² over the sphere.
    fn mean(&self) -> f64;
}

/// Traces a photon, whose field represents fully polarised light. It continues in a direction with
/// a density proportional to the squared field there. At each collision the code adds the light
/// that would reach the sensor without a further collision.
fn photon(
    matter: &impl Scatterer,
    thickness: f64,
    to_sensor: DVec3,
    rng: &mut Rng,
    mut see: impl FnMut(Field, f64),
) {
    let across = TRAVELS.any_orthonormal_pair();
    let (sin, cos) = rng.range(0.0, std::f64::consts::TAU).sin_cos();
    let mut field = Field {
        re: across.0 * cos + across.1 * sin,
        im: DVec3::ZERO,
    };
    let (mut z, mut k) = (0.0, TRAVELS);
    loop {
        z += -(1.0 - rng.next_1d()).ln() * k.z;
        if !(-thickness..0.0).contains(&z) {
            return;
        }
        see(
            matter.scattered(field, k, to_sensor),
            (z / to_sensor.z).exp(),
        );
        (k, field) = loop {
            let direction = DVec3::from(rng.direction());
            let scattered = matter.scattered(field, k, direction);
            if rng.next_1d() < scattered.square() {
                break (direction, scattered.unit());
            }
        };
    }
}

/// Compares Stokes vectors of a slab of optical depth 1, from three sides, with photons with
/// fields: z of all of them, at a family-wise false-alarm rate of 1e-4. Errors are at most
/// `precision` of the intensity.
pub fn assert_fields_agree(phase: &Phase, matter: &impl Scatterer, photons: usize, precision: f64) {
    let thickness = 1.0;
    let mut zs = Vec::new();
    for (i, (view, up)) in [
        (DVec3::new(0.0, 0.0, -1.0), DVec3::X),
        (DVec3::new(0.7, 0.4, -0.5), DVec3::Z),
        (DVec3::new(-0.5, -0.6, -0.5), DVec3::new(1.0, 0.0, 0.5)),
    ]
    .into_iter()
    .enumerate()
    {
        let view = view.normalize();
        let x = horizontal(view, up);
        let y = (-view).cross(x);
        let mut rng = Rng::new(7 + i as u64);
        let mut sums: [Moments; 4] = Default::default();
        for _ in 0..photons {
            let mut of_photon = [0.0; 4];
            photon(matter, thickness, -view, &mut rng, |field, visible| {
                let (a, b) = (field.dot(x), field.dot(y));
                let mixed = 2.0 * a * b.conj();
                let (aa, bb) = (a.norm_sqr(), b.norm_sqr());
                let values = [aa + bb, aa - bb, mixed.re, mixed.im];
                // The sun sends π times its cosine to a unit of area.
                let unit = -TRAVELS.z / -view.z * visible / (4.0 * matter.mean());
                of_photon
                    .iter_mut()
                    .zip(values)
                    .for_each(|(sum, v)| *sum += v * unit);
            });
            sums.iter_mut()
                .zip(of_photon)
                .for_each(|(all, v)| all.push(v));
        }
        let scene = slab(thickness, phase.clone(), view, up);
        let rendering = polarized(&scene, None, 200_000, 5);
        for (parameter, expected) in sums.iter().enumerate() {
            let mean = f64::from(rendering.film.mean_at(Some(parameter), 0, 0));
            let variance = f64::from(rendering.film.variance_at(Some(parameter), 0, 0));
            let error = expected.standard_error().hypot(variance.sqrt());
            println!("{parameter}: {mean} {} ± {error}", expected.mean());
            assert!(error < precision * sums[0].mean());
            if error > 0.0 {
                zs.push((mean - expected.mean()) / error);
            }
        }
    }
    max_abs_z(&zs, 1e-4).unwrap();
}
