//! Meshes of tetrahedra, compared with the same regions as volumes of labels, and mistakes.
//!
//! False alarms: 1e-3 for each test. Seeds are fixed.

use crate::common::{load_json, measure_json};
use serde_json::{Value, json};
use testkit::z_test::{max_abs_z, two_sample_z};

const FAMILY: f64 = 1e-3;
/// Labels of the voxels, z slowest: layers with a step, and a cavity of label 0.
const LABELS: [[[u32; 3]; 3]; 3] = [
    [[1, 1, 1], [1, 1, 1], [1, 1, 2]],
    [[1, 2, 2], [2, 0, 2], [2, 2, 2]],
    [[3, 3, 3], [3, 3, 3], [3, 3, 3]],
];

/// Nodes, elements and regions of the voxels that have a label, six tetrahedra in each.
fn divided() -> [Value; 3] {
    let (mut elements, mut regions) = (Vec::new(), Vec::new());
    let node = |x: usize, y: usize, z: usize| x + 4 * (y + 4 * z);
    for (z, plane) in LABELS.iter().enumerate() {
        for (y, row) in plane.iter().enumerate() {
            for (x, label) in row.iter().enumerate().filter(|(_, label)| **label > 0) {
                let corner = |i: usize| node(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
                for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                    elements.push([0, a, b, 7].map(corner));
                    regions.push(*label);
                }
            }
        }
    }
    let place = |i: usize| [i % 4, i / 4 % 4, i / 16].map(|k| k as f64 / 3.0);
    let nodes: Vec<[f64; 3]> = (0..64).map(place).collect();
    [json!(nodes), json!(elements), json!(regions)]
}

/// A scene with a body, light in one of its layers, and meters in and around it.
fn scene(body: Value) -> Value {
    let mut body = body;
    let tissue = |s: f64, a: f64, g: f64, n: f64| {
        json!({
            "type": "homogeneous", "sigma_s": s, "sigma_a": a, "ior": n, "phase": {"type": "hg", "g": g},
        })
    };
    let place = json!([{"scale": [4, 3, 5]}, {"rotate": {"axis": [1, 2, -1], "angle": 30}}]);
    let media = [
        tissue(2.0, 0.1, 0.7, 1.4),
        tissue(1.0, 0.3, 0.0, 1.4),
        tissue(3.0, 0.05, 0.9, 1.6),
    ];
    for (key, medium) in ["1", "2", "3"].into_iter().zip(media) {
        body[key] = medium;
    }
    body["to_world"] = place.clone();
    body["around"] = json!({"type": "irradiancemeter"});
    json!({
        "type": "scene", "integrator": {"type": "particle"}, "body": body,
        "beam": {"type": "collimated", "radius": 0.4, "power": 1, "to_world": [{"translate": [2, 1, -3]}]},
        "cells": {"type": "fluencemeter", "nx": 3, "ny": 3, "nz": 3, "to_world": place},
    })
}

/// Voxels and tetrahedra of the same regions, with two regions of equal index and one that
/// refracts, have the same fluence and the same light through the outer surface.
#[test]
fn tetrahedra_are_their_regions() {
    let [nodes, elements, regions] = divided();
    let voxels = scene(json!({"type": "labels", "data": LABELS}));
    let tetrahedra = scene(json!({
        "type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": regions,
    }));
    let [a, b] =
        [(&voxels, 1), (&tetrahedra, 2)].map(|(body, seed)| measure_json(body, 20_000, seed));
    assert_eq!(b.stats.lost, 0);
    let mut zs = Vec::new();
    for (a, b) in a.readings.iter().flatten().zip(b.readings.iter().flatten()) {
        assert_eq!((&a.name, a.mean.len()), (&b.name, b.mean.len()));
        let lit = (0..a.mean.len()).filter(|i| !(a.few[*i] || b.few[*i]) && a.mean[*i] > 0.0);
        zs.extend(lit.map(|i| two_sample_z(a.mean[i], a.error[i], b.mean[i], b.error[i])));
    }
    assert!(zs.len() > 55, "{}", zs.len());
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Nodes may be numbered from 1, the region may be a fifth column, and a file may hold the arrays
/// by JMesh's names. The results have equal bits.
#[test]
fn arrays_have_several_forms() {
    let [nodes, elements, regions] = divided();
    let rows = elements
        .as_array()
        .unwrap()
        .iter()
        .zip(regions.as_array().unwrap());
    let joined = rows.map(|(row, region)| {
        let mut row: Vec<u64> = row
            .as_array()
            .unwrap()
            .iter()
            .map(|n| n.as_u64().unwrap() + 1)
            .collect();
        row.push(region.as_u64().unwrap());
        row
    });
    let joined: Vec<Vec<u64>> = joined.collect();
    let plain =
        json!({"type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": regions});
    let other = json!({"type": "tetrahedra", "nodes": nodes, "elements": joined});
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.jmsh");
    let written = json!({"MeshNode": nodes, "MeshElem(tet)": joined});
    std::fs::write(&path, written.to_string()).unwrap();
    let file = json!({"type": "tetrahedra", "filename": path});
    let [first, second, third] =
        [plain, other, file].map(|body| measure_json(&scene(body), 20_000, 5).readings);
    assert_eq!(first, second);
    assert_eq!(first, third);
}

/// MMC marks elements around wide sources by the region −1, and elements around detectors by −2.
/// They are outside the tissue, as region 0.
#[test]
fn elements_around_sources_and_detectors_of_mmc_are_outside() {
    let [nodes, elements, regions] = divided();
    let marked = |first: i64, second: i64| {
        let regions = regions.as_array().unwrap().iter().enumerate();
        let regions: Vec<i64> = regions
            .map(|(i, region)| match i {
                0..6 => first,
                6..12 => second,
                _ => region.as_i64().unwrap(),
            })
            .collect();
        let body =
            json!({"type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": regions});
        measure_json(&scene(body), 2000, 5).readings
    };
    assert_eq!(marked(-1, -2), marked(0, 0));
}

/// A flat element of region 0, as meshes around wide sources have, counts for nothing.
#[test]
fn elements_outside_may_be_flat() {
    let [nodes, elements, regions] = divided();
    let [mut more, mut of_all] = [elements.clone(), regions.clone()];
    more.as_array_mut().unwrap().push(json!([3, 7, 11, 15]));
    of_all.as_array_mut().unwrap().push(json!(0));
    let readings = |elements: &Value, regions: &Value| {
        let body =
            json!({"type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": regions});
        measure_json(&scene(body), 2000, 5).readings
    };
    assert_eq!(readings(&more, &of_all), readings(&elements, &regions));
    let told = warnings(nodes.as_array().unwrap(), &more, &of_all);
    assert!(told.contains("mesh_outside"), "{told}");
}

/// A black disc exactly on inner faces of tetrahedra absorbs as much as one just beside them.
#[test]
fn surfaces_on_faces_are_met() {
    let [nodes, elements, regions] = divided();
    let absorbed = |shift: f64, seed: u64| {
        let mut scene = scene(json!({
            "type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": regions,
        }));
        let mut place = json!([
            {"scale": 0.3}, {"translate": [0.5, 0.5, 1.0 / 3.0 + shift]},
        ]);
        let body = scene["body"]["to_world"].as_array().unwrap().clone();
        place.as_array_mut().unwrap().extend(body);
        scene["disc"] = json!({
            "type": "disk", "to_world": place, "bsdf": {"type": "diffuse", "reflectance": 0},
        });
        measure_json(&scene, 20_000, seed).balance.surfaces
    };
    let [on, beside] = [(0.0, 1), (-1e-3, 2)].map(|(shift, seed)| absorbed(shift, seed));
    assert!(beside.mean > 0.1, "{beside:?}");
    let z = two_sample_z(on.mean, on.error, beside.mean, beside.error);
    // The shift changes the power by less than the error.
    max_abs_z(&[z], FAMILY).unwrap();
}

/// The cavity of label 0 is a voxel of the 3 × 3 × 3 voxels of a unit cube.
/// Returns the warnings about a scene with a mesh.
fn warnings(nodes: &[Value], elements: &Value, regions: &Value) -> String {
    let scene = scene(json!({
        "type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": regions,
    }));
    load_json(&scene).unwrap().warnings.to_string()
}

#[test]
fn holes_are_warned_about() {
    let [nodes, mut elements, mut regions] = divided();
    let nodes = nodes.as_array().unwrap();
    let told = warnings(nodes, &elements, &regions);
    let expected = "an enclosed space of volume 3.704e-2 around [0.5";
    assert!(
        told.contains(expected) && told.contains("[mesh_holes]"),
        "{told}"
    );
    // Without the last layer of voxels, the cavity is open.
    for list in [&mut elements, &mut regions] {
        let list = list.as_array_mut().unwrap();
        list.truncate(list.len() - 6 * 9);
    }
    let told = warnings(&nodes[..48], &elements, &regions);
    assert!(!told.contains("mesh_holes"), "{told}");
}

#[test]
fn mistakes_say_where() {
    let [nodes, elements, regions] = divided();
    let mesh = |key: &str, value: Value| {
        let mut body = json!({
            "type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": regions,
        });
        body[key] = value;
        scene(body)
    };
    let single = |corners: Value| {
        scene(json!({"type": "tetrahedra", "nodes": nodes, "elements": [corners], "regions": [1]}))
    };
    let count = regions.as_array().unwrap().len();
    let cases = [
        (mesh("filename", json!("a.npz")), "not both"),
        (mesh("regions", json!([1, 2])), "there are 2 for"),
        (mesh("regions", json!(vec![7; count])), "label 7"),
        (single(json!([0, 1, 2])), "four nodes"),
        (single(json!([2, 3, 9, 40])), "numbered from 0"),
        (single(json!([0, 1, 4, 99])), "element 0 has the node 99"),
        (single(json!([0, 1, 4, 16.5])), "whole numbers"),
        (
            single(json!([0, 1, 2, 3])),
            "element 0 at [0.5, 0, 0] has no volume",
        ),
        (
            scene(json!({"type": "tetrahedra", "elements": elements})),
            "nodes",
        ),
    ];
    for (scene, expected) in cases {
        let refused = load_json(&scene).expect_err(expected).to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}
