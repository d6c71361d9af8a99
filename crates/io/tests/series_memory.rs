//! Memory of time series, which are read in parts: 40 bytes per position, and no growth with the
//! number of frames, for any order of the axes. The sound agrees with the closed form.
//!
//! This file has a single test, because the allocator counts the memory of the whole program.

use hdf5_reader::{ByteOrder, Datatype};
use hdf5_writer::{DatasetBuilder, Hdf5Builder, Hdf5Writer, WriteOptions};
use morgana_io::{LoadOptions, Loaded};
use peak_alloc::PeakAlloc;
use serde_json::json;
use std::f64::consts::TAU;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Numbers of positions along each axis.
const PLACES: [usize; 3] = [16, 16, 32];
/// Number of frames.
const FRAMES: usize = 2048;
/// Number of frames per period.
const STEPS: usize = 8;
/// Maximum bytes per position during reading and afterwards: 24 for sums and 16 for the amplitude.
const MAX_BYTES_PER_POSITION: usize = 40;
/// Bytes for blocks of the file, and the rest of the scene.
const BLOCKS: usize = 24 << 20;

/// Pressure at a position in a frame, in Pa; x runs fastest.
fn pressure(place: usize, frame: usize) -> f32 {
    let angle = TAU * (frame % STEPS) as f64 / STEPS as f64 + 1e-4 * place as f64;
    (1e3 * angle.cos()) as f32
}

/// Numbers of the array in the order of a file.
fn numbers(time_first: bool) -> impl Iterator<Item = f32> {
    let places: usize = PLACES.iter().product();
    (0..FRAMES * places).map(move |i| {
        if time_first {
            pressure(i % places, i / places)
        } else {
            pressure(i / FRAMES, i % FRAMES)
        }
    })
}

fn shape(time_first: bool) -> Vec<u64> {
    let [x, y, z] = PLACES.map(|n| n as u64);
    if time_first {
        vec![FRAMES as u64, z, y, x]
    } else {
        vec![z, y, x, FRAMES as u64]
    }
}

fn write_npy(path: &Path, time_first: bool) {
    let shape: Vec<String> = shape(time_first).iter().map(u64::to_string).collect();
    let dictionary = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}), }}",
        shape.join(", ")
    );
    let mut file = BufWriter::new(File::create(path).unwrap());
    file.write_all(b"\x93NUMPY\x01\x00").unwrap();
    file.write_all(&(dictionary.len() as u16).to_le_bytes())
        .unwrap();
    file.write_all(dictionary.as_bytes()).unwrap();
    for number in numbers(time_first) {
        file.write_all(&number.to_le_bytes()).unwrap();
    }
    file.flush().unwrap();
}

fn write_hdf5(path: &Path, time_first: bool, chunk: Option<[u64; 4]>) {
    let bytes: Vec<u8> = numbers(time_first).flat_map(f32::to_le_bytes).collect();
    let (size, byte_order) = (4, ByteOrder::LittleEndian);
    let datatype = Datatype::FloatingPoint { size, byte_order };
    let mut dataset = DatasetBuilder::new("p", datatype, shape(time_first)).raw_data(bytes);
    if let Some(chunk) = chunk {
        dataset = dataset.chunked(chunk);
    }
    let plan = Hdf5Builder::new().dataset(dataset).into_plan().unwrap();
    let file = BufWriter::new(File::create(path).unwrap());
    Hdf5Writer::new(file, WriteOptions::default())
        .finish(plan)
        .unwrap();
}

/// Returns the scene of a file, and the peak memory of loading it.
fn load(folder: &Path, name: &str, time_first: bool) -> (Loaded, usize) {
    let mut ior = json!({
        "type": "pressure", "filename": name, "axis_order": if time_first { "czyx" } else { "zyxc" },
        "placement": "nodes", "frequency": 1e6, "sound_speed": 1e6, "time_step": 1e-6 / STEPS as f64,
        "n0": 1.33, "dn_dp": 1e-8
    });
    if name.ends_with(".h5") {
        ior["dataset"] = json!("p");
    }
    let scene = json!({
        "type": "scene", "sensor": {"type": "perspective"}, "sky": {"type": "constant"},
        "water": {"type": "cube", "to_world": [{"scale": 0.5}, {"translate": [0.5, 0.5, 0.5]}],
            "bsdf": {"type": "dielectric"}, "interior": {"type": "transparent", "ior": ior}},
    });
    let path = folder.join("scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    ALLOCATOR.reset_peak_usage();
    let before = ALLOCATOR.current_usage();
    let loaded = morgana_io::load_scene(&path, &LoadOptions::default());
    let peak = ALLOCATOR.peak_usage() - before;
    (loaded.unwrap_or_else(|d| panic!("{d}")), peak)
}

#[test]
fn memory_does_not_grow_with_the_number_of_frames() {
    let folder = tempfile::tempdir().unwrap();
    for time_first in [true, false] {
        let chunk = if time_first {
            [100, 8, 16, 16]
        } else {
            [3, 8, 16, 1000]
        };
        write_npy(&folder.path().join("p.npy"), time_first);
        write_hdf5(&folder.path().join("p.h5"), time_first, None);
        write_hdf5(&folder.path().join("chunked.h5"), time_first, Some(chunk));
        for name in ["p.npy", "p.h5", "chunked.h5"] {
            let (loaded, peak) = load(folder.path(), name, time_first);
            let places: usize = PLACES.iter().product();
            assert!(
                peak < MAX_BYTES_PER_POSITION * places + BLOCKS
                    && MAX_BYTES_PER_POSITION * places + BLOCKS < 4 * FRAMES * places,
                "{name}: {peak} bytes"
            );
            let scene = loaded.scene();
            for place in [0, 1, 16, 5000, places - 1] {
                let [x, y, z] = [place % 16, place / 16 % 16, place / 256];
                let at = glam::DVec3::new(x as f64 / 15.0, y as f64 / 15.0, z as f64 / 31.0);
                let medium = scene.medium_at(glam::DVec3::splat(0.5));
                let found = (scene.n(medium, at) - 1.33) * 1e8;
                let expected = f64::from(pressure(place, 0));
                assert!(
                    (found - expected).abs() < 1e-3 * 1e3,
                    "{name} {place}: {found} {expected}"
                );
            }
        }
    }
}
