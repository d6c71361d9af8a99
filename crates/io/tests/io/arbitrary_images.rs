//! Images from arbitrary and damaged bytes are read or refused: nothing panics, and no reader
//! allocates more than a file can hold.

use crate::common;
use morgana_io::image::tone::Tone;
use morgana_io::image::{ImageLayers, Layer, RgbImage, exr, png};
use proptest::prelude::*;

fn exr_file() -> Vec<u8> {
    let layer = |name: &str| Layer {
        name: name.into(),
        channels: vec![("R".into(), vec![0.5; 6]), ("G".into(), vec![1.5; 6])],
    };
    let image = ImageLayers {
        width: 3,
        height: 2,
        layers: vec![layer(""), layer("variance")],
        attributes: vec![("seed".into(), "7".into())],
    };
    exr::encode(&image).unwrap()
}

fn png_file() -> Vec<u8> {
    let image = RgbImage {
        width: 3,
        height: 2,
        pixels: vec![[0.1, 0.5, 0.9]; 6],
    };
    png::encode(&image, png::Depth::Eight, Tone::default()).unwrap()
}

fn npy_file(shape: &str) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend([0; 24]);
    bytes
}

fn read_npy(bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    std::fs::write(&path, bytes).unwrap();
    ImageLayers::read(&path).is_ok()
}

/// A valid file with some changed bytes, which may lack its end.
fn damaged(file: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let length = file.len();
    let changes = prop::collection::vec((0..length, any::<u8>()), 0..8);
    (changes, 0..=length).prop_map(move |(changes, cut)| {
        let mut bytes = file.clone();
        changes.into_iter().for_each(|(at, byte)| bytes[at] = byte);
        bytes.truncate(cut.max(length / 2));
        bytes
    })
}

#[test]
fn shapes_of_arrays() {
    for good in ["(2, 3)", "(1, 2, 3)", "(2, 3, 1)", "(1, 1, 6)"] {
        assert!(read_npy(&npy_file(good)), "{good}");
    }
    for bad in [
        "()",
        "(6,)",
        "(1, 1, 2, 3)",
        "(0, 3)",
        "(2, 3, 0)",
        "(0, 0, 0)",
    ] {
        assert!(!read_npy(&npy_file(bad)), "{bad}");
    }
}

/// 30,000 × 30,000 pixels in a few bytes, with a valid checksum of the header.
#[test]
fn a_png_file_holds_no_more_than_it_can() {
    let mut bytes = png_file();
    for at in [16, 20] {
        bytes[at..at + 4].copy_from_slice(&10_000u32.to_be_bytes());
    }
    let mut crc = flate2::Crc::new();
    crc.update(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    let message = png::decode(&bytes).unwrap_err().to_string();
    assert!(message.contains("not a PNG file"), "{message}");
}

proptest! {
    #![proptest_config(common::inputs())]

    #[test]
    fn exr_of_damaged_files(bytes in damaged(exr_file())) {
        let _ = exr::decode(&bytes);
    }

    #[test]
    fn exr_of_arbitrary_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = exr::decode(&[&exr_file()[..60], &bytes].concat());
        let _ = exr::decode(&bytes);
    }

    #[test]
    fn png_of_damaged_files(bytes in damaged(png_file())) {
        let _ = png::decode(&bytes);
    }

    #[test]
    fn png_of_arbitrary_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = png::decode(&[&png_file()[..33], &bytes].concat());
        let _ = png::decode(&bytes);
    }
}
