//! Arrays within a scene, compared with files of equal numbers.

use morgana_io::scene::{Numbers, Tensor};
use morgana_io::volume::{AxisOrder, Options, Volume, npy};
use morgana_io::{Diagnostics, Limits, LoadOptions, json};
use std::sync::Arc;

/// 2 × 3 × 4 numbers `[z, y, x]`.
fn numbers() -> Vec<f64> {
    (0..24)
        .map(|i| 1.3 + 0.01 * f64::from(i * i % 17))
        .collect()
}

fn nested(values: &[f64]) -> String {
    let row = |row: &[f64]| format!("{row:?}");
    let plane = |p: &[f64]| format!("[{}]", p.chunks(4).map(row).collect::<Vec<_>>().join(","));
    let planes: Vec<String> = values.chunks(12).map(plane).collect();
    format!("[{}]", planes.join(","))
}

fn scene(data: &str) -> String {
    format!(
        r#"{{"type": "scene", "sensor": {{"type": "perspective", "fov": 40}}, "sky": {{"type": "constant"}},
        "ball": {{"type": "sphere", "bsdf": {{"type": "null"}}, "interior": {{"type": "transparent",
        "ior": {{"type": "bspline", "placement": "nodes", {data},
        "to_world": [{{"scale": 2}}, {{"translate": [-1, -1, -1]}}]}}}}}}}}"#
    )
}

fn loaded(text: &str, folder: &std::path::Path) -> Result<morgana_io::Loaded, Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    match json::parse(text, folder.join("scene.json"), &[], &mut diagnostics) {
        Some(description) => {
            morgana_io::assemble(&description, &LoadOptions::default(), diagnostics)
        }
        None => Err(diagnostics),
    }
}

#[test]
fn arrays_in_a_scene_are_those_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let tensor = Tensor::new(vec![2, 3, 4], Numbers::Double(numbers())).unwrap();
    let volume: Volume<f64> = Volume::of_tensor(&tensor, AxisOrder::ZYX).unwrap();
    let path = folder.path().join("index.npy");
    npy::write(&path, &volume).unwrap();
    let read: Volume<f64> = npy::read(&path, Options::order(AxisOrder::ZYX)).unwrap();
    assert_eq!(read, volume);

    let named = scene(r#""filename": "index.npy", "axis_order": "zyx""#);
    let held = scene(&format!(r#""data": {}"#, nested(&numbers())));
    let [named, held] = [named, held].map(|text| loaded(&text, folder.path()).unwrap());
    let field = |loaded: &morgana_io::Loaded, x: f64| {
        let media = loaded.scene().media();
        media[1].index.n2(glam::DVec3::new(x, 0.3 * x, -0.2))
    };
    for x in [-0.9, -0.2, 0.1, 0.7] {
        assert_eq!(field(&named, x), field(&held, x));
    }
    assert_ne!(field(&held, 0.1), field(&held, 0.7));
}

#[test]
fn what_is_built_is_what_is_written() {
    let tensor = Tensor::new(vec![2, 3, 4], Numbers::Double(numbers())).unwrap();
    let mut diagnostics = Diagnostics::new();
    let text = json::Item::String;
    let object = |entries: Vec<(&str, json::Item)>| {
        json::Item::Object(entries.into_iter().map(|(k, v)| (k.into(), v)).collect())
    };
    let built = object(vec![
        ("type", text("scene".into())),
        (
            "index",
            object(vec![
                ("type", text("bspline".into())),
                ("data", json::Item::Tensor(Arc::new(tensor))),
                ("placement", text("nodes".into())),
            ]),
        ),
    ]);
    let built = json::build(built, &[], Limits::default(), &mut diagnostics).expect("a scene");
    let written = json::write(&built);
    let read = json::parse(&written, "scene.json", &[], &mut diagnostics).expect("a scene");
    let files = morgana_io::FileRegistry::new();
    assert_eq!(built.hash(&files).unwrap(), read.hash(&files).unwrap());
    assert!(diagnostics.is_empty(), "{diagnostics}");
}

#[test]
fn arrays_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let message = |data: &str| {
        let refused = loaded(&scene(data), folder.path()).unwrap_err();
        refused
            .iter()
            .map(|d| d.message.clone())
            .collect::<Vec<_>>()
            .join("; ")
    };
    assert!(message(r#""data": [[[1.3, 1.4], [1.3]]]"#).contains("expected an array of 2"));
    assert!(message(r#""data": [[[1.3, "a"]]]"#).contains("expected a number"));
    assert!(message(r#""data": [1.3, 1.4]"#).contains("3 axes"));
    assert!(message(r#""data": 1.3"#).contains("expected array"));
    assert!(message(r#""data": [[[1.3]]], "filename": "x.npy""#).contains("not both"));
    assert!(message("\"dataset\": \"x\"").contains("needs \"filename\" (string)"));
    assert!(Tensor::new(vec![2, 2], Numbers::Single(vec![0.0; 3])).is_err());
}

/// A square of side 2 whose radiance is an image within the scene.
fn light(bitmap: &str) -> String {
    format!(
        r#"{{"type": "scene", "integrator": {{"type": "particle"}},
        "cells": {{"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 1}},
        "light": {{"type": "rectangle", "bsdf": {{"type": "diffuse", "reflectance": 0}},
        "emitter": {{"type": "area", "radiance": {{"type": "bitmap", "filter_type": "nearest", {bitmap}}}}}}}}}"#
    )
}

/// Pixels are linear, in rows and columns and optionally channels. The power is π times the area
/// times their mean.
#[test]
fn bitmaps_hold_their_pixels() {
    let folder = tempfile::tempdir().unwrap();
    for data in [
        "[[0.25, 0.75], [0.1, 0.9]]",
        "[[[0.25], [0.75]], [[0.1], [0.9]]]",
        "[[[0.25, 0.25, 0.25], [0.75, 0.75, 0.75]]]",
    ] {
        let loaded = loaded(&light(&format!(r#""data": {data}"#)), folder.path()).unwrap();
        let run = morgana_io::Run {
            total: Some(200),
            ..morgana_io::Run::new(&loaded)
        };
        let emitted = run.measure().unwrap().emitted[0];
        let expected = 2.0 * std::f64::consts::PI;
        assert!((emitted - expected).abs() < 1e-6, "{data}: {emitted}");
    }
    for (bitmap, expected) in [
        (r#""data": [0.5, 1]"#, "pixels as rows and columns"),
        (r#""data": [[[0.5, 1]]]"#, "an array of shape [1, 1, 2]"),
        (r#""data": [[1]], "filename": "a.png""#, "not both"),
        (r#""raw": true"#, "filename"),
    ] {
        let message = loaded(&light(bitmap), folder.path())
            .err()
            .unwrap()
            .to_string();
        assert!(message.contains(expected), "{bitmap}: {message}");
    }
}
