//! Records of detected light: their sums, path lengths in media and labels, results for other
//! absorption, and the choice among too many records.

use crate::meters::support::*;
use eikonal::field::{Constant, Luneburg};
use glam::{DAffine3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::{Medium, MediumLabel, MediumLabels};
use morgana_transport::meter::{Acceptance, Meter, Patch, RecordTable};
use morgana_transport::render::{Handle, MeasureOptions, MeasureState, Measurement};
use morgana_transport::scene::Parts;
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::volume::LabelGrid;
use morgana_transport::{Bins, Scene, Spectrum};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A Luneburg ball of fog with a beam into it.
fn ball(albedo: f64, g: f64) -> Parts {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let medium = fog(index, 3.0, albedo, g);
    let light = beam(DVec3::Z * -2.0, DVec3::Z, 0.3);
    ball_of(medium, light)
}

fn ball_of(medium: Medium, light: Emitter) -> Parts {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    parts(vec![ball], vec![vacuum(), medium], vec![light], nobody())
}

/// A meter around the ball that keeps up to `most` records.
fn around(parts: &Parts, most: usize) -> Meter {
    let mut meter = through(&parts.objects, 0, [1, 1], false);
    meter.most_records = Some(most);
    Meter::Irradiance(meter)
}

fn table(measurement: &Measurement) -> &RecordTable {
    measurement.records[0].as_ref().unwrap()
}

/// Sum over records, and its standard error with particles as samples.
fn sum(table: &RecordTable, value: impl Fn(usize) -> f64) -> [f64; 2] {
    let mut totals: BTreeMap<u64, f64> = BTreeMap::new();
    for row in 0..table.particle.len() {
        *totals.entry(table.particle[row]).or_default() += value(row);
    }
    let n = table.particles as f64;
    let mean: f64 = totals.values().sum();
    let squares: f64 = totals.values().map(|t| t * t).sum();
    [mean, (squares - mean * mean / n).max(0.0).sqrt()]
}

fn leaving(table: &RecordTable) -> impl Fn(usize) -> f64 + '_ {
    |row| table.weight[row] * (1.0 - table.side[row])
}

#[test]
fn weights_add_up_to_power() {
    let gates = Bins {
        min: 0.0,
        max: 40.0,
        count: 10,
    };
    for gates in [None, Some(gates)] {
        let parts = ball(0.9, 0.6);
        let Meter::Irradiance(mut meter) = around(&parts, 1_000_000) else {
            unreachable!()
        };
        (meter.optical_length, meter.weight_windows) = (gates, gates.is_some());
        let measured = run(parts, &[Meter::Irradiance(meter)], &options(5_000, 3));
        let table = table(&measured);
        let divided = table.particle.len() > measured.particles as usize * 2;
        assert_eq!(divided, gates.is_some(), "{}", table.particle.len());
        for (side, sign) in [(0, 0.0), (1, 1.0)] {
            let on = |row: usize| f64::from(u8::from(table.side[row] == sign));
            let [power, error] = sum(table, |row| on(row) * table.weight[row]);
            let reading = reading(&measured, 0, "power");
            assert!((power / reading.mean[side] - 1.0).abs() < 1e-12);
            assert!((error - reading.error[side]).abs() < 1e-3 * reading.error[side] + 1e-6);
            let weighed = |row| on(row) * table.weight[row] * table.optical_length[row];
            let [moment, _] = sum(table, weighed);
            let reading = self::reading(&measured, 0, "optical_moment").mean[side];
            assert!((moment / reading - 1.0).abs() < 1e-12);
        }
    }
}

/// Particles are split, and some copies reach the largest depth: the lengths of each record in its
/// regions add up to its optical length.
#[test]
fn copies_keep_their_own_ways_where_paths_are_cut() {
    const N: f64 = 1.3;
    let medium = fog(Constant::new(N), 4.0, 0.95, 0.3);
    let mut parts = ball_of(medium, beam(DVec3::Z * -2.0, DVec3::Z, 0.3));
    parts.media[0] = Medium::transparent("around", Constant::new(N));
    let mut meter = through(&parts.objects, 0, [1, 1], false);
    meter.most_records = Some(1_000_000);
    let gates = Bins {
        min: 0.0,
        max: 30.0,
        count: 10,
    };
    (meter.optical_length, meter.weight_windows) = (Some(gates), true);
    let options = MeasureOptions {
        max_depth: Some(14),
        ..options(3_000, 3)
    };
    let measured = run(parts, &[Meter::Irradiance(meter)], &options);
    let table = table(&measured);
    let divided = table.particle.windows(2).filter(|w| w[0] == w[1]).count();
    assert!(divided > 1_000, "{divided}");
    for (row, length) in table.optical_length.iter().enumerate() {
        let way: f64 = table.path_length[2 * row..2 * row + 2].iter().sum();
        assert!((N * way - length).abs() < 1e-9 * length, "{way} {length}");
    }
}

/// Four comparisons, the largest |z| of which is 1.4: false alarms 4 × 2.7e-4 at 3.6.
#[test]
fn other_absorption_is_a_factor() {
    let particles = particles(60_000);
    let with = |absorption: f64, seed| {
        let (scattering, sigma_t) = (2.7, 2.7 + absorption);
        let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
        let medium = fog(index, sigma_t, scattering / sigma_t, 0.6);
        let parts = ball_of(medium, beam(DVec3::Z * -2.0, DVec3::Z, 0.3));
        let meter = around(&parts, 10_000_000);
        run(parts, &[meter], &options(particles, seed))
    };
    let known = with(0.3, 5);
    let table = table(&known);
    let fog = table.regions.iter().position(|r| r.name == "fog").unwrap();
    let absorption = table.regions[fog].absorption.as_ref().unwrap()[0];
    assert!((absorption - 0.3).abs() < 1e-12);
    for (seed, absorption) in [(6, 0.0), (7, 0.1), (8, 0.6), (9, 1.2)] {
        let length = |row| table.path_length[row * table.regions.len() + fog];
        let power = leaving(table);
        let rescaled = |row| power(row) * (-(absorption - 0.3) * length(row)).exp();
        let [mean, error] = sum(table, rescaled);
        let anew = with(absorption, seed);
        let anew = reading(&anew, 0, "power");
        let z = (mean - anew.mean[0]) / error.hypot(anew.error[0]);
        println!(
            "{absorption}: {mean} ± {error}, anew {} ± {}: z {z}",
            anew.mean[0], anew.error[0]
        );
        assert!(z.abs() < 3.6, "{z}");
    }
}

/// Without absorption, the sum of 1 − cos ϑ has (1 − g) times the mean number of scatterings,
/// wherever walks end (Wald's identity). Variances of the deviations add up. False alarms 2.7e-4 at
/// 3.6.
#[test]
fn momentum_transfer_follows_from_g() {
    for g in [0.0, 0.8] {
        let parts = ball(1.0, g);
        let meter = around(&parts, 10_000_000);
        let measured = run(parts, &[meter], &options(particles(40_000), 21));
        let table = table(&measured);
        let at = |row: usize| row * table.regions.len() + 1;
        let excess = |row| {
            let expected = (1.0 - g) * table.scatterings[at(row)];
            leaving(table)(row) * (table.momentum_transfer[at(row)] - expected)
        };
        let [mean, error] = sum(table, excess);
        println!("g {g}: {mean} ± {error}");
        assert!(mean.abs() < 3.6 * error);
        assert!(error < 0.02, "no power to tell: {error}");
    }
}

#[test]
fn optical_lengths_are_those_of_ways() {
    let inside = 1.4;
    let medium = fog(Constant::new(inside), 3.0, 0.9, 0.3);
    let parts = ball_of(medium, beam(DVec3::Z * -2.0, DVec3::Z, 0.3));
    let meter = around(&parts, 1_000_000);
    let measured = run(parts, &[meter], &options(2_000, 4));
    let table = table(&measured);
    assert_eq!(table.regions[0].name, "vacuum");
    for (row, lengths) in table.path_length.chunks(2).enumerate() {
        let optical = lengths[0] + inside * lengths[1];
        assert!((table.optical_length[row] - optical).abs() < 1e-9);
        let position = DVec3::from_slice(&table.position[3 * row..]);
        let direction = DVec3::from_slice(&table.direction[3 * row..]);
        assert!((position.length() - 1.0).abs() < 1e-9);
        let outward = position.dot(direction) > 0.0;
        assert_eq!(table.side[row], if outward { 0.0 } else { 1.0 });
    }
}

/// A cube of four voxels across with labels 0, 1 and 2.
fn labelled(index: impl Into<eikonal::Field>, sigma_t: f64) -> Parts {
    let labels: Vec<u8> = (0..64u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 20) as u8 % 3)
        .collect();
    let to_world = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let grid = Arc::new(LabelGrid::new([4; 3], labels, to_world).unwrap());
    let label = |name: &str| MediumLabel {
        name: name.into(),
        extinction: Spectrum::splat(sigma_t),
        absorption: Spectrum::splat(0.1 * sigma_t),
        velocity: None,
        fluorescence: None,
    };
    let medium = Medium {
        labels: MediumLabels::new(grid, ["a", "b", "c"].map(label).into()),
        ..fog(index, sigma_t, 0.9, 0.5)
    };
    let cube = container(Cube::new(DAffine3::IDENTITY).unwrap(), Bsdf::Null);
    let start = DVec3::new(-1.4, -1.9, -2.0);
    let light = beam(start, DVec3::new(0.7, 0.95, 1.0).normalize(), 1e-9);
    parts(vec![cube], vec![vacuum(), medium], vec![light], nobody())
}

#[test]
fn lengths_are_told_apart_by_label() {
    let parts = labelled(Constant::new(1.0), 0.0);
    let grid = parts.media[1].labels.as_ref().unwrap().grid().clone();
    let meter = around(&parts, 1_000);
    let measured = run(parts, &[meter], &options(64, 1));
    let table = table(&measured);
    // Points along the line, many per voxel.
    let direction = DVec3::new(0.7, 0.95, 1.0).normalize();
    let (count, end) = (1_000_000, 5.0);
    let mut expected = [0.0; 4];
    for i in 0..count {
        let x = DVec3::new(-1.4, -1.9, -2.0)
            + direction * ((f64::from(i) + 0.5) / f64::from(count) * end);
        if x.abs().max_element() < 1.0 {
            expected[1 + usize::from(grid.at(x))] += end / f64::from(count);
        }
    }
    assert!(
        expected[1..].iter().all(|length| *length > 0.05),
        "{expected:?}"
    );
    let leaves = (0..table.particle.len())
        .find(|row| table.side[*row] == 0.0)
        .unwrap();
    for region in 1..4 {
        let found = table.path_length[4 * leaves + region];
        assert!(
            (found - expected[region]).abs() < 1e-4,
            "{:?} {expected:?}",
            &table.path_length[4 * leaves..4 * leaves + 4]
        );
    }
}

#[test]
fn labels_share_out_curved_ways() {
    let index = || Luneburg::new(1.0, DVec3::ZERO, 2.0).unwrap();
    let parts = labelled(index(), 1.5);
    let mut plain = labelled(index(), 1.5);
    plain.media[1].labels = None;
    let [labelled, plain] = [parts, plain].map(|parts| {
        let meter = around(&parts, 100_000);
        run(parts, &[meter], &options(2_000, 8))
    });
    let (labelled, plain) = (table(&labelled), table(&plain));
    assert_eq!(labelled.particle, plain.particle);
    for row in 0..plain.particle.len() {
        for (by_label, whole) in [
            (&labelled.path_length, &plain.path_length),
            (&labelled.scatterings, &plain.scatterings),
            (&labelled.momentum_transfer, &plain.momentum_transfer),
        ] {
            let sum: f64 = by_label[4 * row + 1..4 * row + 4].iter().sum();
            assert!((sum - whole[2 * row + 1]).abs() < 1e-9 * sum.max(1.0));
        }
    }
}

/// Fractions of an isotropic source's light that the surrounding meters accept. False alarms 2 ×
/// 2.7e-4.
#[test]
fn meters_accept_spots_and_cones() {
    // Rays of a source off the centre of a sphere meet it at various angles to the normal.
    let (inside, beyond) = (1.0, 1.0);
    let offset = 0.5;
    let power = Spectrum::ONE / (4.0 * std::f64::consts::PI);
    let source = |x: f64| Emitter::Point {
        position: DVec3::X * x,
        intensity: power,
    };
    let accepted = |x: f64, acceptance: Acceptance| {
        let parts = ball_of(
            Medium::transparent("clear", Constant::new(inside)),
            source(x),
        );
        let mut meter = through(&parts.objects, 0, [1, 1], false);
        meter.acceptance = acceptance;
        let measured = run(parts, &[Meter::Irradiance(meter)], &options(40_000, 2));
        let power = reading(&measured, 0, "power");
        assert_eq!(
            measured.readings[0].iter().any(|r| r.name == "irradiance"),
            acceptance.patch.is_none()
        );
        [power.mean[0], power.error[0]]
    };
    // A patch of chord r from the pole is a cap with the fraction r²/4.
    let patch = Patch {
        center: DVec3::Z,
        radius: 0.8,
    };
    let by_spot = Acceptance {
        patch: Some(patch),
        numerical_aperture: None,
    };
    // Law of sines: sin θ = d sin α, with the angle α from the axis through source and centre.
    let numerical_aperture = 0.3;
    let by_cone = Acceptance {
        patch: None,
        numerical_aperture: Some(numerical_aperture),
    };
    let sine: f64 = numerical_aperture / beyond / offset;
    let cone = 1.0 - (1.0 - sine * sine).sqrt();
    for (x, acceptance, expected) in [(0.0, by_spot, 0.16), (offset, by_cone, cone)] {
        let [mean, error] = accepted(x, acceptance);
        println!("{mean} ± {error}, expected {expected}");
        assert!((mean - expected).abs() < 3.6 * error);
    }
}

/// Runs some particles. Returns the state and the scene.
fn state(parts: Parts, meters: &[Meter], options: &MeasureOptions) -> (MeasureState, Scene) {
    let scene = Scene::new(parts).unwrap();
    let scenes = std::slice::from_ref(&scene);
    let mut state = MeasureState::new(scenes, meters).unwrap();
    let go_on = |_: &MeasureState| ControlFlow::Continue(());
    state
        .advance(scenes, meters, options, &Handle::default(), go_on)
        .unwrap();
    (state, scene)
}

#[test]
fn what_is_kept_does_not_depend_on_parts() {
    let meters = [around(&ball(0.9, 0.6), 700)];
    let part = |first, particles| MeasureOptions {
        first,
        ..options(particles, 31)
    };
    let (whole, scene) = state(ball(0.9, 0.6), &meters, &part(0, 6_400));
    let [mut late, early] =
        [part(3_200, 3_200), part(0, 3_200)].map(|o| state(ball(0.9, 0.6), &meters, &o).0);
    late.merge(&early).unwrap();
    let [whole, merged] = [whole, late].map(|state| {
        let scenes = std::slice::from_ref(&scene);
        let measured = state.into_measurement(scenes, &meters).unwrap();
        (
            table(&measured).clone(),
            reading(&measured, 0, "power").clone(),
            measured.particles,
        )
    });
    assert_eq!(whole.0, merged.0);
    let (table, power, particles) = whole;
    assert!(
        (350..=700).contains(&table.particle.len()),
        "{}",
        table.particle.len()
    );
    assert!(table.particles < particles / 8);
    // The kept records represent all: within 4 standard errors (6e-5).
    let [mean, error] = sum(&table, leaving(&table));
    assert!(
        (mean - power.mean[0]).abs() < 4.0 * error,
        "{mean} ± {error}: {}",
        power.mean[0]
    );
}

/// Each group of channels has its own particles, and another number of records. Records of the same
/// particles are kept. False alarms 10 · 2 · 6e-5.
#[test]
fn groups_of_channels_keep_records_of_the_same_particles() {
    const MAX_RECORDS: usize = 500;
    let scene = |albedo| {
        let mut parts = ball(albedo, 0.6);
        parts.film.channels = 5;
        Scene::new(parts).unwrap()
    };
    let scenes = [scene(0.95), scene(0.3)];
    let meters = [around(&ball(0.95, 0.6), MAX_RECORDS)];
    for seed in 0..10 {
        let mut state = MeasureState::new(&scenes, &meters).unwrap();
        let go_on = |_: &MeasureState| ControlFlow::Continue(());
        let options = options(3_200, seed);
        state
            .advance(&scenes, &meters, &options, &Handle::default(), go_on)
            .unwrap();
        let measured = state.into_measurement(&scenes, &meters).unwrap();
        let (table, power) = (table(&measured), reading(&measured, 0, "power"));
        let records = table.particle.len();
        assert!(
            (MAX_RECORDS / 4..=MAX_RECORDS).contains(&records),
            "{records}"
        );
        assert!(table.particle.is_sorted() && table.weight.len() == 5 * records);
        let by_particle = table.particle.chunk_by(|a, b| a == b).count() as u64;
        assert!(by_particle <= table.particles);
        for channel in [0, 4] {
            let value = |row: usize| table.weight[5 * row + channel] * (1.0 - table.side[row]);
            let [mean, error] = sum(table, value);
            let z = (mean - power.mean[channel]) / error;
            assert!(z.abs() < 4.0, "{seed}, {channel}: {mean} ± {error}, {z}");
        }
    }
}
