//! Rayleigh scattering: single scattering in closed form, and multiple scattering compared with
//! electric fields traced from the sun.

use crate::polarization::field::Coherency;
use crate::polarization::slab::{Field, Scatterer, TRAVELS, assert_fields_agree, scene, slab};
use crate::polarization::{assert_alike, horizontal, polarized, stokes};
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::phase::Phase;
use morgana_transport::scene::Object;
use morgana_transport::shape::Rectangle;
use testkit::z_test::max_abs_z;

#[test]
fn single_scattering_polarises_across_its_plane() {
    for (view, up) in [
        (DVec3::new(0.0, 0.0, -1.0), DVec3::X),
        (DVec3::new(0.3, 0.5, -0.4), DVec3::Z),
        (DVec3::new(-0.8, 0.0, -0.6), DVec3::new(0.0, 1.0, 0.2)),
        (DVec3::new(0.1, -0.7, -0.3), DVec3::new(0.2, 1.0, 1.0)),
    ] {
        let view = view.normalize();
        let found = stokes(&polarized(
            &slab(0.3, Phase::rayleigh(), view, up),
            Some(2),
            64,
            1,
        ));
        let field = Coherency::unpolarized(TRAVELS).scattered(-view);
        assert_alike(found, field.stokes(-view, horizontal(view, up)), 1e-6);
    }
}

/// A dipole, which radiates the component of the field across the direction.
struct Dipole;

impl Scatterer for Dipole {
    fn scattered(&self, field: Field, _: DVec3, to: DVec3) -> Field {
        Field {
            re: field.re.reject_from_normalized(to),
            im: field.im.reject_from_normalized(to),
        }
    }

    fn mean(&self) -> f64 {
        2.0 / 3.0
    }
}

/// Tests intensity and polarisation of a slab in which light is scattered a few times, where
/// unpolarised scattering errs by several per cent.
#[test]
fn slabs_agree_with_electric_fields() {
    assert_fields_agree(&Phase::rayleigh(), &Dipole, 400_000, 0.004);
}

/// I, Q and U of light that leaves the top of a conservative Rayleigh atmosphere of optical depth
/// 0.5 over a Lambertian ground, under a sun of flux π whose cosine is 0.2. Rows: cosine and
/// azimuth (degrees) of the light, and the parameters over grounds of albedo 0 and 0.8. Source: K.
/// L. Coulson, J. V. Dave and Z. Sekera, Tables related to radiation emerging from a planetary
/// atmosphere with Rayleigh scattering, 1960, as corrected by V. Natraj, K.-F. Li and Y. L. Yung,
/// Astrophys. J. 691, 1909, 2009. At azimuth 0 light continues in the sun's azimuth; Q is positive
/// across the meridian plane.
#[rustfmt::skip]
const TABLE: [(f64, f64, [[f64; 3]; 2]); 6] = [
    (0.02, 0.0, [[0.44129802, -0.01753141, 0.0], [0.47382125, -0.01553672, 0.0]]),
    (0.4, 0.0, [[0.16889020, 0.01119511, 0.0], [0.23059806, 0.01144320, 0.0]]),
    (1.0, 0.0, [[0.05300496, 0.03755859, 0.0], [0.13280858, 0.03755859, 0.0]]),
    (0.02, 60.0, [[0.30091208, -0.15965601, 0.07365528], [0.33343531, -0.15766132, 0.07365528]]),
    (0.4, 60.0, [[0.12752450, -0.06066038, 0.05293867], [0.18923236, -0.06041229, 0.05293867]]),
    (1.0, 60.0, [[0.05300496, -0.01877930, 0.03252669], [0.13280858, -0.01877930, 0.03252669]]),
];

/// Renders agree with [`TABLE`], at a family-wise false-alarm rate of 1e-4.
#[test]
fn atmospheres_agree_with_tables() {
    const THICKNESS: f64 = 0.5;
    let sine = |cosine: f64| (1.0 - cosine * cosine).sqrt();
    let travels = DVec3::new(sine(0.2), 0.0, -0.2);
    let mut zs = Vec::new();
    for (cosine, azimuth, expected) in TABLE {
        let (sin, cos) = (-azimuth).to_radians().sin_cos();
        let across = DVec3::new(cos, sin, 0.0);
        let leaves = across * sine(cosine) + DVec3::Z * cosine;
        // The up direction is in the meridian plane.
        let up = DVec3::Z * sine(cosine) - across * cosine;
        for (albedo, expected) in [0.0, 0.8].into_iter().zip(expected) {
            let under = DAffine3::from_scale_rotation_translation(
                DVec3::splat(1e3),
                DQuat::IDENTITY,
                DVec3::Z * (-THICKNESS - 1e-3),
            );
            let ground = Bsdf::Diffuse(Diffuse::new(albedo).unwrap());
            let ground = Object::builder("ground", Rectangle::new(under).unwrap()).bsdf(ground);
            let scene = scene(THICKNESS, Phase::rayleigh(), travels, [-leaves, up]);
            let scene = scene.object(ground).build().unwrap();
            let film = polarized(&scene, None, 60_000, 11).film;
            for (parameter, expected) in expected.into_iter().enumerate() {
                let mean = f64::from(film.mean_at(Some(parameter), 0, 0));
                let error = f64::from(film.variance_at(Some(parameter), 0, 0)).sqrt();
                println!("{cosine}, {azimuth}°, {albedo}: {mean:.5} ± {error:.5}, {expected:.5}");
                assert!(error < 0.01 * f64::from(film.mean_at(Some(0), 0, 0)));
                zs.push((mean - expected) / error);
            }
        }
    }
    max_abs_z(&zs, 1e-4).unwrap();
}
