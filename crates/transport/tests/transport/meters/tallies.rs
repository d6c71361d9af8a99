//! Meters, compared with independent particle tallies of curved-ray transport
//! (`../data/README.md`).

use crate::meters::support::*;
use eikonal::Field;
use eikonal::field::{Acoustic, AcousticMode, Constant, Luneburg};
use glam::{DAffine3, DVec3};
use morgana_transport::Bins;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::meter::{Cosines, Estimator, Meter};
use morgana_transport::render::Measurement;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Cube, Disk, Sphere};
use morgana_transport::sparse::Sparse;
use serde_json::Value;
use std::f64::consts::PI;
use testkit::z_test::{max_abs_z, two_sample_z};

fn numbers(v: &Value) -> Vec<f64> {
    let numbers = v.as_array().unwrap().iter();
    numbers.map(|x| x.as_f64().unwrap()).collect()
}

/// Compares means and errors with a tally by z. Bins that both find empty do not count.
fn compare(
    name: &str,
    (found, errors): (impl AsRef<[f64]>, impl AsRef<[f64]>),
    tally: &Value,
) -> Vec<f64> {
    let (found, errors) = (found.as_ref(), errors.as_ref());
    let list = |v: &Value| match v {
        Value::Number(_) => vec![v.as_f64().unwrap()],
        _ => numbers(v),
    };
    let (mean, error) = (list(&tally["mean"]), list(&tally["se"]));
    assert_eq!(mean.len(), found.len(), "{name}");
    let pairs = found.iter().zip(errors).zip(mean.into_iter().zip(error));
    pairs
        .filter(|((a, _), (b, _))| **a != 0.0 || *b != 0.0)
        .map(|((a, ea), (b, eb))| {
            let z = two_sample_z(*a, *ea, b, eb);
            println!("{name}: {a:.6} ± {ea:.6}, reference {b:.6} ± {eb:.6}, z {z:.2}");
            z
        })
        .collect()
}

fn luneburg_ball(sigma_t: f64, albedo: f64, light: Emitter) -> Parts {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let media = vec![vacuum(), fog(index, sigma_t, albedo, 0.0)];
    parts(
        vec![container(ball, Bsdf::Null)],
        media,
        vec![light],
        nobody(),
    )
}

/// Readings of a meter as means and errors.
fn values(found: &Measurement, meter: usize, name: &str) -> (Vec<f64>, Vec<f64>) {
    let reading = reading(found, meter, name);
    let all = |values: &Sparse<f64>| values.iter().copied().collect();
    (all(&reading.mean), all(&reading.error))
}

#[test]
fn a_luneburg_ball_in_a_beam() {
    let data: Value = serde_json::from_str(include_str!("../../data/B1_g0.json")).unwrap();
    let tallies = &data["tallies"];
    let light = beam(DVec3::Z * -2.0, DVec3::Z, 0.3);
    let parts = luneburg_ball(1.1, 1.0 / 1.1, light);
    let mut collisions = shells(10);
    collisions.estimator = Estimator::Collision;
    let mut exit = through(&parts.objects, 0, [1, 1], false);
    exit.cosines = Some(Cosines {
        count: 10,
        axis: Some(DVec3::Z),
    });
    let meters = [
        Meter::Fluence(shells(10)),
        Meter::Fluence(collisions),
        Meter::Irradiance(exit),
    ];
    let found = run(parts, &meters, &options(particles(100_000), 18));
    let mut zs = Vec::new();
    for meter in [0, 1] {
        zs.extend(compare(
            "fluence",
            values(&found, meter, "fluence"),
            &tallies["fluence_shells"],
        ));
    }
    let media = found.balance.media;
    zs.extend(compare(
        "absorbed",
        ([media.mean], [media.error]),
        &tallies["absorbed_fraction"],
    ));
    let (power, error) = values(&found, 2, "binned_power");
    let exit = &tallies["exit_power_by_direction_cosine"];
    zs.extend(compare("exit", (&power[..10], &error[..10]), exit));
    let (total, error) = values(&found, 2, "power");
    zs.extend(compare(
        "total",
        (&total[..1], &error[..1]),
        &tallies["total_exit_fraction"],
    ));
    // ∫ power × OPL from the entrance. Before it, light at the distance ρ from the axis has the
    // length 2 − (1 − ρ²)^½, on average 1.022956 over the disc. Its correlation with the
    // transmitted light is below 1e-3 of the error here, because it varies by only 0.014.
    let (moment, error) = values(&found, 2, "optical_moment");
    let before = 2.0 - 2.0 / 3.0 * (1.0 - 0.91f64.powf(1.5)) / 0.09;
    let exits = tallies["total_exit_fraction"]["mean"].as_f64().unwrap();
    let opl = &tallies["mean_opl_inside_ball_of_exiting_power"];
    let expected = exits * (opl["mean"].as_f64().unwrap() + before);
    let reference_error = exits * opl["se"].as_f64().unwrap();
    println!("moment: {} ± {}, reference {expected}", moment[0], error[0]);
    zs.push(two_sample_z(moment[0], error[0], expected, reference_error));
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn a_luneburg_ball_around_a_point_source() {
    let data: Value = serde_json::from_str(include_str!("../../data/B4.json")).unwrap();
    let tallies = &data["tallies"];
    let light = Emitter::Point {
        position: DVec3::X * 0.4,
        intensity: Spectrum::splat(0.25 / PI),
    };
    let mut parts = luneburg_ball(1.0, 1.0, light);
    // The sphere's polar angles count from its local z axis, turned towards +x.
    let turned = DAffine3::from_rotation_y(PI / 2.0);
    parts.objects[0].shape = Sphere::new(turned).unwrap().into();
    let positions = through(&parts.objects, 0, [1, 10], false);
    let mut lengths = through(&parts.objects, 0, [1, 1], false);
    lengths.optical_length = Some(Bins {
        min: 0.0,
        max: 5.0,
        count: 20,
    });
    let meters = [
        Meter::Fluence(shells(10)),
        Meter::Irradiance(positions),
        Meter::Irradiance(lengths),
    ];
    let found = run(parts, &meters, &options(particles(100_000), 19));
    let mut zs = compare(
        "fluence",
        values(&found, 0, "fluence"),
        &tallies["fluence_shells"],
    );
    let (irradiance, error) = values(&found, 1, "irradiance");
    let reference = &tallies["irradiance_by_position_cosine"];
    zs.extend(compare(
        "irradiance",
        (&irradiance[..10], &error[..10]),
        reference,
    ));
    let (power, error) = values(&found, 2, "binned_power");
    zs.extend(compare(
        "opl",
        (&power[..20], &error[..20]),
        &tallies["exit_power_by_opl"],
    ));
    // All light escapes, so that the moment is the mean.
    let (moment, error) = values(&found, 2, "optical_moment");
    let mean = &tallies["mean_opl_of_exiting_power"];
    zs.extend(compare("mean opl", (&moment[..1], &error[..1]), mean));
    assert!((values(&found, 2, "power").0[0] - 1.0).abs() < 1e-9);
    max_abs_z(&zs, FAMILY).unwrap();
}

const N_SLAB: f64 = 1.3333;

/// The slab of the waveguide reference, surrounded by the matched index, and a disk just behind it.
fn waveguide(index: Field) -> Parts {
    let slab = scaled(DVec3::new(3.0, 1.5, 1.5), DVec3::X * 3.0);
    let disk = DAffine3::from_translation(DVec3::X * (6.0 + 1e-6))
        * DAffine3::from_rotation_y(PI / 2.0)
        * DAffine3::from_scale(DVec3::splat(1.5));
    let screen = Object {
        name: "screen".into(),
        shape: Disk::new(disk).unwrap().into(),
        bsdf: Bsdf::Null,
        sides: None,
        emitter: None,
    };
    let mut ambient = vacuum();
    ambient.index = Constant::new(N_SLAB).into();
    parts(
        vec![container(Cube::new(slab).unwrap(), Bsdf::Null), screen],
        vec![ambient, fog(index, 0.5, 1.0, 0.85)],
        vec![beam(DVec3::X * 1e-6, DVec3::X, 0.4)],
        nobody(),
    )
}

fn behind_a_slab(entry: &str, index: Field, seed: u64) {
    let data: Value = serde_json::from_str(include_str!("../../data/B3.json")).unwrap();
    let tallies = &data[entry];
    let parts = waveguide(index);
    let faces = through(&parts.objects, 0, [1, 1], true);
    let radii = through(&parts.objects, 1, [15, 1], false);
    let meters = [Meter::Irradiance(faces), Meter::Irradiance(radii)];
    let found = run(parts, &meters, &options(particles(60_000), seed));
    let (power, error) = values(&found, 0, "binned_power");
    let mut zs = compare("faces", (&power[..6], &error[..6]), &tallies["face_powers"]);
    let (irradiance, error) = values(&found, 1, "irradiance");
    let best = &tallies["irradiance_total_best"];
    zs.extend(compare(
        "irradiance",
        (&irradiance[..15], &error[..15]),
        best,
    ));
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn a_slab_with_the_sound_off() {
    behind_a_slab("field_off", Constant::new(N_SLAB).into(), 20);
}

#[test]
fn a_slab_with_the_sound_on() {
    let mode = AcousticMode::new(0.02, 0, 2.0 * PI / 0.6, 0.0).unwrap();
    let sound = Acoustic::new(N_SLAB, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode]).unwrap();
    behind_a_slab("field_on", sound.into(), 21);
}
