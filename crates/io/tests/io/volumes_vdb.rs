//! Grids written by OpenVDB (data/volumes/make_vdb.py), and refused files of this format.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use morgana_io::element::Element;
use morgana_io::volume::{AxisOrder, Options, Volume, npy, vdb};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/volumes")
        .join(name)
}

fn read(file: &str, name: Option<&str>) -> Volume<f64> {
    vdb::read(&data(file), of(name)).unwrap()
}

/// Options for the grid with a name.
fn of(dataset: Option<&str>) -> Options<'_> {
    Options {
        dataset,
        ..Options::default()
    }
}

#[test]
fn small_grids() {
    for (file, name, element) in [
        ("single.vdb", None, Element::F32),
        ("single.vdb", Some("density"), Element::F32),
        ("grids.vdb", Some("density"), Element::F32),
        ("grids.vdb", Some("turned"), Element::F32),
        ("grids.vdb", Some("half"), Element::F16),
    ] {
        let volume = read(file, name);
        assert_eq!(volume.size(), [2, 3, 4], "{file} {name:?}");
        assert_eq!(volume.element(), element);
        let value = |i: usize| (i % 2 + 10 * (i / 2 % 3) + 100 * (i / 6)) as f64;
        assert!(volume.data().iter().copied().eq((0..24).map(value)));
    }
}

/// The first voxel has the index (−1, 7, 2).
#[test]
fn places() {
    let frame = read("single.vdb", None).frame().unwrap();
    assert_eq!(frame.first, 0.25 * DVec3::new(-1.0, 7.0, 2.0));
    assert_eq!(frame.steps, DMat3::from_diagonal(DVec3::splat(0.25)));
    assert!(!frame.nodes);
    let frame = read("grids.vdb", Some("turned")).frame().unwrap();
    let steps = [-0.25 * DVec3::Y, 0.5 * DVec3::X, 2.0 * DVec3::Z];
    assert_eq!(frame.steps, DMat3::from_cols(steps[0], steps[1], steps[2]));
    let origin = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(
        frame.first,
        origin - steps[0] + 7.0 * steps[1] + 2.0 * steps[2]
    );
}

/// Several leaves, inactive voxels of two signs, compressed blocks, tiles.
#[test]
fn larger_trees() {
    let ball = read("trees.vdb", Some("ball"));
    let xyz = Options::order(AxisOrder::XYZ);
    let expected: Volume<f64> = npy::read(&data("ball.npy"), xyz).unwrap();
    assert_eq!(ball.size(), expected.size());
    assert_eq!(ball.data(), expected.data());
    assert!(ball.data()[ball.data().len() / 2] < 0.0);

    let waves = read("trees.vdb", Some("waves"));
    assert_eq!(waves.size(), [40, 12, 9]);
    for (i, value) in waves.data().iter().enumerate() {
        let sum = i % 40 + i / 40 % 12 + i / 480;
        let expected = 1.0 + 0.5 * (4.0 * (0.1 * sum as f64).sin()).floor();
        assert_eq!(*value, expected, "{i}");
    }

    let tiles = read("trees.vdb", Some("tiles"));
    assert_eq!(tiles.size(), [32, 16, 8]);
    assert!(tiles.data().iter().all(|v| *v == 3.0));
}

#[track_caller]
fn refused(bytes: &[u8], name: Option<&str>, expected: &str) {
    let error = vdb::parse::<f32>(bytes, of(name)).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn files_that_are_refused() {
    let good = std::fs::read(data("single.vdb")).unwrap();
    let with = |at: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[at] = byte;
        bytes
    };
    refused(b"VOL", None, "not a VDB file");
    refused(&good[..100], None, "the file ends early");
    refused(&good[..good.len() - 100], None, "the file ends early");
    refused(
        &good,
        Some("rho"),
        "expected one array 'rho', found the arrays: density",
    );
    refused(&with(8, 221), None, "OpenVDB files of version 221");
    refused(&with(0x14, 0), None, "OpenVDB streams");
    refused(&with(0x7c, 8), None, "compression 0x8");
    let named = good.iter().position(|b| *b == b'U').unwrap();
    refused(
        &with(named, b'X'),
        None,
        "an OpenVDB transform of type XniformScaleMap",
    );
    let several = std::fs::read(data("grids.vdb")).unwrap();
    refused(&several, None, "found the arrays: density, turned, half");
}
