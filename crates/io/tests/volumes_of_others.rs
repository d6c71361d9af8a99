//! Volumes written by the reference libraries of their formats, VTK and h5py (data/volumes/make.py), and
//! such files that must be refused. Values are x + 10 y + 100 z.

use std::path::{Path, PathBuf};

use glam::DVec3;
use io::volume::{AxisOrder, Volume, hdf5, vti};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/volumes")
        .join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(data(name)).unwrap()
}

#[track_caller]
fn check(volume: &Volume<f64>, what: &str) {
    assert_eq!((volume.size(), volume.channels()), ([2, 3, 4], 1), "{what}");
    let value = |i: usize| (i % 2 + 10 * (i / 2 % 3) + 100 * (i / 6)) as f64;
    for (i, found) in volume.data().iter().enumerate() {
        assert_eq!(*found, value(i), "{what}: {i}");
    }
}

#[test]
fn every_encoding_of_vti() {
    for name in [
        "ascii",
        "inline",
        "inline_zlib",
        "appended_raw",
        "appended_raw_zlib",
        "appended_base64",
        "appended_base64_zlib",
        "cells",
    ] {
        let volume = vti::read(&data(&format!("{name}.vti")), None).unwrap();
        check(&volume, name);
        let frame = volume.frame().unwrap();
        assert_eq!(frame.nodes, name != "cells");
        // Extents begin at (3, 0, −1), from the origin (0.5, −1, 2) in steps of (0.1, 0.2, 0.4).
        let low = frame.to_file.transform_point3(DVec3::ZERO);
        assert!(low.distance(DVec3::new(0.8, -1.0, 1.6)) < 1e-12, "{name}");
        let samples = if name == "cells" {
            [2, 3, 4]
        } else {
            [1, 2, 3]
        };
        let edge = DVec3::from_array(samples.map(f64::from)) * DVec3::new(0.1, 0.2, 0.4);
        let high = frame.to_file.transform_point3(DVec3::ONE);
        assert!(high.distance(low + edge) < 1e-12, "{name}");
    }
}

#[test]
fn one_of_several_arrays() {
    let path = data("two.vti");
    check(&vti::read(&path, Some("density")).unwrap(), "density");
    let other: Volume<f64> = vti::read(&path, Some("other")).unwrap();
    assert_eq!(other.data()[23], 642.0);
    let refused = |name| vti::read::<f64>(&path, name).unwrap_err().to_string();
    let expected = "expected one array, or its name as 'dataset', found the arrays: density, other";
    assert!(refused(None).ends_with(expected), "{}", refused(None));
    let expected = "expected one array 'rho', found the arrays: density, other";
    assert!(refused(Some("rho")).ends_with(expected));
}

#[test]
fn hdf5_as_of_k_wave() {
    let path = data("kwave.h5");
    for (dataset, axes) in [
        ("p_final", AxisOrder::Zyx),
        ("/p_final", AxisOrder::Zyx),
        ("p_max", AxisOrder::Zyx),
        ("results/rho", AxisOrder::Xyz),
    ] {
        let volume = hdf5::read(&path, dataset, axes).unwrap();
        check(&volume, dataset);
        assert_eq!(volume.frame(), None);
    }
}

#[track_caller]
fn hdf5_error(dataset: &str, expected: &str) {
    let error = hdf5::parse::<f32>(&bytes("kwave.h5"), dataset, AxisOrder::Zyx).unwrap_err();
    let error = error.to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn hdf5_that_is_refused() {
    hdf5_error("p", "no dataset 'p'");
    hdf5_error("p", "datasets of '/': Nt, hole, p_final, p_max");
    hdf5_error("results/r", "datasets of '/results': name, rho");
    hdf5_error("", "no dataset ''");
    hdf5_error("Nt", "expected a dataset of floating-point numbers");
    hdf5_error(
        "results/name",
        "expected a dataset of floating-point numbers",
    );
    hdf5_error("hole", "value NaN at voxel (0, 1, 2) is not finite");
    let error = hdf5::parse::<f32>(b"VOL", "p", AxisOrder::Zyx).unwrap_err();
    assert!(error.to_string().starts_with("not a HDF5 file"), "{error}");
    let cut = &bytes("kwave.h5")[..3000];
    assert!(hdf5::parse::<f32>(cut, "p_final", AxisOrder::Zyx).is_err());
}

#[track_caller]
fn vti_error(from: &str, to: &str, expected: &str) {
    let text = String::from_utf8(bytes("ascii.vti")).unwrap();
    assert!(text.contains(from));
    let error = vti::parse::<f32>(text.replace(from, to).as_bytes(), None).unwrap_err();
    let error = error.to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn vti_that_is_refused() {
    vti_error(
        "ImageData\" v",
        "PolyData\" v",
        "not a VTKFile of type ImageData",
    );
    vti_error("</VTKFile>", "", "not a VTI file");
    vti_error("320 321", "320", "expected 24 values, found 23");
    vti_error(
        "320 321",
        "320 nan",
        "value NaN at voxel (1, 2, 3) is not finite",
    );
    vti_error("320 321", "320 x", "'x' is not a number");
    vti_error(
        "0.1 0.2 0.4",
        "0.1 0 0.4",
        "spacing or direction is degenerate",
    );
    vti_error("0.1 0.2 0.4", "0.1 0.2", "its Spacing is '0.1 0.2'");
    vti_error(
        "WholeExtent=\"3 4",
        "WholeExtent=\"4 3",
        "its WholeExtent is '4 3",
    );
    vti_error(
        "Piece Extent=\"3 4",
        "Piece Extent=\"3 5",
        "a piece that is not the whole image",
    );
    let huge = "0 2147483647 0 2147483647 0 2147483647";
    vti_error("3 4 0 2 -1 2", huge, "too large");
    vti_error("Float32", "Float16", "numbers of type 'Float16'");
    vti_error(
        "format=\"ascii\"",
        "format=\"binary\"",
        "expected an array of 96 bytes",
    );
    vti_error(
        "format=\"ascii\"",
        "format=\"appended\" offset=\"0\"",
        "no appended data",
    );
}

/// Sizes that a file claims are not believed.
#[test]
fn vti_blocks_that_are_refused() {
    let good = bytes("appended_raw_zlib.vti");
    let text = String::from_utf8_lossy(&good).into_owned();
    let start = good.iter().position(|b| *b == b'_').unwrap() + 1;
    assert!(text.contains("vtkZLibDataCompressor"));
    for (at, byte) in [(0, 0xff), (3, 0xff), (12, 0xff), (12, 1), (24, 0)] {
        let mut bad = good.clone();
        bad[start + at] = byte;
        assert!(vti::parse::<f32>(&bad, None).is_err(), "{at} {byte}");
    }
}
