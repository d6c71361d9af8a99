//! Random walks through cells, compared with walks by edges, in random volumes of labels and
//! tetrahedra.
//!
//! Walks use edges where a meter keeps records. They show meters each voxel if the meters' cells are
//! the voxels, and straight runs otherwise. False alarms: 1e-3 for all comparisons of a test
//! together. Seeds are fixed.

use morgana_io::LoadOptions;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::ControlFlow;
use testkit::{Family, Rng, z_test};
use transport::meter::{Meter, Reading};
use transport::render::{Handle, MeasureOptions, Measurement, measure};

const VOLUMES: usize = 12;
/// Number of volumes of tetrahedra.
const MESHES: usize = 6;

pub fn run(scene: &Value, seed: u64, max_depth: Option<u32>) -> Measurement {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let options = MeasureOptions {
        first: 0,
        particles: if std::env::var_os("MORGANA_LONG_TESTS").is_some() {
            200_000
        } else {
            20_000
        },
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

/// Adds a meter that makes walks use edges: it keeps records of light far from all else.
pub fn by_edges(scene: &Value) -> Value {
    let mut by_edges = scene.clone();
    by_edges["zz_far"] = json!({
        "type": "sphere", "radius": 0.1, "center": [900, 900, 900], "bsdf": {"type": "null"},
        "records": {"type": "irradiancemeter", "records": true},
    });
    by_edges
}

/// Adds a meter whose cells are no voxels.
fn by_runs(scene: &Value) -> Value {
    let mut by_runs = scene.clone();
    by_runs["zone"] = json!({"type": "fluencemeter", "coordinates": "spherical", "nr": 1});
    by_runs
}

/// Replaces the volume of voxels by six tetrahedra in each voxel, with the same labels and
/// displaced inner nodes.
fn of_tetrahedra(scene: &Value, rng: &mut Rng) -> Value {
    let rows = |value: &Value| value.as_array().unwrap().clone();
    let data: Vec<Vec<Vec<u64>>> = serde_json::from_value(scene["tissue"]["data"].clone()).unwrap();
    let size = [data[0][0].len(), data[0].len(), data.len()];
    let number = |p: [usize; 3]| p[0] + (size[0] + 1) * (p[1] + (size[1] + 1) * p[2]);
    let mut nodes = Vec::new();
    for k in 0..=size[2] {
        for (j, i) in (0..=size[1]).flat_map(|j| (0..=size[0]).map(move |i| (j, i))) {
            let at = [i, j, k];
            let place = |axis: usize| {
                let is_inner = (1..size[axis]).contains(&at[axis]);
                let shift = if is_inner { rng.range(-0.2, 0.2) } else { 0.0 };
                (at[axis] as f64 + shift) / size[axis] as f64
            };
            nodes.push([0, 1, 2].map(place));
        }
    }
    let (mut elements, mut regions) = (Vec::new(), Vec::new());
    for (k, plane) in data.iter().enumerate() {
        for (j, row) in plane.iter().enumerate() {
            for (i, label) in row.iter().enumerate().filter(|(_, label)| **label > 0) {
                let corner = |c: usize| number([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]);
                for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                    elements.push([0, a, b, 7].map(corner));
                    regions.push(*label);
                }
            }
        }
    }
    let used: BTreeSet<usize> = elements.iter().flatten().copied().collect();
    let numbers: BTreeMap<usize, usize> = used.iter().copied().zip(0..).collect();
    let mut scene = scene.clone();
    let tissue = &mut scene["tissue"];
    let labels = regions.iter().max().map_or(0, |label| *label as usize);
    let properties = rows(&tissue["properties"])[..=labels].to_vec();
    tissue["type"] = json!("tetrahedra");
    tissue["nodes"] = used.iter().map(|node| json!(nodes[*node])).collect();
    tissue["elements"] = json!(
        elements
            .iter()
            .map(|e| e.map(|node| numbers[&node]))
            .collect::<Vec<_>>()
    );
    tissue["regions"] = json!(regions);
    tissue["properties"] = json!(properties);
    tissue.as_object_mut().unwrap().remove("data");
    scene
}

/// Names and z-scores of all quantities that two measurements share.
pub fn differences(a: &Measurement, b: &Measurement) -> Vec<(String, f64)> {
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
        // Leave out bins with nothing but rounding errors of faces.
        let floor = 1e-9 * a.mean.iter().fold(0.0, |most, mean| mean.abs().max(most));
        let is_lit = |i: usize| a.mean[i].abs().max(b.mean[i].abs()) > floor;
        let is_sure = |i: &usize| !a.few[*i] && !b.few[*i] && is_lit(*i);
        for i in (0..a.mean.len()).filter(is_sure) {
            let z = z_test::two_sample_z(a.mean[i], a.error[i], b.mean[i], b.error[i]);
            zs.push((format!("{} {i}", a.name), z));
        }
    }
    zs
}

impl Kind {
    /// Varies refraction, gates, modulation, other surfaces and a largest depth.
    fn numbered(number: usize) -> Self {
        Kind {
            refraction: number.is_multiple_of(2),
            gates: number % 3 == 1,
            modulated: number % 4 == 1,
            others: number % 4 >= 2,
            max_depth: (number % 5 == 4).then_some(9),
        }
    }
}

/// Comparisons of walks through cells with walks by edges.
struct Comparisons {
    family: Family,
    count: usize,
    sum_of_squares: f64,
}

impl Comparisons {
    fn new() -> Self {
        Comparisons {
            family: Family::new(1e-3),
            count: 0,
            sum_of_squares: 0.0,
        }
    }

    /// Measures `cells` through cells, and compares it with `edges`.
    fn compare(&mut self, cells: &Value, edges: &Measurement, kind: Kind) {
        let through = run(cells, 1, kind.max_depth);
        let share = through.stats.in_cells as f64 / through.stats.edges as f64;
        // Flights near other surfaces use edges.
        assert!(share > 0.05, "{kind:?}: {share}");
        assert_eq!((through.stats.lost, edges.stats.lost), (0, 0), "{kind:?}");
        for (name, z) in differences(&through, edges) {
            self.sum_of_squares += z * z;
            self.count += 1;
            let name = format!("{kind:?}, {name}: z = {z:.2}");
            self.family.push(name, z_test::p_value(z));
        }
    }

    fn check(self) {
        let mean_square = self.sum_of_squares / self.count as f64;
        println!("{} comparisons, mean square of z {mean_square}", self.count);
        assert!(self.count > 1000, "{}", self.count);
        self.family.check().unwrap();
    }
}

/// Measures a scene by edges.
fn measured_by_edges(scene: &Value, kind: Kind) -> Measurement {
    let edges = run(&by_edges(scene), 2, kind.max_depth);
    assert_eq!(edges.stats.in_cells, 0, "{kind:?}");
    edges
}

#[test]
fn walks_through_cells_agree_with_walks_by_edges() {
    let (mut rng, mut comparisons) = (Rng::new(26), Comparisons::new());
    for kind in (0..VOLUMES).map(Kind::numbered) {
        let scene = random_scene(&mut rng, kind);
        let edges = measured_by_edges(&scene, kind);
        comparisons.compare(&scene, &edges, kind);
        if kind.others {
            comparisons.compare(&by_runs(&scene), &edges, kind);
        }
    }
    comparisons.check();
}

#[test]
fn walks_through_tetrahedra_agree_with_walks_by_edges() {
    let (mut rng, mut comparisons) = (Rng::new(27), Comparisons::new());
    for kind in (0..MESHES).map(Kind::numbered) {
        let voxels = random_scene(&mut rng, kind);
        let scene = of_tetrahedra(&voxels, &mut rng);
        let edges = measured_by_edges(&scene, kind);
        comparisons.compare(&scene, &edges, kind);
    }
    comparisons.check();
}
