//! Scenes that GPUs can run.

use serde_json::{Value, json};
use testkit::Rng;

/// A beam along z into the face z = −1 of a cube.
pub fn beam(radius: f64) -> Value {
    json!({
        "type": "collimated", "radius": radius, "power": 2,
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 12}}, {"translate": [0.1, 0.3, -3]}]
    })
}

/// Voxels of the cube \[−1, 1\]³ with unequal sides.
fn voxels_of_cube() -> Value {
    json!({
        "type": "fluencemeter", "nx": 9, "ny": 8, "nz": 10,
        "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2}]
    })
}

/// A homogeneous cube with two sources: a beam outside, and a point inside.
pub fn cube(refracts: bool) -> Value {
    json!({
        "type": "scene", "integrator": {"type": "particle"},
        "beam": beam(0.5),
        "point": {"type": "point", "position": [0.2, -0.3, 0.1], "intensity": 0.1},
        "tissue": {
            "type": "cube", "bsdf": {"type": if refracts { "dielectric" } else { "null" }},
            "interior": {
                "type": "homogeneous", "sigma_a": 0.2, "sigma_s": 4, "ior": if refracts { 1.4 } else { 1.0 },
                "phase": {"type": "hg", "g": 0.8}
            }
        },
        "cells": voxels_of_cube()
    })
}

/// A cube whose index is 1.4 plus a smooth bump of height `contrast`.
pub fn bent_cube(contrast: f64, faces: &str, sigma_s: f64, source: Value) -> Value {
    let n = 15;
    let at = |i: usize| 2.0 * i as f64 / (n - 1) as f64 - 1.0;
    let index = |x: f64, y: f64, z: f64| {
        let r2 = (x - 0.1).powi(2) + (y + 0.2).powi(2) + z * z;
        1.4 + contrast * (-3.0 * r2).exp()
    };
    let row =
        |k: usize, j: usize| -> Vec<f64> { (0..n).map(|i| index(at(i), at(j), at(k))).collect() };
    let plane = |k: usize| -> Vec<Vec<f64>> { (0..n).map(|j| row(k, j)).collect() };
    let data: Vec<_> = (0..n).map(plane).collect();
    let place = json!([{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2}]);
    json!({
        "type": "scene", "integrator": {"type": "particle"},
        "beam": source,
        "tissue": {
            "type": "cube", "bsdf": {"type": faces},
            "interior": {
                "type": "homogeneous", "sigma_a": 0.02 * sigma_s, "sigma_s": sigma_s,
                "phase": {"type": "hg", "g": 0.8},
                "ior": {"type": "bspline", "data": data, "placement": "nodes", "to_world": place}
            }
        },
        "cells": voxels_of_cube()
    })
}

/// A cube of random labels with equal indices that vary as in [`bent_cube`].
pub fn bent_labels(rng: &mut Rng) -> Value {
    let mut scene = bent_cube(0.1, "null", 1.0, beam(0.6));
    let mut label = || 1 + (rng.next_1d() * 3.0) as u32;
    let mut row = || -> Vec<u32> { (0..9).map(|_| label()).collect() };
    let mut plane = || -> Vec<Vec<u32>> { (0..8).map(|_| row()).collect() };
    let data: Vec<_> = (0..10).map(|_| plane()).collect();
    let index = scene["tissue"]["interior"]["ior"].clone();
    let mut medium = |g: f64| {
        let [sigma_a, sigma_s] = [rng.range(0.05, 0.3), rng.range(1.0, 8.0)];
        json!({
            "type": "homogeneous", "sigma_a": sigma_a, "sigma_s": sigma_s, "ior": index,
            "phase": {"type": "hg", "g": g}
        })
    };
    scene["tissue"] = json!({
        "type": "labels", "data": data, "to_world": scene["cells"]["to_world"],
        "1": medium(0.9), "2": medium(0.0), "3": medium(-0.4)
    });
    scene
}

/// Voxels with unequal sides, rotated or mirrored, with four labels; two labels have equal indices,
/// one scatters nothing, and 0 is outside. Scenes vary by their number: refraction, and gates.
pub fn random_labels(rng: &mut Rng, number: u64) -> Value {
    let [nx, ny, nz] = [0; 3].map(|_| 4 + (rng.next_1d() * 4.0) as usize);
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
    let mirror = if number % 2 == 1 { -1.0 } else { 1.0 };
    let [x, y, z] = [0; 3].map(|_| rng.range(2.0, 6.0));
    let turn = json!({"rotate": {"axis": [1, 2, -1], "angle": rng.range(0.0, 90.0)}});
    let shift = json!({"translate": rng.uniform::<3>()});
    let to_world = |first: Value| json!([first, turn, shift]);
    let whole = to_world(json!({"scale": [mirror * x, y, z]}));
    let start = json!({"translate": [mirror * x * 0.55, y * 0.45, z * -0.3]});
    let mut scene = json!({
        "type": "scene", "integrator": {"type": "particle"},
        "beam": {"type": "collimated", "radius": 0.5, "power": 1, "to_world": to_world(start)},
        "tissue": {
            "type": "labels", "data": data, "to_world": whole, "properties": properties,
            "refraction": number % 3 != 1
        },
        "cells": {"type": "fluencemeter", "nx": nx, "ny": ny, "nz": nz, "to_world": whole}
    });
    if number % 3 == 2 {
        for (key, value) in [("min_bound", 2.0), ("max_bound", 14.0), ("bin_width", 3.0)] {
            scene["cells"][key] = json!(value);
        }
    }
    scene
}
