//! Plane slabs of turbid media with known reflectance and transmittance.
//!
//! The exact values are deterministic: adding-doubling with 56 Gauss nodes for the slab of H. C.
//! van de Hulst, *Multiple Light Scattering* (1980), and Chandrasekhar's H functions with Fresnel's
//! boundary for the half space of R. G. Giovanelli (1955). Both are the classical tests of Monte
//! Carlo in tissue (L. Wang, S. L. Jacques and L. Zheng, "MCML", Comput. Methods Programs Biomed.
//! 47, 1995, tables 1 and 2), here in units of 1 mm. Sides are too far away to matter.

use crate::meters::support::*;
use eikonal::field::Constant;
use glam::{DAffine3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::meter::Meter;
use morgana_transport::scene::Object;
use morgana_transport::shape::{Cube, Rectangle};
use testkit::z_test::max_abs_z;

#[test]
fn a_slab_with_matched_index() {
    // μ_a = 1, μ_s = 9, g = 0.75, 0.2 thick.
    let slab = container(
        Cube::new(scaled(DVec3::new(50.0, 50.0, 0.1), DVec3::Z * 0.1)).unwrap(),
        Bsdf::Null,
    );
    let media = vec![vacuum(), fog(Constant::new(1.0), 10.0, 0.9, 0.75)];
    let light = beam(DVec3::Z * -1.0, DVec3::Z, 1e-3);
    let objects = vec![slab];
    let meter = Meter::Irradiance(through(&objects, 0, [1, 1], true));
    let parts = parts(objects, media, vec![light], nobody());
    let found = run(parts, &[meter], &options(particles(200_000), 16));
    let power = reading(&found, 0, "binned_power");
    // Power that leaves through the faces at z = 0 and z = 0.2.
    let (reflected, transmitted) = (
        (power.mean[4], power.error[4]),
        (power.mean[5], power.error[5]),
    );
    let absorbed = (found.balance.media.mean, found.balance.media.error);
    let cases = [
        (reflected, 0.097_395),
        (transmitted, 0.660_958),
        (absorbed, 0.241_647),
    ];
    let zs = cases.map(|((mean, error), exact)| {
        println!("{mean} ± {error}, exact {exact}");
        (mean - exact) / error
    });
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn a_half_space_with_an_index_of_its_own() {
    // μ_a = 1, μ_s = 9, isotropic, n = 1.5; 10 mm are a hundred free paths.
    let block = container(
        Cube::new(scaled(DVec3::new(50.0, 50.0, 5.0), DVec3::Z * 5.0)).unwrap(),
        glass(),
    );
    let screen = Object {
        name: "screen".into(),
        shape: Rectangle::new(
            DAffine3::from_translation(DVec3::Z * -0.1) * DAffine3::from_scale(DVec3::splat(100.0)),
        )
        .unwrap()
        .into(),
        bsdf: Bsdf::Null,
        sides: None,
        emitter: None,
    };
    let media = vec![vacuum(), fog(Constant::new(1.5), 10.0, 0.9, 0.0)];
    let light = beam(DVec3::Z * -1.0, DVec3::Z, 1e-3);
    let objects = vec![block, screen];
    let meters = [0, 1].map(|i| Meter::Irradiance(through(&objects, i, [1, 1], false)));
    let parts = parts(objects, media, vec![light], nobody());
    let found = run(parts, &meters, &options(particles(100_000), 17));
    // The screen faces +z: side 1 sees returning light, including directly reflected light.
    let (all, out) = (reading(&found, 1, "power"), reading(&found, 0, "power"));
    println!("{:?}\n{:?}", all.mean, out.mean);
    assert_eq!(all.mean[0], 1.0);
    let zs = [
        (all.mean[1] - 0.259_919) / all.error[1],
        (out.mean[0] - 0.219_919) / out.error[0],
        // 4 % are reflected directly and do not enter.
        (out.mean[1] - 0.96) / out.error[1],
    ];
    max_abs_z(&zs, FAMILY).unwrap();
}
