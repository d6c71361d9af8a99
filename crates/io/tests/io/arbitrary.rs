//! Readers never panic, for any input.

use crate::common;
use morgana_io::arrays::Arrays;
use morgana_io::volume::series::{FrameSums, SeriesShape};
use morgana_io::volume::{
    AxisOrder, Options, hdf5, jnifti, mat, nifti, npy, npz, nrrd, vdb, vol, vti, vtk,
};
use morgana_io::{Diagnostics, FileRegistry, Limits, PluginKind, Problem, Query, ies, mesh, xml};
use proptest::prelude::*;

/// Reads a scene and queries every object for all parameters and children.
fn exercise(text: &str) {
    let mut diagnostics = Diagnostics::new();
    let overrides = [("a".to_owned(), "1".to_owned())];
    let scene = xml::parse(text, "scene.xml", &overrides, &mut diagnostics);
    assert_eq!(scene.is_none(), diagnostics.has_errors());
    for child in scene.iter().flat_map(|s| &s.root.children) {
        let mut query = Query::new(&child.object, &mut diagnostics);
        query.float("a");
        query.integer("b");
        query.spectrum("c");
        query.transform("d");
        query.word("e");
        query.path("filename", &mut FileRegistry::new());
        query.volume_or_spectrum("a");
        query.required_child(PluginKind::Bsdf);
        query.finish(&["f"]);
    }
    diagnostics.to_string();
}

/// Fragments whose text is often nearly a scene.
fn pieces() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "<scene version='3.0.0'>",
        "</scene>",
        "<shape type='a' id='b'>",
        "</shape>",
        "<ref id='b'/>",
        "<bsdf type='$a'>",
        "</bsdf>",
        "<float name='a' value='",
        "<integer name='b' value='",
        "<rgb name='c' value='",
        "<spectrum name='c' value='",
        "<point name='d' x='",
        "'/>",
        "1",
        "-",
        "1e9",
        ",",
        " ",
        ":",
        "#",
        "$a",
        "${a}",
        "${",
        "$",
        "ff8800",
        "400:1, 500:2",
        "é",
        "\n",
        "<transform name='d'>",
        "</transform>",
        "<lookat origin='0' target='1 2 3' up='",
        "<matrix value='",
        "<rotate x='1' angle='",
        "<scale value='",
        "<default name='a' value='",
        "<include filename='",
        "<alias id='b' as='",
        "<!--",
        "-->",
        "&amp;",
        "&",
        "<",
        "<!DOCTYPE a [",
        "]>",
        "\u{0}",
    ]);
    prop::collection::vec(
        prop_oneof![9 => known.prop_map(str::to_owned), 1 => ".*"],
        0..30,
    )
    .prop_map(|pieces| pieces.concat())
}

/// Bytes after a valid beginning, which get past the first check.
fn after(starts: Vec<Vec<u8>>) -> impl Strategy<Value = Vec<u8>> {
    let start = prop::sample::select(starts);
    (start, prop::collection::vec(any::<u8>(), 0..300))
        .prop_map(|(start, rest)| [start, rest].concat())
}

/// A valid file with some changed bytes.
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

fn vol_file() -> Vec<u8> {
    let mut bytes = b"VOL\x03\x01\0\0\0\x02\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\0\0".to_vec();
    bytes.extend([0; 32]);
    bytes
}

fn npy_file() -> Vec<u8> {
    let header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 1, 1), }\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header);
    bytes.extend([0; 8]);
    bytes
}

fn ply_file(format: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\n\
         property float z\nelement face 1\nproperty list uchar uchar vertex_index\nend_header\n"
    )
    .into_bytes();
    if format == "ascii" {
        bytes.extend(b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    } else {
        bytes.extend([
            0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 1, 2,
        ]);
    }
    bytes
}

fn obj_pieces() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "v ",
        "vt ",
        "vn ",
        "f ",
        "\n",
        "1 ",
        "2/1 ",
        "3//1 ",
        "-1 ",
        "/",
        "0.5 ",
        "nan ",
        "\\\n",
        "#",
        "9223372036854775807 ",
        "-9223372036854775808 ",
        "v 0 0 0\n",
        "vt 0 0\n",
        "o a\n",
    ]);
    prop::collection::vec(
        prop_oneof![9 => known.prop_map(str::to_owned), 1 => ".*"],
        0..40,
    )
    .prop_map(|pieces| pieces.concat())
}

/// Lines whose text is often nearly an NRRD header.
fn nrrd_pieces() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "type: float\n",
        "type: uint8\n",
        "dimension: 3\n",
        "sizes: 1 1 2\n",
        "sizes: 99999999999 99999999999 9\n",
        "sizes: 0 1 1\n",
        "encoding: raw\n",
        "encoding: gzip\n",
        "encoding: text\n",
        "endian: little\n",
        "line skip: 2\n",
        "byte skip: -1\n",
        "byte skip: 7\n",
        "byte skip: -9223372036854775808\n",
        "spacings: 1 nan 1\n",
        "spacings: 1\n",
        "space directions: (1,0,0) (0,1,0) (0,0,1)\n",
        "space directions: none (1,0,0) (0,1,0)\n",
        "space origin: (0,0,inf)\n",
        "centers: node cell\n",
        "data file: .\n",
        "data file: LIST\n",
        "a:=b\n",
        "\n",
        "1 2",
    ]);
    let pieces = prop_oneof![9 => known.prop_map(str::to_owned), 1 => ".*"];
    prop::collection::vec(pieces, 0..12).prop_map(|p| format!("NRRD0005\n{}", p.concat()))
}

/// Lines whose text is often nearly a file of structured points.
fn vtk_pieces() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "ASCII\n",
        "BINARY\n",
        "DATASET STRUCTURED_POINTS\n",
        "DIMENSIONS 2 1 1\n",
        "DIMENSIONS 0 1 18446744073709551615\n",
        "ORIGIN 0 0 0\n",
        "SPACING 1 1 1\n",
        "POINT_DATA 2\n",
        "CELL_DATA 1\n",
        "POINT_DATA 18446744073709551615\n",
        "SCALARS a float\n",
        "SCALARS a double 18446744073709551615\n",
        "LOOKUP_TABLE default\n",
        "VECTORS a int\n",
        "FIELD f 2\n",
        "FIELD f 18446744073709551615\n",
        "b 1 2 unsigned_char\n",
        "METADATA\n",
        "\n",
        "1 2\n",
        "nan",
    ]);
    let pieces = prop_oneof![9 => known.prop_map(str::to_owned), 1 => ".*"];
    prop::collection::vec(pieces, 0..12).prop_map(|p| p.concat())
}

/// Reads a file made by the reference library of its format (data/volumes/make.py).
fn made(name: &str) -> Vec<u8> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes");
    std::fs::read(folder.join(name)).unwrap()
}

const ZYX: Options = Options {
    axes: Some(AxisOrder::ZYX),
    dataset: None,
    limits: Limits { memory: None },
};

/// A request for two sums over the first half of the frames.
fn halves(shape: SeriesShape) -> Result<FrameSums, Problem> {
    Ok(FrameSums {
        used: 0..shape.frames.div_ceil(2),
        count: 2,
        weights: Box::new(|frame| [1.0, frame as f64, 0.0]),
    })
}

fn read_npy(bytes: &[u8]) {
    let _ = npy::parse::<f32>(bytes, ZYX);
    let _ = npy::parse_series(bytes, ZYX, &mut halves);
}

fn read_hdf5(bytes: &[u8]) {
    let file = tempfile::Builder::new().suffix(".h5").tempfile().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let _ = Arrays::read(file.path(), Limits::default());
    for dataset in ["p_final", "p_max", "results/rho", "p", "p/2", "cuboid", ""] {
        let _ = hdf5::parse::<f32>(bytes, ZYX.of(dataset));
        let _ = hdf5::parse_series(bytes, ZYX.of(dataset), &mut halves);
    }
}

const SERIALIZED: &[u8] = include_bytes!("../data/meshes/meshes4.serialized");
const IES: &[u8] =
    b"IESNA:LM-63-2002\n[MANUFAC] nobody\nTILT=NONE\n1 1000 2 3 2 1 1 0.1 0.1 0.1\n1 1 50\n\
    0 45 90\n0 90\n100 50 0\n200 100 0\n";

#[test]
fn the_valid_files_are_valid() {
    assert!(vol::parse::<f32>(&vol_file()).is_ok());
    assert!(npy::parse::<f32>(&npy_file(), ZYX).is_ok());
    assert!(mesh::serialized::parse(SERIALIZED, 0, Limits::default()).is_ok());
    assert!(ies::parse(IES).is_ok());
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        assert!(
            mesh::ply::parse(&ply_file(format), Limits::default()).is_ok(),
            "{format}"
        );
    }
}

proptest! {
    #![proptest_config(common::inputs())]

    #[test]
    fn xml_of_arbitrary_text(text in ".*") {
        exercise(&text);
        exercise(&format!("<scene version='3.0.0'>{text}</scene>"));
    }

    #[test]
    fn xml_of_pieces(text in pieces()) {
        exercise(&text);
        exercise(&format!("<scene version='3.0.0'>{text}</scene>"));
        exercise(&format!("<scene version='3.0.0'><shape type='a'>{text}</shape></scene>"));
    }

    #[test]
    fn vol_of_arbitrary_bytes(bytes in after(vec![vec![], vol_file()[..8].to_vec()])) {
        let _ = vol::parse::<f32>(&bytes);
    }

    #[test]
    fn vol_of_damaged_files(bytes in damaged(vol_file())) {
        let _ = vol::parse::<f32>(&bytes);
    }

    #[test]
    fn npy_of_arbitrary_bytes(bytes in after(vec![vec![], npy_file()[..12].to_vec()])) {
        read_npy(&bytes);
    }

    #[test]
    fn npy_of_damaged_files(bytes in damaged(npy_file())) {
        read_npy(&bytes);
    }

    #[test]
    fn obj_of_arbitrary_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = mesh::obj::parse(&bytes, Limits::default());
    }

    #[test]
    fn curves_of_arbitrary_numbers(rows in prop::collection::vec((any::<f32>(), -3i32..3, any::<bool>()), 0..20)) {
        let line = |(x, y, breaks): &(f32, i32, bool)| format!("{x} {y} 1 {y}\n{}", if *breaks { "\n" } else { "" });
        let text: String = rows.iter().map(line).collect();
        if let Ok(curves) = mesh::curves::parse(text.as_bytes(), Limits::default()) {
            let _ = mesh::curves::lines(&curves);
            let _ = mesh::curves::splines(&curves);
        }
    }

    #[test]
    fn hair_of_arbitrary_bytes(bytes in after(vec![vec![], b"BINARY_HAIR".to_vec(), b"BINARY_HAIR\x09\0\0\0".to_vec()])) {
        if let Ok(strands) = mesh::hair::parse(&bytes, Limits::default()) {
            let _ = mesh::curves::lines(&mesh::hair::with_radius(strands, 0.1));
        }
    }

    #[test]
    fn hair_of_arbitrary_numbers(rows in prop::collection::vec((any::<f32>(), -3i32..3, any::<bool>()), 0..20)) {
        let line = |(x, y, breaks): &(f32, i32, bool)| format!("{x} {y} 1\n{}", if *breaks { "\n" } else { "" });
        let text: String = rows.iter().map(line).collect();
        if let Ok(strands) = mesh::hair::parse(text.as_bytes(), Limits::default()) {
            let _ = mesh::curves::lines(&mesh::hair::with_radius(strands, 0.1));
        }
    }

    #[test]
    fn obj_of_pieces(text in obj_pieces()) {
        let _ = mesh::obj::parse(text.as_bytes(), Limits::default());
    }

    #[test]
    fn ply_of_arbitrary_bytes(bytes in after(vec![vec![], b"ply\nformat ascii 1.0\n".to_vec()])) {
        let _ = mesh::ply::parse(&bytes, Limits::default());
    }

    #[test]
    fn ply_of_damaged_ascii(bytes in damaged(ply_file("ascii"))) {
        let _ = mesh::ply::parse(&bytes, Limits::default());
    }

    #[test]
    fn ply_of_damaged_binary(bytes in damaged(ply_file("binary_little_endian"))) {
        let _ = mesh::ply::parse(&bytes, Limits::default());
    }

    #[test]
    fn serialized_of_arbitrary_bytes(bytes in after(vec![vec![], SERIALIZED[..20].to_vec()]), i in 0..3usize) {
        let _ = mesh::serialized::parse(&bytes, i, Limits::default());
    }

    #[test]
    fn serialized_of_damaged_files(bytes in damaged(SERIALIZED.to_vec()), i in 0..2usize) {
        let _ = mesh::serialized::parse(&bytes, i, Limits::default());
    }

    #[test]
    fn ies_of_arbitrary_bytes(bytes in after(vec![vec![], b"TILT=NONE\n".to_vec(), IES[..70].to_vec()])) {
        let _ = ies::parse(&bytes);
    }

    #[test]
    fn ies_of_damaged_files(bytes in damaged(IES.to_vec())) {
        let _ = ies::parse(&bytes);
    }

    #[test]
    fn vti_of_arbitrary_bytes(bytes in after(vec![vec![], made("ascii.vti")[..300].to_vec()])) {
        let _ = vti::parse::<f32>(&bytes, Options::default());
    }

    #[test]
    fn vti_of_damaged_files(
        raw in damaged(made("appended_raw_zlib.vti")),
        base64 in damaged(made("inline_zlib.vti")),
        ascii in damaged(made("ascii.vti")),
        plain in damaged(made("appended_base64.vti")),
    ) {
        for bytes in [raw, base64, ascii, plain] {
            let _ = vti::parse::<f32>(&bytes, Options::default());
        }
    }

    #[test]
    fn hdf5_of_damaged_files(bytes in damaged(made("kwave.h5"))) {
        read_hdf5(&bytes);
    }

    #[test]
    fn series_of_damaged_files(bytes in damaged(made("sound.h5"))) {
        read_hdf5(&bytes);
    }

    #[test]
    fn masks_of_damaged_files(bytes in damaged(made("kwave_box.h5"))) {
        read_hdf5(&bytes);
    }

    #[test]
    fn cuboids_of_damaged_files(bytes in damaged(made("kwave_cuboids.h5"))) {
        read_hdf5(&bytes);
    }

    #[test]
    fn hdf5_of_arbitrary_bytes(bytes in after(vec![vec![], made("kwave.h5")[..96].to_vec()])) {
        read_hdf5(&bytes);
    }

    #[test]
    fn npz_of_damaged_files(
        stored in damaged(made("stored.npz")),
        compressed in damaged(made("compressed.npz")),
    ) {
        let _ = npz::parse::<f32>(&stored, ZYX.of("density"));
        let _ = npz::parse::<f32>(&compressed, ZYX);
    }

    #[test]
    fn npz_of_arbitrary_bytes(bytes in after(vec![vec![], made("stored.npz")[..40].to_vec()])) {
        let _ = npz::parse::<f32>(&bytes, ZYX);
    }

    #[test]
    fn nrrd_of_damaged_files(
        raw in damaged(made("raw.nrrd")),
        gzip in damaged(made("gzip.nrrd")),
        ascii in damaged(made("ascii.nrrd")),
        spacings in damaged(made("spacings.nrrd")),
    ) {
        for bytes in [raw, gzip, ascii] {
            let _ = nrrd::parse::<f32>(&bytes, Options::default());
        }
        let _ = nrrd::parse::<f32>(&spacings, ZYX);
    }

    #[test]
    fn nrrd_of_pieces(text in nrrd_pieces()) {
        let _ = nrrd::parse::<f32>(text.as_bytes(), Options::default());
        let _ = nrrd::parse::<f32>(text.as_bytes(), ZYX);
    }

    #[test]
    fn mat_of_damaged_files(
        plain in damaged(made("plain.mat")),
        compressed in damaged(made("compressed.mat")),
    ) {
        let _ = mat::parse::<f32>(&plain, ZYX.of("density"));
        let _ = mat::parse::<f32>(&compressed, ZYX);
    }

    #[test]
    fn mat_of_arbitrary_bytes(bytes in after(vec![vec![], made("plain.mat")[..128].to_vec()])) {
        let _ = mat::parse::<f32>(&bytes, ZYX);
    }

    #[test]
    fn vtk_of_damaged_files(
        ascii in damaged(made("ascii.vtk")),
        cells in damaged(made("cells.vtk")),
        three in damaged(made("three.vtk")),
    ) {
        for bytes in [ascii, cells, three] {
            let _ = vtk::parse::<f32>(&bytes, Options::default());
            let _ = vtk::parse::<f32>(&bytes, Options::default().of("density"));
        }
    }

    #[test]
    fn vtk_of_pieces(text in vtk_pieces()) {
        let _ = vtk::parse::<f32>(format!("# vtk DataFile Version 3\n\n{text}").as_bytes(), Options::default());
    }

    #[test]
    fn vdb_of_damaged_files(
        single in damaged(made("single.vdb")),
        head in prop::collection::vec((0..2048usize, any::<u8>()), 0..4),
        trees in damaged(made("trees.vdb")),
    ) {
        let _ = vdb::parse::<f32>(&single, Options::default());
        let _ = vdb::parse::<f32>(&trees, Options::default().of("waves"));
        let mut bytes = made("single.vdb");
        head.into_iter().for_each(|(at, byte)| bytes[at] = byte);
        let _ = vdb::parse::<f32>(&bytes, Options::default());
    }

    #[test]
    fn nifti_of_damaged_files(
        plain in damaged(made("labels.nii")),
        compressed in damaged(made("labels.nii.gz")),
        second in damaged(made("second.nii")),
    ) {
        for bytes in [plain, compressed, second] {
            let _ = nifti::parse::<f32>(&bytes, Options::default());
        }
    }

    #[test]
    fn jnifti_of_damaged_files(
        text in damaged(made("zlib.jnii")),
        binary in damaged(made("zlib.bnii")),
        arrays in damaged(made("arrays.jdb")),
        bytes in after(vec![vec![], b"{U\x01a".to_vec(), b"{U\x09NIFTIData[".to_vec()]),
    ) {
        for bytes in [text, binary, arrays, bytes] {
            let _ = jnifti::parse::<f32>(&bytes, Options::default());
        }
    }

    #[test]
    fn vdb_of_arbitrary_bytes(bytes in after(vec![vec![], made("single.vdb")[..0x28c].to_vec()])) {
        let _ = vdb::parse::<f32>(&bytes, Options::default());
    }
}
