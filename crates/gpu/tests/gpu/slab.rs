//! A slab whose reflectance and transmittance are in tables.

use crate::common::{gpu, load, on_gpu, options};
use serde_json::json;

/// Diffuse reflectance 0.09739 and transmittance 0.66096 of a slab with μ_a 10/cm, μ_s 90/cm, g 0.75
/// and a thickness of 0.02 cm, without a change of the index (van de Hulst 1980; MCML's manual,
/// table 4.1).
const ABSORBED: f64 = 1.0 - 0.09739 - 0.66096;

#[test]
fn a_slab_absorbs_as_in_the_table() {
    let Some(gpu) = gpu() else { return };
    // Wide enough that no light leaves through the sides.
    let place = json!([{"translate": [-0.5, -0.5, 0]}, {"scale": [200, 200, 0.02]}]);
    let scene = json!({
        "type": "scene", "integrator": {"type": "particle"},
        "beam": {"type": "collimated", "radius": 0.001, "power": 1, "to_world": [{"translate": [0, 0, -1]}]},
        "slab": {
            "type": "cube", "to_world": [{"translate": [0, 0, 1]}, {"scale": [100, 100, 0.01]}],
            "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_a": 10, "sigma_s": 90, "ior": 1, "phase": {"type": "hg", "g": 0.75}}
        },
        "cells": {"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 10, "to_world": place}
    });
    let found = on_gpu(&gpu, &load(&scene), &options(1 << 18, 1)).unwrap();
    let media = found.balance.media;
    let z = (media.mean - ABSORBED) / media.error;
    println!("{} ± {}, not {ABSORBED}: z {z:.2}", media.mean, media.error);
    // False alarms: 6e-5.
    assert!(z.abs() < 4.0, "{z}");
    assert!(media.error < 1e-3, "{}", media.error);
    let fluence: f64 = found.readings[0][1].mean.iter().sum::<f64>() * 200.0 * 200.0 * 0.002;
    assert!((fluence / media.mean - 1.0).abs() < 0.01, "{fluence}");
}
