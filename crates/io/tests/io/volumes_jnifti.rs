//! Files written by jdata and bjdata (data/volumes/make_jnifti.py), and refused files of this format.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use morgana_io::element::Element;
use morgana_io::volume::{AxisOrder, Options, Volume, VolumeFrame, jnifti, names, write};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/volumes")
        .join(name)
}

fn read(name: &str) -> Volume<f64> {
    Volume::read(&data(name), Options::default()).unwrap()
}

fn value(i: usize) -> f64 {
    (i % 2 + 10 * (i / 2 % 3) + 100 * (i / 6)) as f64
}

fn holds_values(volume: &Volume<f64>) -> bool {
    volume.data().iter().copied().eq((0..24).map(value))
}

#[test]
fn values_of_all_kinds() {
    for (name, element) in [
        ("zlib.jnii", Element::F32),
        ("gzip.jnii", Element::I16),
        ("plain.jnii", Element::U16),
        ("zlib.bnii", Element::F32),
        ("columns.jnii", Element::F32),
        ("lists.jnii", Element::F64),
    ] {
        let volume = read(name);
        assert_eq!((volume.size(), volume.channels()), ([2, 3, 4], 1), "{name}");
        assert_eq!(volume.element(), element, "{name}");
        assert!(holds_values(&volume), "{name}");
        let unit = (name != "lists.jnii").then_some("mm");
        assert_eq!(volume.unit(), unit, "{name}");
    }
    let scaled = read("scaled.bnii");
    let expected = (0..24).map(|i| 0.5 * value(i) + 3.0);
    assert!(scaled.data().iter().copied().eq(expected));
}

#[test]
fn places() {
    let turned = DMat3::from_cols(-0.25 * DVec3::Y, 0.5 * DVec3::X, 2.0 * DVec3::Z);
    for name in ["zlib.jnii", "gzip.jnii", "plain.jnii", "zlib.bnii"] {
        let frame = read(name).frame().unwrap();
        let far = (frame.steps - turned).to_cols_array().map(f64::abs);
        assert!(far.iter().all(|d| *d < 1e-6), "{name}: {frame:?}");
        let first = (frame.first - DVec3::new(1.0, 2.0, 3.0)).length();
        assert!(first < 1e-6, "{name}");
    }
    for (name, steps) in [
        // Affine is the identity, as in files of MCX.
        ("columns.jnii", DVec3::splat(0.5)),
        ("lists.jnii", DVec3::new(0.5, 0.25, 2.0)),
    ] {
        let frame = read(name).frame().unwrap();
        let expected = VolumeFrame {
            first: DVec3::ZERO,
            steps: DMat3::from_diagonal(steps),
            nodes: false,
        };
        assert_eq!(frame, expected, "{name}");
    }
}

#[test]
fn arrays_by_name() {
    assert_eq!(names(&data("arrays.jdt")).unwrap(), ["rho", "both"]);
    let xyz = Options::order(AxisOrder::XYZ);
    for name in ["arrays.jdt", "arrays.jdb"] {
        let volume = Volume::<f64>::read(&data(name), xyz.of("rho")).unwrap();
        assert_eq!(volume.element(), Element::F64);
        assert!(holds_values(&volume), "{name}");
    }
    let both = Volume::<f64>::read(&data("arrays.jdt"), xyz.of("both")).unwrap();
    let expected = (0..24).flat_map(|i| [value(i), -value(i)]);
    assert!(both.data().iter().copied().eq(expected));
    let turned = Volume::<f64>::read(
        &data("arrays.jdb"),
        Options::order(AxisOrder::ZYX).of("rho"),
    );
    assert_eq!(turned.unwrap().size(), [4, 3, 2]);
    let refused = |options| {
        let read = Volume::<f64>::read(&data("arrays.jdt"), options);
        read.unwrap_err().to_string()
    };
    assert!(refused(xyz).contains("rho, both"));
    assert!(refused(Options::default().of("rho")).contains("order of its axes"));
}

#[test]
fn written_files() {
    let folder = tempfile::tempdir().unwrap();
    let turned = DMat3::from_cols(-0.25 * DVec3::Y, 0.5 * DVec3::X, 2.0 * DVec3::Z);
    let frame = VolumeFrame {
        first: DVec3::new(1.0, 2.0, 3.0),
        steps: turned,
        nodes: false,
    };
    for (extension, channels) in [("jnii", 1), ("bnii", 1), ("jnii", 3), ("bnii", 3)] {
        let values = (0..24 * channels).map(|i| 0.25 * i as f64).collect();
        let volume = Volume::<f64>::new([2, 3, 4], channels, values).unwrap();
        let volume = volume.with_frame(frame).with_unit(Some("mm".into()));
        let path = folder.path().join("a").with_extension(extension);
        let stored = write(&path, &volume, "density").unwrap();
        assert!(stored.place && stored.axes.is_none());
        let read = Volume::<f64>::read(&path, Options::default()).unwrap();
        assert_eq!(read, volume, "{extension} {channels}");
    }
}

#[test]
fn mistakes() {
    let refused = |text: &str| {
        let read = jnifti::parse::<f32>(text.as_bytes(), Options::default());
        read.unwrap_err().to_string()
    };
    let array = |more: &str| {
        refused(&format!(
            r#"{{"NIFTIData": {{"_ArrayType_": "uint8", "_ArraySize_": [2, 1, 1], {more}}}}}"#
        ))
    };
    assert!(refused("").contains("not a JData file"));
    assert!(refused("{}").contains("one array"));
    assert!(refused(r#"{"NIFTIData": 3}"#).contains("neither an annotated array"));
    assert!(refused(r#"{"NIFTIData": [[[1, 2], [3]]]}"#).contains("different lengths"));
    assert!(array(r#""_ArrayData_": [1]"#).contains("1 numbers"));
    assert!(array(r#""_ArrayZipType_": "lzma", "_ArrayZipData_": "AAAA""#).contains("lzma"));
    assert!(array(r#""_ArrayZipType_": "base64", "_ArrayZipData_": "AAAA""#).contains("more"));
    assert!(array(r#""_ArrayZipType_": "base64", "_ArrayZipData_": "AA==""#).contains("less"));
    assert!(array(r#""_ArrayOrder_": "x", "_ArrayData_": [1, 2]"#).contains("_ArrayOrder_"));
    assert!(array(r#""_ArrayIsSparse_": true, "_ArrayData_": [1, 2]"#).contains("dense"));
    let axes = r#"{"NIFTIData": {"_ArrayType_": "uint8", "_ArraySize_": [1, 1, 1, 2, 2], "_ArrayData_": [1, 2, 3, 4]}}"#;
    assert!(refused(axes).contains("more than four axes"));
    // 8 GB of zeros cannot be in a few bytes.
    let huge = r#"{"NIFTIData": {"_ArrayType_": "single", "_ArraySize_": [1000, 1000, 2000], "_ArrayZipType_": "zlib", "_ArrayZipData_": "AAAA"}}"#;
    assert!(refused(huge).contains("truncated"));
    let affine =
        r#"{"NIFTIHeader": {"SForm": 1, "Affine": [[1, 0], [0, 1]]}, "NIFTIData": [[[1, 2]]]}"#;
    assert!(refused(affine).contains("Affine"));
    let flat = r#"{"NIFTIHeader": {"SForm": 1, "Affine": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]]}, "NIFTIData": [[[1, 2]]]}"#;
    assert!(refused(flat).contains("no volume"));
}
