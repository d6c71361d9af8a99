//! Memory of readings in time gates: it grows with the cells that light has reached, not with all cells.
//!
//! This file has a single test, because the allocator counts the memory of the whole program.

use morgana_io::{LoadOptions, Run};
use peak_alloc::PeakAlloc;
use serde_json::json;
use std::ops::ControlFlow;
use transport::render::{Handle, MeasureState};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Voxels along each axis, and time gates.
const SIDE: usize = 100;
const GATES: usize = 10;
/// Bytes per cell and gate in sums and readings, if all cells had them: two quantities of 40 and 25
/// bytes.
const EVERYWHERE: usize = 2 * (40 + 25);

#[test]
fn gates_without_light_take_no_memory() {
    let size = SIDE as f64;
    let scene = |gates: usize| {
        json!({
            "type": "scene",
            "integrator": {"type": "particle"},
            "tissue": {
                "type": "labels", "to_world": [{"scale": size}], "properties": [[0, 0, 1, 1], [0.02, 8, 0.9, 1.37]],
                "data": vec![vec![vec![1; SIDE]; SIDE]; SIDE],
            },
            "cells": {
                "type": "fluencemeter", "nx": SIDE, "ny": SIDE, "nz": SIDE, "to_world": [{"scale": size}],
                "max_bound": 1500, "bin_width": 1500 / gates,
            },
            "source": {"type": "collimated", "radius": 0.5, "power": 1.0, "to_world": [{"translate": [size / 2.0, size / 2.0, -1.0]}]},
        })
    };
    let folder = tempfile::tempdir().unwrap();
    let [one, all] = [1, GATES].map(|gates| {
        let path = folder.path().join("scene.json");
        std::fs::write(&path, scene(gates).to_string()).unwrap();
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
        let run = Run {
            total: Some(200),
            ..Run::new(&loaded)
        };
        let (meters, options) = (loaded.meters(), run.measure_options());
        let before = ALLOCATOR.current_usage();
        let mut state = MeasureState::new(&loaded.groups, &meters).unwrap();
        // A new state requests the memory of all cells from the system, and returns it.
        ALLOCATOR.reset_peak_usage();
        let go_on = |_: &MeasureState| ControlFlow::Continue(());
        let handle = Handle::default();
        let advanced = state.advance(&loaded.groups, &meters, &options, &handle, go_on);
        advanced.unwrap();
        let measured = state.into_measurement(&loaded.groups, &meters).unwrap();
        let peak = ALLOCATOR.peak_usage() - before;
        assert!(measured.readings[0][0].mean.iter().any(|v| *v > 0.0));
        println!("{gates} gates: {peak} bytes");
        peak
    });
    let cells = GATES * SIDE.pow(3);
    assert!(all < cells * EVERYWHERE / 20, "{all}");
    // Without light, a gate takes one entry in a table for every 64 cells.
    assert!(all < 4 * one, "{one} {all}");
}
