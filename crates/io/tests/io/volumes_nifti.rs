//! Files written by nibabel (data/volumes/make_nifti.py), and refused files of this format.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use morgana_io::element::Element;
use morgana_io::volume::{Options, Volume, nifti};

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

#[test]
fn values_of_all_kinds() {
    for (name, element) in [
        ("labels.nii", Element::I16),
        ("labels.nii.gz", Element::U16),
        ("second.nii", Element::F64),
        ("quaternion.nii", Element::F32),
    ] {
        let volume = read(name);
        assert_eq!((volume.size(), volume.channels()), ([2, 3, 4], 1), "{name}");
        assert_eq!(volume.element(), element, "{name}");
        assert!(
            volume.data().iter().copied().eq((0..24).map(value)),
            "{name}"
        );
        assert_eq!(volume.unit(), Some("mm"), "{name}");
    }
    let bytes = read("spacing.nii");
    assert_eq!(bytes.element(), Element::U8);
    assert!(
        bytes
            .data()
            .iter()
            .copied()
            .eq((0..24).map(|i| value(i) % 256.0))
    );
    let channels = read("channels.nii");
    assert_eq!((channels.size(), channels.channels()), ([2, 3, 4], 2));
    assert!(
        channels
            .data()
            .iter()
            .copied()
            .eq((0..24).flat_map(|i| [value(i), -value(i)]))
    );
    // Its bytes are swapped, and its values are scaled by a half plus three.
    let scaled = read("scaled.nii");
    assert!(
        scaled
            .data()
            .iter()
            .copied()
            .eq((0..24).map(|i| 0.5 * value(i) + 3.0))
    );
}

#[test]
fn places() {
    let turned = DMat3::from_cols(-0.25 * DVec3::Y, 0.5 * DVec3::X, 2.0 * DVec3::Z);
    for name in [
        "labels.nii",
        "labels.nii.gz",
        "second.nii",
        "quaternion.nii",
        "channels.nii",
    ] {
        let frame = read(name).frame().unwrap();
        assert!(
            (frame.steps - turned)
                .to_cols_array()
                .iter()
                .all(|d| d.abs() < 1e-6),
            "{name}: {frame:?}"
        );
        assert!(
            (frame.first - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-6,
            "{name}"
        );
        assert!(!frame.nodes);
    }
    let frame = read("spacing.nii").frame().unwrap();
    assert_eq!(
        frame.steps,
        DMat3::from_diagonal(DVec3::new(0.5, 0.25, 2.0))
    );
    assert_eq!(frame.first, DVec3::ZERO);
}

#[test]
fn mistakes() {
    let good = std::fs::read(data("labels.nii")).unwrap();
    let refused = |bytes: &[u8]| {
        nifti::parse::<f32>(bytes, Options::default())
            .unwrap_err()
            .to_string()
    };
    let with = |at: usize, new: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        refused(&bytes)
    };
    assert!(refused(b"").contains("shorter than its header"));
    assert!(refused(&[0; 400]).contains("348 or 540"));
    assert!(refused(&good[..good.len() - 1]).contains("bytes"));
    assert!(with(344, b"ni1\0").contains(".img"));
    assert!(with(344, b"xxx\0").contains("magic"));
    assert!(with(70, &32i16.to_le_bytes()).contains("type 32"));
    assert!(with(40, &9i16.to_le_bytes()).contains("9 axes"));
    assert!(with(42, &(-2i16).to_le_bytes()).contains("size of -2"));
    assert!(with(42, &30_000i16.to_le_bytes()).contains("bytes"));
    assert!(with(108, &1e30f32.to_le_bytes()).contains("begin at byte"));
    assert!(with(280, &[0; 48]).contains("no volume"));
}
