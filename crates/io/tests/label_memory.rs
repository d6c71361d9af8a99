//! Memory of volumes of labels: a few bytes for each voxel, however rough the surfaces between them are.
//!
//! This file has a single test, because the allocator counts the memory of the whole program.

use morgana_io::element::Element;
use morgana_io::volume::{Volume, write};
use morgana_io::{LoadOptions, Run};
use peak_alloc::PeakAlloc;
use serde_json::json;
use std::ops::ControlFlow;
use transport::render::{Handle, MeasureState};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Voxels along each axis.
const SIDE: usize = 128;

/// Six nested tissues whose surfaces are rough by a voxel.
fn head() -> Vec<f64> {
    let label = |i: usize| {
        let at = |i: usize| 2.0 * (i as f64 + 0.5) / SIDE as f64 - 1.0;
        let (x, y, z) = (at(i % SIDE), at(i / SIDE % SIDE), at(i / SIDE / SIDE));
        let r = (x * x + 1.2 * y * y + 1.1 * z * z).sqrt();
        let rough = (i * 7919 % 97) as f64 / 97.0 * 2.0 / SIDE as f64;
        let outer = [0.9, 0.83, 0.77, 0.7, 0.6, 0.35];
        outer.iter().filter(|s| r + rough < **s).count() as f64
    };
    (0..SIDE.pow(3)).map(label).collect()
}

#[test]
fn voxels_take_a_few_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let volume = Volume::new([SIDE; 3], 1, head()).unwrap();
    write(
        &folder.path().join("head.npy"),
        &volume.with_element(Element::U8),
        "n",
    )
    .unwrap();
    let scene = json!({
        "type": "scene",
        "integrator": {"type": "particle"},
        "head": {
            "type": "labels", "to_world": [{"scale": 100}], "filename": "head.npy", "axis_order": "zyx",
            "properties": [[0, 0, 1, 1], [0.02, 8, 0.9, 1.37], [0.02, 7, 0.9, 1.43], [0.003, 0.2, 0.9, 1.33],
                           [0.02, 9, 0.9, 1.37], [0.01, 20, 0.9, 1.4], [0.1, 5, 0.9, 1.37]],
        },
        "cells": {"type": "fluencemeter", "nx": 2, "ny": 2, "nz": 2, "to_world": [{"scale": 100}]},
        "source": {"type": "collimated", "radius": 0.5, "power": 1.0, "to_world": [{"translate": [50, 50, -1]}]},
    });
    let path = folder.path().join("scene.json");
    std::fs::write(&path, scene.to_string()).unwrap();
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
    let per_voxel = |bytes: usize| (bytes - before) as f64 / SIDE.pow(3) as f64;
    let loading = per_voxel(ALLOCATOR.peak_usage());
    let run = Run {
        total: Some(200),
        ..Run::new(&loaded)
    };
    let (meters, options) = (loaded.meters(), run.measure_options());
    let mut state = MeasureState::new(&loaded.groups, &meters).unwrap();
    let go_on = |_: &MeasureState| ControlFlow::Continue(());
    let advanced = state.advance(&loaded.groups, &meters, &options, &Handle::default(), go_on);
    advanced.unwrap();
    let measuring = per_voxel(ALLOCATOR.peak_usage());
    println!("{loading:.2} bytes per voxel to load, {measuring:.2} to measure");
    // Loading takes labels in single precision, then a byte each for index and label; a hundredth
    // of the voxels are faces.
    assert!(loading < 8.0, "{loading}");
    // Measuring takes bytes for the medium of each voxel, and for the distances to other labels and
    // other media.
    assert!(measuring < 11.0, "{measuring}");
}
