//! VTK volumes written by VTK, and refused files of this format. Values are x + 10 y + 100 z.

use crate::volumes_of_others::{bytes, check, data, place};
use glam::DVec3;
use morgana_io::element::Element;
use morgana_io::volume::{Options, Volume, vti, vtk};

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
        "lz4",
    ] {
        let volume = vti::read(&data(&format!("{name}.vti")), Options::default()).unwrap();
        check(&volume, name);
        let frame = volume.frame().unwrap();
        assert_eq!(frame.nodes, name != "cells");
        let to_file = frame.to_file(volume.size());
        // Extents begin at (3, 0, −1), from the origin (0.5, −1, 2) in steps of (0.1, 0.2, 0.4).
        let low = to_file.transform_point3(DVec3::ZERO);
        assert!(low.distance(DVec3::new(0.8, -1.0, 1.6)) < 1e-12, "{name}");
        let samples = if name == "cells" {
            [2, 3, 4]
        } else {
            [1, 2, 3]
        };
        let edge = DVec3::from_array(samples.map(f64::from)) * DVec3::new(0.1, 0.2, 0.4);
        let high = to_file.transform_point3(DVec3::ONE);
        assert!(high.distance(low + edge) < 1e-12, "{name}");
    }
}

/// LZMA is refused with advice. A damaged LZ4 block is refused, too, and nothing panics.
#[test]
fn compressed_vti_that_is_refused() {
    let error = vti::read::<f64>(&data("lzma.vti"), Options::default()).unwrap_err();
    let error = error.to_string();
    for words in ["vtkLZMADataCompressor", "SetCompressorTypeToZLib"] {
        assert!(error.contains(words), "{error}");
    }
    let good = bytes("lz4.vti");
    let start = good
        .windows(14)
        .position(|w| w == b"<AppendedData ")
        .unwrap();
    for at in start..good.len() {
        let mut broken = good.clone();
        broken[at] ^= 0x11;
        let _ = vti::parse::<f64>(&broken, Options::default());
        let _ = vti::parse::<f64>(&good[..at], Options::default());
    }
}

#[test]
fn legacy_vtk() {
    for (name, array, element, nodes) in [
        ("ascii.vtk", None, Element::F32, true),
        ("cells.vtk", None, Element::I16, false),
        ("three.vtk", Some("density"), Element::F32, true),
    ] {
        let options = Options {
            dataset: array,
            ..Options::default()
        };
        let volume = vtk::read(&data(name), options).unwrap();
        check(&volume, name);
        assert_eq!(volume.element(), element);
        let frame = volume.frame().unwrap();
        let half = if nodes {
            DVec3::ZERO
        } else {
            DVec3::new(0.05, 0.1, 0.2)
        };
        assert!(
            frame.first.distance(place(nodes).first + half) < 1e-12,
            "{name}"
        );
        assert_eq!((frame.steps, frame.nodes), (place(nodes).steps, nodes));
    }
    let pair: Volume<f64> = vtk::read(&data("three.vtk"), Options::default().of("pair")).unwrap();
    assert_eq!(
        (pair.channels(), &pair.data()[46..]),
        (2, &[321.0, 1321.0][..])
    );
    let error = vtk::read::<f32>(&data("three.vtk"), Options::default())
        .unwrap_err()
        .to_string();
    assert!(
        error.ends_with("found the arrays: other, density, pair"),
        "{error}"
    );
}

#[track_caller]
/// Legacy files encode names that are not words; arrays have their real names.
#[test]
fn names_in_legacy_vtk_are_decoded() {
    let text = String::from_utf8(bytes("ascii.vtk")).unwrap();
    let encoded = text.replacen("density 1 24", "rho%2frho0%20(%25)% 1 24", 1);
    assert_ne!(text, encoded);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("encoded.vtk");
    std::fs::write(&path, encoded).unwrap();
    let named = |name| vtk::read::<f32>(&path, Options::default().of(name));
    assert!(named("rho/rho0 (%)%").is_ok());
    let message = named("rho").unwrap_err().to_string();
    assert!(
        message.contains("found the arrays: rho/rho0 (%)%"),
        "{message}"
    );
}

fn vtk_error(from: &str, to: &str, expected: &str) {
    let text = String::from_utf8(bytes("ascii.vtk")).unwrap();
    assert!(text.contains(from));
    let error =
        vtk::parse::<f32>(text.replace(from, to).as_bytes(), Options::default()).unwrap_err();
    let error = error.to_string();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn legacy_vtk_that_is_refused() {
    vtk_error(
        "# vtk",
        "# VTK",
        "does not begin with '# vtk DataFile Version'",
    );
    vtk_error("ASCII", "ascii", "'ascii' instead of ASCII or BINARY");
    vtk_error("STRUCTURED_POINTS", "POLYDATA", "VTK data of type POLYDATA");
    vtk_error("SPACING 0.1", "SPACING 0", "SPACING is degenerate");
    vtk_error(
        "24 float",
        "24 long",
        "whose size is not the same everywhere",
    );
    vtk_error("24 float", "24 bit", "numbers of type 'bit'");
    vtk_error("24 float", "25 float", "the line 'INFORMATION 0'");
    vtk_error("1 24 float", "1 999999999999 float", "an array ends early");
    vtk_error(
        "DIMENSIONS 2",
        "DIMENSIONS 3",
        "expected 36 values, as DIMENSIONS say, found 24",
    );
    vtk_error("320 321", "320 x", "'x' is not a number");
    vtk_error(
        "320 321",
        "320 nan",
        "value NaN at voxel (1, 2, 3) is not finite",
    );
    vtk_error(
        "METADATA",
        "METADATUM",
        "the line 'METADATUM' in a .vtk file",
    );
    vtk_error("ASCII", "BINARY", "the line 'ATA' in a .vtk file");
    let cut = &bytes("cells.vtk")[..210];
    let error = vtk::parse::<f32>(cut, Options::default())
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("truncated: expected"), "{error}");
}

#[track_caller]
fn vti_error(from: &str, to: &str, expected: &str) {
    let text = String::from_utf8(bytes("ascii.vti")).unwrap();
    assert!(text.contains(from));
    let error =
        vti::parse::<f32>(text.replace(from, to).as_bytes(), Options::default()).unwrap_err();
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

/// Readers do not trust the sizes that a file states.
#[test]
fn vti_blocks_that_are_refused() {
    let good = bytes("appended_raw_zlib.vti");
    let text = String::from_utf8_lossy(&good).into_owned();
    let start = good.iter().position(|b| *b == b'_').unwrap() + 1;
    assert!(text.contains("vtkZLibDataCompressor"));
    for (at, byte) in [(0, 0xff), (3, 0xff), (12, 0xff), (12, 1), (24, 0)] {
        let mut bad = good.clone();
        bad[start + at] = byte;
        assert!(
            vti::parse::<f32>(&bad, Options::default()).is_err(),
            "{at} {byte}"
        );
    }
}
