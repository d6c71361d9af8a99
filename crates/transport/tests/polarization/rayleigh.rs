//! Rayleigh scattering: once in closed form, often against electric fields that are followed from the sun.

use crate::field::{Coherency, sun};
use crate::{assert_alike, horizontal, polarized, stokes};
use eikonal::field::Constant;
use glam::{DAffine3, DVec3};
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::scene::Object;
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Cube;
use testkit::z_test::max_abs_z;
use testkit::{Moments, Rng};

const TRAVELS: DVec3 = DVec3::new(0.6, 0.0, -0.8);

/// A slab of depth `thickness` and conservative scattering below z = 0, under the sun, seen along a direction.
fn slab(thickness: f64, view: DVec3, up: DVec3) -> Scene {
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
        .medium(air.with_phase(Phase::rayleigh()))
        .object(
            Object::builder("slab", Cube::new(below).unwrap())
                .bsdf(Bsdf::Null)
                .interior("air"),
        )
        .emitter(sun(TRAVELS))
        .build()
        .unwrap()
}

#[test]
fn single_scattering_polarises_across_its_plane() {
    for (view, up) in [
        (DVec3::new(0.0, 0.0, -1.0), DVec3::X),
        (DVec3::new(0.3, 0.5, -0.4), DVec3::Z),
        (DVec3::new(-0.8, 0.0, -0.6), DVec3::new(0.0, 1.0, 0.2)),
        (DVec3::new(0.1, -0.7, -0.3), DVec3::new(0.2, 1.0, 1.0)),
    ] {
        let view = view.normalize();
        let found = stokes(&polarized(&slab(0.3, view, up), Some(2), 64, 1));
        let field = Coherency::unpolarized(TRAVELS).scattered(-view);
        assert_alike(found, field.stokes(-view, horizontal(view, up)), 1e-6);
    }
}

/// A photon's field E, a real unit vector, turns into E − k(k·E) where it is scattered into k, with a density in proportion to its
/// square. At each collision, what would go to the sensor without a further one is added up.
fn photon(thickness: f64, to_sensor: DVec3, rng: &mut Rng, mut see: impl FnMut(DVec3, f64)) {
    let across = TRAVELS.any_orthonormal_pair();
    let (sin, cos) = rng.range(0.0, std::f64::consts::TAU).sin_cos();
    let mut field = across.0 * cos + across.1 * sin;
    let (mut z, mut k) = (0.0, TRAVELS);
    loop {
        z += -(1.0 - rng.next_1d()).ln() * k.z;
        if !(-thickness..0.0).contains(&z) {
            return;
        }
        let seen = field - to_sensor * to_sensor.dot(field);
        see(seen, (z / to_sensor.z).exp());
        k = loop {
            let direction = DVec3::from(rng.direction());
            if rng.next_1d() < 1.0 - direction.dot(field).powi(2) {
                break direction;
            }
        };
        field = (field - k * k.dot(field)).normalize();
    }
}

/// Intensity and polarisation of a slab in which light is scattered a few times, where unpolarised scattering errs by several per cent.
#[test]
fn slabs_agree_with_electric_fields() {
    const PHOTONS: usize = 400_000;
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
        let mut sums = [const { Vec::new() }; 3];
        for _ in 0..PHOTONS {
            let mut of_photon = [0.0; 3];
            photon(thickness, -view, &mut rng, |field, visible| {
                let (a, b) = (field.dot(x), field.dot(y));
                let values = [a * a + b * b, a * a - b * b, 2.0 * a * b];
                // Of a field of unit square 3/8π go to a steradian, and the sun sends π cosine to a unit of area.
                let unit = 3.0 / 8.0 * -TRAVELS.z / -view.z * visible;
                of_photon
                    .iter_mut()
                    .zip(values)
                    .for_each(|(sum, v)| *sum += v * unit);
            });
            sums.iter_mut()
                .zip(of_photon)
                .for_each(|(all, v)| all.push(v));
        }
        let rendering = polarized(&slab(thickness, view, up), None, 200_000, 5);
        for (parameter, all) in sums.iter().enumerate() {
            let expected = moments(all);
            let mean = f64::from(rendering.film.mean_at(Some(parameter), 0, 0));
            let variance = f64::from(rendering.film.variance_at(Some(parameter), 0, 0));
            let error = expected.standard_error().hypot(variance.sqrt());
            println!("{parameter}: {mean} {} ± {error}", expected.mean());
            assert!(error < 0.004 * moments(&sums[0]).mean());
            zs.push((mean - expected.mean()) / error);
        }
    }
    max_abs_z(&zs, 1e-4).unwrap();
}

fn moments(values: &[f64]) -> Moments {
    let mut moments = Moments::default();
    values.iter().for_each(|v| moments.push(*v));
    moments
}
