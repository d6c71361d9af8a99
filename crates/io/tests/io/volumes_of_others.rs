//! Volumes written by the reference libraries of their formats, VTK, h5py, NumPy, pynrrd and SciPy
//! (data/volumes/make.py), and refused files. Values are x + 10 y + 100 z.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use morgana_io::Limits;
use morgana_io::arrays::{Array, Arrays};
use morgana_io::element::Element;
use morgana_io::volume::{AxisOrder, Options, Volume, VolumeFrame, hdf5, mat, nrrd, vti};

pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/volumes")
        .join(name)
}

pub fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(data(name)).unwrap()
}

#[track_caller]
pub fn check(volume: &Volume<f64>, what: &str) {
    assert_eq!((volume.size(), volume.channels()), ([2, 3, 4], 1), "{what}");
    let value = |i: usize| (i % 2 + 10 * (i / 2 % 3) + 100 * (i / 6)) as f64;
    for (i, found) in volume.data().iter().enumerate() {
        assert_eq!(*found, value(i), "{what}: {i}");
    }
}

#[test]
fn one_of_several_arrays() {
    let path = data("two.vti");
    check(
        &vti::read(&path, Options::default().of("density")).unwrap(),
        "density",
    );
    let other: Volume<f64> = vti::read(&path, Options::default().of("other")).unwrap();
    assert_eq!(other.data()[23], 642.0);
    let refused = |name| {
        let options = Options {
            dataset: name,
            ..Options::default()
        };
        vti::read::<f64>(&path, options).unwrap_err().to_string()
    };
    let expected = "expected one array, or its name (--dataset, or 'dataset' in a scene), found the arrays: density, other";
    assert!(refused(None).ends_with(expected), "{}", refused(None));
    let expected = "expected one array 'rho', found the arrays: density, other";
    assert!(refused(Some("rho")).ends_with(expected));
}

#[test]
fn hdf5_as_of_k_wave() {
    let path = data("kwave.h5");
    for (dataset, axes) in [
        ("p_final", AxisOrder::ZYX),
        ("/p_final", AxisOrder::ZYX),
        ("p_max", AxisOrder::ZYX),
        ("results/rho", AxisOrder::XYZ),
    ] {
        let volume = hdf5::read(&path, Options::order(axes).of(dataset)).unwrap();
        check(&volume, dataset);
        assert_eq!(volume.frame(), None);
    }
}

/// Values x + 10 y + 100 z, each repeated 50 times along x.
#[test]
fn hdf5_compressed_by_lzf() {
    let options = Options::order(AxisOrder::ZYX).of("n");
    let volume: Volume<f64> = hdf5::read(&data("lzf.h5"), options).unwrap();
    assert_eq!(volume.size(), [100, 3, 4]);
    for (i, found) in volume.data().iter().enumerate() {
        let value = i % 100 / 50 + 10 * (i / 100 % 3) + 100 * (i / 300);
        assert_eq!(*found, value as f64, "{i}");
    }
    let mut broken = bytes("lzf.h5");
    let (_, second) = broken.split_at_mut(4000);
    second.iter_mut().for_each(|b| *b ^= 0x55);
    let _ = hdf5::parse::<f64>(&broken, options);
}

#[test]
fn virtual_hdf5_says_what_to_do() {
    let options = Options::order(AxisOrder::ZYX).of("virtual");
    let error = hdf5::read::<f64>(&data("lzf.h5"), options).unwrap_err();
    let error = error.to_string();
    for words in ["virtual datasets", "create_dataset"] {
        assert!(error.contains(words), "{error}");
    }
}

/// Placement of the grid in most files: from (0.8, −1, 1.6) in steps of (0.1, 0.2, 0.4).
pub fn place(nodes: bool) -> VolumeFrame {
    VolumeFrame {
        first: DVec3::new(0.8, -1.0, 1.6),
        steps: DMat3::from_diagonal(DVec3::new(0.1, 0.2, 0.4)),
        nodes,
    }
}

#[test]
fn all_types_of_hdf5() {
    let path = data("numbers.h5");
    let types = [
        ("f2", Element::F16),
        ("i1", Element::I8),
        ("i2", Element::I16),
        ("i4", Element::I32),
        ("i8", Element::I64),
        ("u1", Element::U8),
        ("u2", Element::U16),
        ("u4", Element::U32),
        ("u8", Element::U64),
    ];
    for (name, element) in types {
        let volume = Volume::<f32>::read(&path, Options::order(AxisOrder::ZYX).of(name)).unwrap();
        assert_eq!(volume.element(), element);
        let values = (0..24).map(|i| (i % 2 + 10 * (i / 2 % 3)) as f32);
        assert!(volume.data().iter().copied().eq(values), "{name}");
        // Spacings have single precision, as k-Wave writes dx, dy, dz.
        let [low, high] = volume.bbox().unwrap();
        let edges = DVec3::new(2e-4, 6e-4, 16e-4);
        assert!(low == DVec3::ZERO && high.distance(edges) < 1e-10);
    }
    let options = Options::order("czyx".parse().unwrap()).of("czyx");
    let volume = Volume::<f64>::read(&path, options).unwrap();
    assert_eq!(volume.channels(), 2);
    assert_eq!(volume.data()[46..], [321.0, 1321.0]);
}

#[test]
fn npy_and_npz() {
    let zyx = Options::order(AxisOrder::ZYX);
    let xyz = Options::order(AxisOrder::XYZ);
    for (name, options, element) in [
        ("half.npy", zyx, Element::F16),
        ("big.npy", xyz, Element::I32),
        ("stored.npz", zyx.of("density"), Element::F32),
        ("compressed.npz", zyx, Element::U16),
        ("compressed.npz", zyx.of("density"), Element::U16),
    ] {
        let volume = Volume::read(&data(name), options).unwrap();
        check(&volume, name);
        assert_eq!(volume.element(), element);
    }
    let refused = |options| {
        Volume::<f32>::read(&data("stored.npz"), options)
            .unwrap_err()
            .to_string()
    };
    let error = refused(zyx);
    assert!(
        error.ends_with("found the arrays: density, other"),
        "{error}"
    );
    let error = refused(zyx.of("other"));
    assert!(error.ends_with("found an array of shape [3]"), "{error}");
}

#[test]
fn nrrd_of_every_encoding() {
    for (name, element, nodes) in [
        ("raw.nrrd", Element::F32, true),
        ("gzip.nrrd", Element::I16, false),
        ("ascii.nrrd", Element::F64, true),
        ("detached.nhdr", Element::U16, false),
    ] {
        let volume = Volume::read(&data(name), Options::default()).unwrap();
        check(&volume, name);
        assert_eq!(volume.element(), element);
        assert_eq!(volume.frame(), Some(place(nodes)), "{name}");
        assert_eq!(volume.unit(), Some("mm"));
    }
}

#[test]
fn nrrd_axes_and_places() {
    let read = |name, options| Volume::<f64>::read(&data(name), options);
    // Spacings belong to the axes in their listed order, the fastest first.
    let volume = read("spacings.nrrd", Options::order(AxisOrder::XYZ)).unwrap();
    check(&volume, "spacings");
    let first = DVec3::ZERO;
    assert_eq!(
        volume.frame(),
        Some(VolumeFrame {
            first,
            ..place(false)
        })
    );
    let volume = read("z_first.nrrd", Options::order(AxisOrder::ZYX)).unwrap();
    check(&volume, "z_first");
    assert_eq!(volume.frame(), None);
    let volume = read("turned.nrrd", Options::default()).unwrap();
    assert_eq!((volume.size(), volume.channels()), ([2, 3, 4], 2));
    assert_eq!(volume.data()[46..], [321.0, 1321.0]);
    let steps = DMat3::from_cols(DVec3::Y * 0.1, DVec3::X * -0.2, DVec3::Z * 0.4);
    assert_eq!(
        volume.frame(),
        Some(VolumeFrame {
            steps,
            ..place(false)
        })
    );
    let error = read("spacings.nrrd", Options::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("give the order of its axes"), "{error}");
    let error = read("raw.nrrd", Options::order(AxisOrder::XYZ))
        .unwrap_err()
        .to_string();
    assert!(error.contains("leave out the order"), "{error}");
}

#[track_caller]
fn nrrd_error(name: &str, from: &str, to: &str, expected: &str) {
    let bytes = bytes(name);
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
    let at = at.unwrap();
    let changed = [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat();
    let error = nrrd::parse::<f32>(&changed, Options::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn nrrd_that_is_refused() {
    nrrd_error(
        "raw.nrrd",
        "NRRD0005",
        "NRRE0005",
        "it does not begin with 'NRRD000'",
    );
    nrrd_error(
        "raw.nrrd",
        "type: float",
        "type: block",
        "numbers of type 'block'",
    );
    nrrd_error(
        "raw.nrrd",
        "sizes: 2 3 4",
        "sizes: 2 3 5",
        "truncated: expected 120 bytes, found 96",
    );
    nrrd_error(
        "raw.nrrd",
        "sizes: 2 3 4",
        "sizes: 2 3 3",
        "24 unexpected bytes",
    );
    nrrd_error(
        "raw.nrrd",
        "sizes: 2 3 4",
        "sizes: 2 x 4",
        "its 'sizes' is '2 x 4'",
    );
    nrrd_error(
        "raw.nrrd",
        "endian: little",
        "endian: middle",
        "no 'endian'",
    );
    nrrd_error(
        "raw.nrrd",
        "encoding: raw",
        "encoding: bzip2",
        "NRRD encoding 'bzip2'",
    );
    nrrd_error(
        "raw.nrrd",
        "(0.10000000000000001,0,0)",
        "(0,0,0)",
        "degenerate",
    );
    nrrd_error(
        "raw.nrrd",
        "(0.10000000000000001,0,0)",
        "none",
        "other than three 'space directions'",
    );
    nrrd_error(
        "raw.nrrd",
        "node node node",
        "node node cell",
        "'centers' of both kinds",
    );
    nrrd_error(
        "gzip.nrrd",
        "sizes: 2 3 4",
        "sizes: 2 3 5",
        "damaged or end early",
    );
    let huge = "sizes: 99999999 99999 9";
    nrrd_error("gzip.nrrd", "sizes: 2 3 4", huge, "truncated: expected");
    nrrd_error(
        "ascii.nrrd",
        "sizes: 2 3 4",
        "sizes: 2 3 5",
        "expected 30 values, found 24",
    );
    let error = nrrd::parse::<f32>(&bytes("detached.nhdr"), Options::default()).unwrap_err();
    assert!(
        error.to_string().contains("in a file of their own"),
        "{error}"
    );
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("a.nhdr");
    std::fs::copy(data("detached.nhdr"), &copy).unwrap();
    let error = nrrd::read::<f32>(&copy, Options::default())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("its data file 'detached.raw': cannot read"),
        "{error}"
    );
}

#[test]
fn matlab() {
    let xyz = Options::order(AxisOrder::XYZ);
    for (name, options, element) in [
        ("plain.mat", xyz.of("density"), Element::F32),
        ("compressed.mat", xyz, Element::F64),
        ("compressed.mat", xyz.of("density"), Element::F64),
    ] {
        let volume = Volume::read(&data(name), options).unwrap();
        check(&volume, name);
        assert_eq!(volume.element(), element);
    }
    // MATLAB stores a single layer with two axes.
    let flat: Volume = Volume::read(&data("plain.mat"), xyz.of("flat")).unwrap();
    assert_eq!((flat.size(), flat.data()[5]), ([2, 3, 1], 21.0));
}

#[track_caller]
fn mat_error(bytes: &[u8], name: Option<&str>, expected: &str) {
    let options = Options {
        dataset: name,
        ..Options::order(AxisOrder::XYZ)
    };
    let error = mat::parse::<f32>(bytes, options).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn matlab_that_is_refused() {
    let plain = bytes("plain.mat");
    mat_error(&plain, None, "found the arrays: density, flat, wave");
    mat_error(&plain, Some("label"), "expected one array 'label'");
    mat_error(&plain, Some("wave"), "the complex array 'wave'");
    mat_error(
        &bytes("v73.mat"),
        None,
        "MATLAB 7.3, which is HDF5: rename it to .h5",
    );
    mat_error(b"MATLAB 5.0 MAT-file", None, "shorter than a header");
    mat_error(&[0; 128], None, "its header does not have version 5");
    mat_error(&plain[..200], None, "truncated: expected 96 bytes, found");
    let mut compressed = bytes("compressed.mat");
    compressed[200] ^= 0xff;
    mat_error(&compressed, Some("density"), "");
}

/// The advice in the message for MATLAB 7.3 files works.
#[test]
fn matlab_7_3_as_hdf5() {
    let options = Options::order(AxisOrder::ZYX).of("density");
    check(&hdf5::parse(&bytes("v73.mat"), options).unwrap(), "v73");
}

#[track_caller]
fn hdf5_error(dataset: &str, expected: &str) {
    let error = hdf5::parse::<f32>(
        &bytes("kwave.h5"),
        Options::order(AxisOrder::ZYX).of(dataset),
    )
    .unwrap_err();
    let error = error.to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn hdf5_that_is_refused() {
    hdf5_error("p", "no dataset 'p'");
    hdf5_error("p", "datasets of '/': Nt, hole, p_final, p_max");
    hdf5_error("results/r", "datasets of '/results': name, rho");
    hdf5_error("", "no dataset ''");
    hdf5_error("results/name", "expected a dataset of numbers");
    hdf5_error("hole", "value NaN at voxel (0, 1, 2) is not finite");
    let error = hdf5::parse::<f32>(b"VOL", Options::order(AxisOrder::ZYX).of("p")).unwrap_err();
    assert!(error.to_string().starts_with("not a HDF5 file"), "{error}");
    let cut = &bytes("kwave.h5")[..3000];
    assert!(hdf5::parse::<f32>(cut, Options::order(AxisOrder::ZYX).of("p_final")).is_err());
}

/// Returns the arrays of a file by name, and the omitted ones.
fn arrays(name: &str) -> (Vec<Array>, Vec<(String, String)>) {
    let read = Arrays::read(&data(name), Limits::default()).unwrap();
    (read.list, read.left_out)
}

fn named<'a>(list: &'a [Array], name: &str) -> &'a Array {
    let names: Vec<&str> = list.iter().map(|a| a.name.as_str()).collect();
    let found = list.iter().find(|array| array.name == name);
    found.unwrap_or_else(|| panic!("no {name} among {names:?}"))
}

/// Asserts that elements are 100 z + 10 y + x in this order of axes.
#[track_caller]
fn check_array(array: &Array, axes: &str) {
    let size = |axis| match axis {
        'x' => 2,
        'y' => 3,
        _ => 4,
    };
    let shape: Vec<usize> = axes.chars().map(size).collect();
    assert_eq!(array.shape, shape);
    let place = |axis| 10f64.powi(axis as i32 - i32::from(b'x'));
    let steps: Vec<f64> = axes.chars().map(|axis| place(axis as u8)).collect();
    let element = |mut i: usize| {
        let mut value = 0.0;
        for (n, step) in shape.iter().zip(&steps).rev() {
            value += step * (i % n) as f64;
            i /= n;
        }
        value
    };
    let expected: Vec<f64> = (0..24).map(element).collect();
    assert_eq!(array.data, expected, "{}", array.name);
}

#[test]
fn all_arrays_of_a_file() {
    let (list, left_out) = arrays("two.vti");
    let names: Vec<&str> = list.iter().map(|array| array.name.as_str()).collect();
    assert_eq!(names, ["density", "other", "x_edges", "y_edges", "z_edges"]);
    assert!(left_out.is_empty());
    // The first point along x is at 0.5 + 3 · 0.1, the first along z at 2 − 0.4.
    let edges = |name| &named(&list, name).data;
    for (found, expected) in edges("x_edges").iter().zip([0.75, 0.85, 0.95]) {
        assert!((found - expected).abs() < 1e-12, "{found}");
    }
    assert!((edges("z_edges")[0] - 1.4).abs() < 1e-12);
    check_array(named(&list, "density"), "zyx");
    assert_eq!(named(&list, "other").data[23], 642.0);
    assert_eq!(named(&list, "other").axes, ["z", "y", "x"]);

    let (list, left_out) = arrays("kwave.h5");
    check_array(named(&list, "p_max"), "zyx");
    check_array(named(&list, "results/rho"), "xyz");
    assert!(named(&list, "hole").data[14].is_nan());
    assert_eq!(named(&list, "Nt").data, [10.0]);
    // Texts are not arrays.
    assert_eq!((list.len(), left_out.len()), (5, 0));

    for (name, axes) in [("stored.npz", "zyx"), ("compressed.npz", "zyx")] {
        check_array(named(&arrays(name).0, "density"), axes);
    }
    assert_eq!(
        named(&arrays("stored.npz").0, "other").data,
        [0.0, 1.0, 2.0]
    );
    check_array(named(&arrays("big.npy").0, "array"), "xyz");
    check_array(named(&arrays("half.npy").0, "array"), "zyx");

    // MATLAB's p(x, y, z), of versions 5 and 7.3.
    let (list, left_out) = arrays("plain.mat");
    check_array(named(&list, "density"), "xyz");
    let dimensions = ["dimension 1", "dimension 2", "dimension 3"];
    assert_eq!(named(&list, "density").axes, dimensions);
    assert_eq!(named(&list, "flat").shape, [2, 3]);
    assert_eq!(
        named(&list, "flat").data,
        [0.0, 10.0, 20.0, 1.0, 11.0, 21.0]
    );
    let [(name, reason)] = &left_out[..] else {
        panic!("{left_out:?}")
    };
    assert!(name == "wave" && reason.contains("complex"), "{reason}");
    check_array(named(&arrays("compressed.mat").0, "density"), "xyz");
    check_array(named(&arrays("v73.mat").0, "density"), "xyz");

    let (list, _) = arrays("grids.vdb");
    let mut names: Vec<&str> = list.iter().map(|a| a.name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["density", "half", "turned"]);
    // A single volume has this name.
    assert_eq!(arrays("ascii.vtk").0[0].name, "volume");
}
