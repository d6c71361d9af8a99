//! Flights of particles from one collision to the next where rays bend, compared with edges.
//!
//! Walks use edges where a meter keeps records. False alarms: 1e-3 for all comparisons together.
//! Seeds are fixed.

use crate::cell_walks::{by_edges, differences, run};
use serde_json::{Value, json};
use testkit::{Family, Rng, z_test};

const SCENES: usize = 7;
/// Number of scenes without voxels, the first ones.
const BODIES: usize = 5;

/// A block, a ball or voxels of fog with a lens of denser fog, or with an index that grows evenly.
/// Every second scene has gates, and every third one modulated light. Every fourth one has a ball
/// inside and a disc beside the fog.
fn random_scene(number: usize, rng: &mut Rng) -> Value {
    let index = if number % 4 == 1 && number < BODIES {
        json!({
            "type": "linear_square", "n0": 1.4, "slope": [0.2, -0.1, 0.15],
        })
    } else {
        json!({
            "type": "gaussian", "n0": 1.33, "delta": rng.range(-0.1, 0.15),
            "center": [0.2, -0.1, 0.1], "width": rng.range(0.4, 0.9),
        })
    };
    let shape = if number.is_multiple_of(2) {
        "cube"
    } else {
        "sphere"
    };
    let wall = if number.is_multiple_of(3) {
        "dielectric"
    } else {
        "null"
    };
    let mut scene = json!({
        "type": "scene",
        "integrator": {"type": "particle"},
        "fog": {
            "type": shape, "bsdf": {"type": wall},
            "interior": {
                "type": "homogeneous", "sigma_s": rng.range(1.0, 12.0), "sigma_a": rng.range(0.05, 0.3),
                "phase": {"type": "hg", "g": rng.range(-0.3, 0.9)}, "ior": index,
            }
        },
        "beam": {
            "type": "collimated", "radius": 0.3, "power": 1,
            "to_world": [{"lookat": {"origin": [0.2, 0.1, -2.0], "target": [0.1, 0.0, 0.0], "up": [0, 1, 0]}}]
        },
        "cells": {
            "type": "fluencemeter", "nx": 7, "ny": 8, "nz": 9,
            "to_world": [
                {"translate": [-0.5, -0.5, -0.5]}, {"scale": [1.5, 2.2, 2.3]},
                {"rotate": {"axis": [1, 2, -1], "angle": rng.range(0.0, 90.0)}},
            ]
        }
    });
    if number >= BODIES {
        // Voxels of two labels in the same graded index.
        let label = |sigma_s: f64| {
            let mut medium = scene["fog"]["interior"].clone();
            medium["sigma_s"] = json!(sigma_s);
            medium
        };
        let labels = [label(4.0), label(10.0)];
        let data = [
            [[1, 1, 2], [2, 1, 1]],
            [[1, 2, 2], [1, 0, 1]],
            [[2, 2, 1], [1, 1, 1]],
        ];
        scene["fog"] = json!({
            "type": "labels", "data": data, "1": labels[0], "2": labels[1],
            "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2.0}],
        });
    }
    if number % 2 == 1 {
        for (key, value) in [("min_bound", 2.0), ("max_bound", 8.0), ("bin_width", 1.5)] {
            scene["cells"][key] = json!(value);
        }
    }
    if number % 3 == 2 {
        scene["cells"]["modulation_frequencies"] = json!([1e8, 5e8]);
        scene["cells"]["metres_per_unit"] = json!(0.01);
    }
    if number % 4 == 3 {
        scene["ball"] = json!({
            "type": "sphere", "radius": 0.2, "center": [0.3, 0.2, -0.3],
            "bsdf": {"type": "diffuse", "reflectance": 0.2},
        });
        scene["screen"] = json!({
            "type": "rectangle", "bsdf": {"type": "null"}, "to_world": [{"translate": [0.0, 0.0, 1.2]}],
            "through": {"type": "irradiancemeter"}
        });
    }
    scene
}

#[test]
fn curved_flights_agree_with_edges() {
    let (mut rng, mut family) = (Rng::new(31), Family::new(1e-3));
    let (mut squares, mut evaluations) = (Vec::new(), [0.0; 2]);
    for number in 0..SCENES {
        let scene = random_scene(number, &mut rng);
        let (free, edges) = (run(&scene, 1, None), run(&by_edges(&scene), 2, None));
        assert_eq!((free.stats.lost, edges.stats.lost), (0, 0), "{number}");
        // Flights that are long for their bends, or leave small regions, take as many evaluations as
        // edges.
        let counts = if number < BODIES { 1.0 } else { 0.0 };
        for (sum, run) in evaluations.iter_mut().zip([&free, &edges]) {
            *sum += counts * run.stats.work.evaluations as f64 / run.stats.edges as f64;
        }
        for (name, z) in differences(&free, &edges) {
            squares.push(z * z);
            family.push(format!("{number}, {name}: z = {z:.2}"), z_test::p_value(z));
        }
    }
    let mean_square = squares.iter().sum::<f64>() / squares.len() as f64;
    println!(
        "{} comparisons, mean square of z {mean_square}",
        squares.len()
    );
    assert!(squares.len() > 1000, "{}", squares.len());
    assert!(evaluations[0] < 0.7 * evaluations[1], "{evaluations:?}");
    family.check().unwrap();
}
