//! Tissues by name: coefficients computed by hand from the cited tables, per millimetre, at
//! wavelengths on and between their rows.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use serde_json::{Value, json};
use std::fs;

/// Five labels in a row, each a medium, seen at some wavelengths.
fn scene(media: &[Value], wavelengths: &str) -> Value {
    let labels: Vec<usize> = (1..=media.len()).collect();
    let mut voxels = json!({
        "type": "labels", "data": [[labels]],
        "to_world": [{"scale": [media.len(), 1, 1]}],
    });
    for (i, medium) in media.iter().enumerate() {
        voxels[(i + 1).to_string()] = medium.clone();
    }
    json!({
        "type": "scene",
        "integrator": {"type": "particle"},
        "voxels": voxels,
        "source": {"type": "point", "position": [0.5, 0.5, 0.5]},
        "cells": {
            "type": "fluencemeter", "nx": 1, "ny": 1, "nz": 1,
            "film": {"type": "hdrfilm", "pixel_format": "spectral", "wavelengths": wavelengths},
        },
    })
}

fn load(scene: &Value) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// σ_s, σ_a and the mean cosine of the i-th label, in a channel.
fn properties(loaded: &Loaded, i: usize, channel: usize) -> [f64; 2] {
    let x = DVec3::new(i as f64 + 0.5, 0.5, 0.5);
    let medium = loaded.scene().medium(loaded.scene().medium_at(x));
    let (s, t) = (medium.scattering(x)[channel], medium.extinction(x)[channel]);
    [s, t - s]
}

fn tissue(name: &str) -> Value {
    json!({"type": "homogeneous", "tissue": name})
}

fn holding(name: &str, blood: f64, saturation: f64, water: f64) -> Value {
    let mut medium = tissue(name);
    medium["blood"] = json!(blood);
    medium["saturation"] = json!(saturation);
    medium["water"] = json!(water);
    medium
}

#[track_caller]
fn near(found: [f64; 2], expected: [f64; 2]) {
    for (a, b) in found.iter().zip(expected) {
        assert!((a / b - 1.0).abs() < 1e-6, "{found:?} {expected:?}");
    }
}

#[test]
fn coefficients_are_those_of_the_tables() {
    let media = [
        holding("soft tissue", 0.05, 0.7, 0.6),
        holding("bone", 0.02, 0.25, 0.3),
        holding("fatty tissue", 0.01, 1.0, 0.2),
    ];
    let loaded = load(&scene(&media, "800, 600, 633")).unwrap();
    near(
        properties(&loaded, 0, 0),
        [10.133634249366823, 0.02259019232824217],
    );
    near(
        properties(&loaded, 1, 1),
        [14.262264272210583, 0.1265195962770437],
    );
    near(
        properties(&loaded, 2, 2),
        [15.653905903184636, 0.0029354043052384586],
    );
    let loaded = load(&scene(
        &[tissue("gray matter"), tissue("white matter")],
        "830, 1064",
    ))
    .unwrap();
    near(properties(&loaded, 0, 0), [7.515, 0.0305]);
    near(properties(&loaded, 1, 1), [36.0, 0.105]);
}

/// Fat at 930 nm absorbs 0.131/cm, melanosomes at 500 nm 1.70e12 · 500^−3.48/cm. Absorption of fat at
/// 935 nm is the mean of its rows at 930 and 940 nm.
#[test]
fn fat_and_melanin_absorb() {
    let mut media = ["fatty tissue"; 2].map(|name| holding(name, 0.0, 0.0, 0.0));
    media[0]["fat"] = json!(0.8);
    media[1]["melanin"] = json!(0.02);
    let loaded = load(&scene(&media, "930, 935, 500")).unwrap();
    let absorbed = |i, channel| properties(&loaded, i, channel)[1];
    let fat = [absorbed(0, 0), absorbed(0, 1)];
    near(fat, [0.8 * 0.0131, 0.8 * 0.5 * (0.0131 + 0.008754)]);
    let melanosome = 0.1 * 688.7051115;
    near([absorbed(1, 2); 2], [0.02 * melanosome; 2]);
    let found = load(&scene(&media, "440")).unwrap_err();
    let expected = "'fatty tissue' with this content is known from 450 to 1000 nm, not at 440 nm";
    assert!(found.contains(expected), "{found}");
}

/// Scattering has g = 0.9, so that (1 − g) σ_s is the reduced coefficient; `scale` is for scenes
/// that are not in millimetres.
#[test]
fn reduced_scattering_and_scale() {
    let mut metres = tissue("soft tissue");
    metres["scale"] = json!(1000);
    let loaded = load(&scene(&[tissue("soft tissue"), metres], "500")).unwrap();
    let x = DVec3::splat(0.5);
    let medium = loaded.scene().medium(loaded.scene().medium_at(x));
    let s = medium.scattering(x)[0];
    assert!((s * (1.0 - 0.9) - 1.91).abs() < 1e-9, "{s}");
    let phase = format!("{:?}", medium.phase);
    assert!(phase.contains("0.9"), "{phase}");
    let [per_metre, _] = properties(&loaded, 1, 0);
    assert!((per_metre / s - 1000.0).abs() < 1e-6, "{per_metre} {s}");
}

#[test]
fn mistakes() {
    let message =
        |medium: Value, wavelengths: &str| load(&scene(&[medium], wavelengths)).unwrap_err();
    let with = |key: &str, value: Value| {
        let mut medium = tissue("bone");
        medium[key] = value;
        medium
    };
    for (found, expected) in [
        (
            message(tissue("grey matter"), "800"),
            "did you mean 'gray matter'",
        ),
        (
            message(tissue("steel"), "800"),
            "it is one of: none, soft tissue",
        ),
        (
            message(tissue("bone"), "800, 1200"),
            "'bone' with this content is known from 400 to 1000 nm, not at 1200 nm",
        ),
        (message(tissue("gray matter"), "532"), "from 670 to 1064 nm"),
        (message(with("sigma_a", json!(1)), "800"), "not several"),
        (
            message(with("phase", json!({"type": "hg"})), "800"),
            "leave the phase function out",
        ),
        (message(with("blood", json!(1.5)), "800"), "blood"),
        (
            message(holding("gray matter", 0.1, 0.5, 0.5), "800"),
            "is measured",
        ),
        (
            message(json!({"type": "homogeneous", "blood": 0.1}), "800"),
            "blood",
        ),
    ] {
        assert!(
            found.contains(expected),
            "expected {expected:?} in:\n{found}"
        );
    }
    let mut colour = scene(&[tissue("bone")], "800");
    colour["cells"].as_object_mut().unwrap().remove("film");
    let found = load(&colour).unwrap_err();
    assert!(found.contains("known by wavelength"), "{found}");
}
