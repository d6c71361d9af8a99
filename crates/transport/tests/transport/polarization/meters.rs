//! Stokes vectors of meters: behind filters, and for light that a slab scatters back, compared with
//! images.

use super::filters::{behind, polarizer};
use super::slab::{TRAVELS, slab};
use super::{polarized, stokes};
use crate::meters::support::{
    beam, fog, nobody, options, particles, parts, reading, run, through, vacuum,
};
use eikonal::field::Constant;
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, FilterElement, PolarizingFilter};
use morgana_transport::medium::Medium;
use morgana_transport::meter::{Meter, RecordTable};
use morgana_transport::phase::Phase;
use morgana_transport::render::Measurement;
use morgana_transport::scene::{Object, Parts, Sides};
use morgana_transport::shape::{Cube, Rectangle};
use testkit::z_test::max_abs_z;

/// A square around a point of the z axis, with the axes of the scene.
fn sheet(z: f64, half: f64, bsdf: Bsdf) -> Object {
    let center = DVec3::Z * z;
    let to_world =
        DAffine3::from_scale_rotation_translation(DVec3::splat(half), DQuat::IDENTITY, center);
    Object {
        name: "sheet".into(),
        shape: Rectangle::new(to_world).unwrap().into(),
        bsdf,
        sides: None,
        emitter: None,
    }
}

/// Measures the light of a scene at its last object.
fn measured(parts: Parts, count: u64) -> Measurement {
    let last = parts.objects.len() - 1;
    let mut meter = through(&parts.objects, last, [1, 1], false);
    meter.stokes = true;
    meter.most_records = Some(1_000_000);
    run(parts, &[Meter::Irradiance(meter)], &options(count, 3))
}

fn table(measurement: &Measurement) -> &RecordTable {
    measurement.records[0].as_ref().unwrap()
}

/// A beam along z through filters, the last one nearest to the meter, has the Stokes parameters
/// that a camera with an equal y axis sees for unit light.
#[test]
fn meters_read_light_behind_filters_as_cameras_see_it() {
    let retarder = FilterElement::Retarder {
        theta: 70.0.into(),
        delta: 90.0.into(),
    };
    let circular = FilterElement::CircularPolarizer { left_handed: true };
    for filters in [
        vec![polarizer(30.0)],
        vec![polarizer(30.0), retarder],
        vec![circular, polarizer(-20.0)],
    ] {
        let filter = |(i, element): (usize, &FilterElement)| {
            let filter = PolarizingFilter::new(element.clone(), Spectrum::ONE).unwrap();
            sheet(4.0 * i as f64 - 6.0, 3.0, Bsdf::Filter(Box::new(filter)))
        };
        let mut objects: Vec<Object> = filters.iter().enumerate().map(filter).collect();
        objects.push(sheet(5.0, 3.0, Bsdf::Null));
        let light = beam(DVec3::Z * -9.0, DVec3::Z, 0.1);
        let measurement = measured(parts(objects, vec![vacuum()], vec![light], nobody()), 100);
        let turned = filters.into_iter().map(|f| (f, DQuat::IDENTITY));
        let expected = behind(turned.collect());
        // The side that the normal points to comes first.
        let found = &reading(&measurement, 0, "power_stokes").mean;
        println!("{found:?} {expected:?}");
        for (k, expected) in expected.iter().enumerate() {
            assert!((found[2 * k] - expected).abs() < 1e-6);
            assert_eq!(found[2 * k + 1], 0.0);
            let recorded = table(&measurement).stokes.iter().skip(k).step_by(4);
            assert!((recorded.sum::<f64>() - expected).abs() < 1e-6);
        }
    }
}

/// Tests backscattered light of a Rayleigh slab by direction: records in narrow cones have the
/// Stokes vectors of pixels that look into the cones. A beam on a wide slab, summed over all
/// positions, acts as a sun on each position. False-alarm rate 1e-4.
#[test]
fn records_of_scattered_light_are_polarised_as_pixels_are() {
    let (thickness, half, cos_of_cone) = (1.0, 1e3, 0.993);
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::new(half, half, 0.5 * thickness),
        DQuat::IDENTITY,
        DVec3::Z * (-0.5 * thickness),
    );
    let haze = Medium {
        phase: Phase::rayleigh(),
        ..fog(Constant::new(1.0), 1.0, 1.0, 0.0)
    };
    let objects = vec![
        Object {
            shape: Cube::new(place).unwrap().into(),
            sides: Some(Sides {
                interior: 1,
                exterior: 0,
            }),
            ..sheet(0.0, 1.0, Bsdf::Null)
        },
        sheet(1.0, half, Bsdf::Null),
    ];
    let light = beam(TRAVELS * -0.5, TRAVELS, 1e-3);
    let parts = parts(objects, vec![vacuum(), haze], vec![light], nobody());
    let measurement = measured(parts, particles(400_000));
    let table = table(&measurement);
    let mut zs = Vec::new();
    for (i, leaves) in [
        DVec3::new(-0.2, 0.3, 1.0),
        DVec3::new(0.7, 0.4, 0.8),
        DVec3::new(-0.5, -0.6, 0.7),
    ]
    .into_iter()
    .enumerate()
    {
        let leaves = leaves.normalize();
        let scene = slab(thickness, Phase::rayleigh(), -leaves, DVec3::Y);
        let seen = polarized(&scene, None, 100_000, 5 + i as u64);
        let expected = stokes(&seen);
        // Power per solid angle is radiance × cosine per unit of area; a sun of irradiance π sends
        // π × its own cosine.
        let scale = -TRAVELS.z * std::f64::consts::PI / leaves.z;
        let solid_angle = std::f64::consts::TAU * (1.0 - cos_of_cone);
        let within: Vec<usize> = (0..table.particle.len())
            .filter(|row| DVec3::from_slice(&table.direction[3 * row..]).dot(leaves) > cos_of_cone)
            .collect();
        for k in 0..4 {
            let values = within.iter().map(|row| table.stokes[4 * row + k]);
            let sum: f64 = values.clone().sum();
            let error = values.map(|v| v * v).sum::<f64>().sqrt();
            let [mean, error] = [sum, error].map(|v| v * scale / solid_angle);
            let variance = f64::from(seen.film.variance_at(Some(k), 0, 0));
            let error = error.hypot(variance.sqrt());
            println!("{k}: {mean} {} ± {error}", expected[k]);
            assert!(error < 0.06 * expected[0]);
            if k < 3 {
                zs.push((mean - expected[k]) / error);
            } else {
                assert!(mean.abs() < 0.02 * expected[0]);
            }
        }
    }
    max_abs_z(&zs, 1e-4).unwrap();
}
