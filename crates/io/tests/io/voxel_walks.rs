//! Random walks through voxels, compared with walks by edges, in random volumes of labels.
//!
//! Walks use edges as soon as a meter observes anything except voxels. False alarms: 1e-3 for all
//! comparisons together. Seeds are fixed.

use morgana_io::LoadOptions;
use serde_json::{Value, json};
use std::fs;
use std::ops::ControlFlow;
use testkit::{Family, Rng, z_test};
use transport::meter::{Meter, Reading};
use transport::render::{Handle, MeasureOptions, Measurement, measure};

const VOLUMES: usize = 12;

fn run(scene: &Value, seed: u64, max_depth: Option<u32>) -> Measurement {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let options = MeasureOptions {
        first: 0,
        particles: 20_000,
        seed,
        max_depth,
        rr_depth: 5,
    };
    let go_on = |_| ControlFlow::Continue(());
    measure(&loaded.groups, &meters, &options, &Handle::default(), go_on).unwrap()
}

/// Properties of a scene of labels.
#[derive(Clone, Copy, Debug)]
struct Kind {
    refraction: bool,
    gates: bool,
    /// True for modulated light.
    modulated: bool,
    /// True for a black ball inside, and a disc that measures outgoing light.
    others: bool,
    max_depth: Option<u32>,
}

/// Voxels with unequal sides, rotated or mirrored, with four labels; two labels have equal indices,
/// one scatters nothing, and 0 is outside.
fn random_scene(rng: &mut Rng, kind: Kind) -> Value {
    let [nx, ny, nz] = [0; 3].map(|_| 3 + (rng.next_1d() * 4.0) as usize);
    let mut label = || match rng.next_1d() {
        u if u < 0.05 => 0,
        u => 1 + (u * 97.0) as u32 % 4,
    };
    let mut row = || -> Vec<u32> { (0..nx).map(|_| label()).collect() };
    let mut plane = || -> Vec<Vec<u32>> { (0..ny).map(|_| row()).collect() };
    let data: Vec<_> = (0..nz).map(|_| plane()).collect();
    let mut property = |n: f64, scattering: f64| {
        let [absorption, g] = [rng.range(0.01, 0.2), rng.range(-0.5, 0.95)];
        json!([absorption, scattering * rng.range(0.5, 4.0), g, n])
    };
    let properties = [
        json!([0, 0, 1, 1.0]),
        property(1.37, 1.0),
        property(1.37, 1.0),
        property(1.5, 1.0),
        property(1.2, 0.0),
    ];
    let mirror = if rng.next_1d() < 0.5 { -1.0 } else { 1.0 };
    let [x, y, z] = [0; 3].map(|_| rng.range(2.0, 6.0));
    let to_world = {
        let turn = json!({"rotate": {"axis": [1, 2, -1], "angle": rng.range(0.0, 90.0)}});
        let shift = json!({"translate": rng.uniform::<3>()});
        move |first: [Value; 2]| {
            let [a, b] = first;
            json!([a, b, turn, shift])
        }
    };
    let place = |at: [f64; 3]| json!({"translate": [mirror * x * at[0], y * at[1], z * at[2]]});
    let whole = to_world([json!({"scale": [mirror * x, y, z]}), json!({"scale": 1})]);
    let mut scene = json!({
        "type": "scene",
        "integrator": {"type": "particle"},
        "beam": {
            "type": "collimated", "radius": 0.5, "power": 1,
            "to_world": to_world([place([0.55, 0.45, -0.3]), json!({"scale": 1})])
        },
        "tissue": {
            "type": "labels", "data": data, "to_world": whole, "properties": properties,
            "refraction": kind.refraction
        },
        "cells": {"type": "fluencemeter", "nx": nx, "ny": ny, "nz": nz, "to_world": whole}
    });
    if kind.gates {
        for (key, value) in [("min_bound", 2.0), ("max_bound", 14.0), ("bin_width", 3.0)] {
            scene["cells"][key] = json!(value);
        }
        scene["cells"]["weight_windows"] = json!(true);
    }
    if kind.modulated {
        scene["cells"]["modulation_frequencies"] = json!([1e8, 5e8]);
        scene["cells"]["metres_per_unit"] = json!(0.01);
    }
    if kind.others {
        scene["ball"] = json!({
            "type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 0.2},
            "to_world": to_world([json!({"scale": 0.4}), place([0.3, 0.6, 0.5])])
        });
        scene["screen"] = json!({
            "type": "rectangle", "bsdf": {"type": "null"},
            "to_world": to_world([json!({"scale": 2}), place([0.5, 0.5, 1.2])]),
            "through": {"type": "irradiancemeter"}
        });
    }
    scene
}

/// Names and z-scores of all quantities that two measurements share.
fn differences(a: &Measurement, b: &Measurement) -> Vec<(String, f64)> {
    let mut zs = Vec::new();
    let balances = |m: &Measurement| {
        [
            m.balance.media,
            m.balance.surfaces,
            m.balance.escaped,
            m.balance.cut,
        ]
    };
    for (i, (a, b)) in balances(a).into_iter().zip(balances(b)).enumerate() {
        let z = z_test::two_sample_z(a.mean, a.error, b.mean, b.error);
        zs.push((format!("balance {i}"), z));
    }
    // All readings except readings of the zone.
    let readings = |m: &Measurement| -> Vec<Reading> {
        let all = m.readings.iter().flatten();
        all.filter(|r| r.mean.len() > 1).cloned().collect()
    };
    for (a, b) in readings(a).iter().zip(&readings(b)) {
        assert_eq!((&a.name, a.mean.len()), (&b.name, b.mean.len()));
        for i in (0..a.mean.len()).filter(|i| !a.few[*i] && !b.few[*i]) {
            let z = z_test::two_sample_z(a.mean[i], a.error[i], b.mean[i], b.error[i]);
            zs.push((format!("{} {i}", a.name), z));
        }
    }
    zs
}

/// Varies the sides of voxels, refraction, gates, modulation, other surfaces and a largest depth.
#[test]
fn walks_through_voxels_agree_with_walks_by_edges() {
    let mut rng = Rng::new(26);
    let (mut family, mut sum, mut count) = (Family::new(1e-3), 0.0, 0);
    for number in 0..VOLUMES {
        let kind = Kind {
            refraction: number % 2 == 0,
            gates: number % 3 == 1,
            modulated: number % 4 == 1,
            others: number % 4 >= 2,
            max_depth: (number % 5 == 4).then_some(9),
        };
        let scene = random_scene(&mut rng, kind);
        let mut by_edges = scene.clone();
        by_edges["zone"] = json!({"type": "fluencemeter", "coordinates": "spherical", "nr": 1});
        let through = run(&scene, 1, kind.max_depth);
        let edges = run(&by_edges, 2, kind.max_depth);
        assert_eq!(edges.stats.in_voxels, 0, "{kind:?}");
        let share = through.stats.in_voxels as f64 / through.stats.edges as f64;
        assert!(share > 0.2, "{kind:?}: {share}");
        assert_eq!((through.stats.lost, edges.stats.lost), (0, 0), "{kind:?}");
        for (name, z) in differences(&through, &edges) {
            sum += z * z;
            count += 1;
            family.push(format!("{kind:?}, {name}: z = {z:.2}"), z_test::p_value(z));
        }
    }
    println!(
        "{count} comparisons, mean square of z {}",
        sum / f64::from(count)
    );
    assert!(count > 1000, "{count}");
    family.check().unwrap();
}
