//! Memory of volume readers: at most the samples and, for formats that are not read in pieces, the
//! file. For damaged files, at most what their size justifies.
//!
//! This file has a single test, because the allocator counts the memory of the whole program.

use std::io::Read;
use std::path::Path;

use eikonal::field::Bspline;
use flate2::Compression;
use flate2::read::{ZlibDecoder, ZlibEncoder};
use morgana_io::Limits;
use morgana_io::volume::{
    AxisOrder, Format, Options, Volume, hdf5, jnifti, mat, nifti, npy, npz, nrrd, vdb, vol, vti,
    vtk, write,
};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Bytes for buffers, tables of decompression, and names.
const SMALL: usize = 512 << 10;
/// Maximum growth by decompression: deflate compresses at most 1100 times, and a byte becomes a
/// number of four.
const INFLATION: usize = 4 * 1100;

/// The smallest memory limit.
const LIMITS: Limits = Limits { memory: Some(0) };
/// Bytes beyond ten times its size that a file may take if its header states more than it contains.
const STATED: usize = 64 << 20;

const ZYX: Options = Options {
    axes: Some(AxisOrder::ZYX),
    dataset: None,
    limits: LIMITS,
};
const ANY: Options = Options {
    axes: None,
    dataset: None,
    limits: LIMITS,
};

/// Returns the peak memory of a call, beyond the memory before it.
fn peak<T>(call: impl FnOnce() -> T) -> usize {
    ALLOCATOR.reset_peak_usage();
    let before = ALLOCATOR.current_usage();
    let result = call();
    let peak = ALLOCATOR.peak_usage().saturating_sub(before);
    drop(result);
    peak
}

fn valid_files() {
    const SIDE: usize = 128;
    let data = (0..SIDE * SIDE * SIDE).map(|i| i as f32).collect();
    let volume = Volume::<f32>::new([SIDE; 3], 1, data).unwrap();
    let samples = size_of::<f32>() * SIDE * SIDE * SIDE;
    // Samples become a spline in place, which needs some room around them.
    let most = size_of::<f32>() * Bspline::room([SIDE; 3]);
    let folder = tempfile::tempdir().unwrap();
    for extension in [
        "vol", "npy", "npz", "h5", "mat", "nrrd", "vti", "vtk", "jnii", "bnii", "jdt",
    ] {
        let path = folder.path().join("a").with_extension(extension);
        let axes = write(&path, &volume, "a").unwrap().axes;
        let dataset = Format::of(&path).unwrap().has_datasets().then_some("a");
        let options = Options {
            axes,
            dataset,
            ..Options::default()
        };
        let peak = peak(|| Volume::<f32>::read(&path, options).unwrap());
        // These formats hold the whole file in memory.
        let whole = match extension {
            "h5" | "vti" => samples,
            // The text, and its bytes.
            "jnii" | "bnii" | "jdt" => 2 * path.metadata().unwrap().len() as usize,
            _ => 0,
        };
        assert!(peak <= most + whole + SMALL, "{extension}: {peak} bytes");
        assert!(peak >= samples, "{extension}: {peak} bytes cannot be");
    }
}

fn made(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes");
    std::fs::read(folder.join(name)).unwrap()
}

fn parse(name: &str, bytes: &[u8]) {
    let _: Option<Volume> = match Path::new(name).extension().unwrap().to_str().unwrap() {
        "vol" => vol::parse(bytes).ok(),
        "npy" => npy::parse(bytes, ZYX).ok(),
        "npz" => npz::parse(bytes, ZYX.of("density")).ok(),
        "h5" => hdf5::parse(bytes, ZYX.of("p_max")).ok(),
        "mat" => mat::parse(bytes, ZYX.of("density")).ok(),
        "nrrd" => nrrd::parse(bytes, ANY).ok(),
        "vti" => vti::parse(bytes, ANY).ok(),
        "vdb" => vdb::parse(bytes, ANY).ok(),
        "jnii" | "bnii" => jnifti::parse(bytes, ANY).ok(),
        "jdt" | "jdb" => jnifti::parse(bytes, ZYX.of("rho")).ok(),
        "nii" | "gz" => nifti::parse(bytes, ANY).ok(),
        _ => vtk::parse(bytes, ANY).ok(),
    };
}

/// Files with a few replaced bytes; many of them state other sizes.
fn damaged_files() {
    let mut state = 1u64;
    let mut random = move |below: usize| {
        // Knuth's MMIX generator, whose upper bits are good.
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    for name in [
        "half.npy",
        "stored.npz",
        "compressed.npz",
        "kwave.h5",
        "plain.mat",
        "compressed.mat",
        "raw.nrrd",
        "gzip.nrrd",
        "ascii.nrrd",
        "ascii.vti",
        "inline_zlib.vti",
        "appended_raw_zlib.vti",
        "ascii.vtk",
        "cells.vtk",
        "single.vdb",
        "labels.nii",
        "labels.nii.gz",
        "zlib.jnii",
        "columns.jnii",
        "zlib.bnii",
        "arrays.jdb",
    ] {
        let file = made(name);
        for _ in 0..1000 {
            let mut bytes = file.clone();
            for _ in 0..1 + random(4) {
                // Digits change sizes in texts, and large bytes change sizes in numbers.
                let value = [b'9', 0xff, 0x7f, random(256) as u8][random(4)];
                bytes[random(file.len())] = value;
            }
            let peak = peak(|| parse(name, &bytes));
            let most = match name {
                // Tiles expand a few bytes to many samples.
                "single.vdb" => 10 * file.len() + STATED,
                _ => INFLATION * file.len(),
            };
            assert!(peak <= most + SMALL, "{name}: {peak} bytes");
        }
    }
}

/// Files that state huge sizes, without compression that could explain them.
fn huge_claims() {
    let mut vol = b"VOL\x03\x01\0\0\0".to_vec();
    vol.extend(
        [1 << 11, 1 << 10, 1 << 10, 1i32]
            .iter()
            .flat_map(|n| n.to_le_bytes()),
    );
    vol.extend([0; 28]);
    let text = |name, from: &str, to: &str| {
        let text = String::from_utf8_lossy(&made(name)).into_owned();
        assert!(text.contains(from), "{name}");
        text.replace(from, to).into_bytes()
    };
    // A MATLAB array, also compressed: its dimensions follow flags, and its size follows a name.
    let mut mat = made("compressed.mat");
    let mut array = Vec::new();
    let mut block = ZlibDecoder::new(&mat[136..]);
    block.read_to_end(&mut array).unwrap();
    let dimensions = [400, 1000, 1000i32].map(i32::to_le_bytes).concat();
    array[32..44].copy_from_slice(&dimensions);
    array[68..72].copy_from_slice(&3_200_000_000u32.to_le_bytes());
    let mut packed = Vec::new();
    let mut encoder = ZlibEncoder::new(&array[..], Compression::default());
    encoder.read_to_end(&mut packed).unwrap();
    mat.truncate(128);
    mat.extend([15u8, 0, 0, 0]);
    mat.extend((packed.len() as u32).to_le_bytes());
    mat.extend(packed);
    for (name, bytes) in [
        ("a.vol", vol),
        ("a.mat", mat),
        (
            "a.nrrd",
            text("ascii.nrrd", "sizes: 2 3 4", "sizes: 2000 1000 1000"),
        ),
        (
            "a.vti",
            text("ascii.vti", "3 4 0 2 -1 2", "0 2000 0 1000 0 1000"),
        ),
        (
            "a.vtk",
            text("ascii.vtk", "1 24 float", "1 2000000000 float"),
        ),
        (
            "a.vtk",
            text("ascii.vtk", "POINT_DATA 24", "POINT_DATA 2000000000"),
        ),
        (
            "a.jnii",
            text(
                "zlib.jnii",
                "[2, 3, 4], \"_ArrayZip",
                "[1000, 1000, 2000], \"_ArrayZip",
            ),
        ),
    ] {
        let peak = peak(|| parse(name, &bytes));
        assert!(peak <= SMALL, "{name}: {peak} bytes");
    }
}

#[test]
fn memory_is_bounded() {
    valid_files();
    huge_claims();
    damaged_files();
}
