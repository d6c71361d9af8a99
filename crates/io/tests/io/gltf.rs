//! Meshes from glTF files written by trimesh (`data/meshes/make_gltf.py`).

use crate::common;
use glam::DVec3;
use morgana_io::Limits;
use morgana_io::mesh::{MeshData, gltf};
use morgana_io::{FileError, Problem};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

const TEXT: &str = include_str!("../data/meshes/two_boxes.gltf");
const BINARY: &[u8] = include_bytes!("../data/meshes/two_boxes.glb");
const BUFFER: &[u8] = include_bytes!("../data/meshes/two_boxes.bin");

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/meshes")
        .join(name)
}

fn parse(text: &str) -> Result<MeshData, Problem> {
    gltf::parse(text.as_bytes(), |_| Ok(BUFFER.to_vec()), Limits::default())
}

/// Six times the volume of a closed mesh, positive if it is wound counter-clockwise seen from
/// outside.
fn volume(mesh: &MeshData) -> f64 {
    let x = |i: u32| mesh.positions[i as usize];
    let each = |[a, b, c]: &[u32; 3]| x(*a).dot(x(*b).cross(x(*c)));
    mesh.triangles.iter().map(each).sum::<f64>() / 6.0
}

#[test]
fn nodes_are_put_in_their_places() {
    let mesh = MeshData::read(&path("two_boxes.glb")).unwrap();
    assert_eq!(mesh.positions.len(), 16);
    assert_eq!(mesh.triangles.len(), 24);
    assert_eq!(mesh.uvs, None);
    // The second mesh is the first one mirrored, half as large, and moved; both are wound as seen
    // from outside.
    let (first, second) = mesh.positions.split_at(8);
    let half = DVec3::new(-0.5, 0.5, 0.5);
    for (a, b) in first.iter().zip(second) {
        assert!((*a * half + DVec3::X * 5.0 - *b).length() < 1e-7, "{a} {b}");
        assert_eq!(a.abs(), DVec3::new(0.5, 1.0, 1.5));
    }
    assert!((volume(&mesh) - (6.0 + 6.0 / 8.0)).abs() < 1e-6);
    let colours = mesh.colours.unwrap();
    let red = [1.0, 0.0, 0.2];
    let blue = [0.0, 0.4, 1.0];
    assert_eq!(colours, [[red; 4], [blue; 4], [red; 4], [blue; 4]].concat());
}

#[test]
fn text_is_the_same_with_buffers_in_a_file_or_embedded() {
    let binary = MeshData::read(&path("two_boxes.glb")).unwrap();
    assert_eq!(MeshData::read(&path("two_boxes.gltf")).unwrap(), binary);
    assert_eq!(
        gltf::data_files(&path("two_boxes.gltf"), Limits::default()),
        ["two_boxes.bin"]
    );
    assert!(gltf::data_files(&path("two_boxes.glb"), Limits::default()).is_empty());
    use base64::Engine;
    let data = base64::prelude::BASE64_STANDARD.encode(BUFFER);
    let embedded = format!("data:application/octet-stream;base64,{data}");
    let text = TEXT.replace("two_boxes.bin", &embedded);
    let found = gltf::parse(
        text.as_bytes(),
        |name| panic!("asks for {name}"),
        Limits::default(),
    );
    assert_eq!(found.unwrap(), binary);
}

/// Three triangles; only the middle one has texture coordinates and a normal.
fn three_parts() -> (String, Vec<u8>) {
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let normals = [0.0, 0.0, 1.0].repeat(3);
    let uvs = [0.5, 0.25, 1.0, 0.0, 0.0, 1.0];
    let numbers = [&corners[..], &normals, &uvs].concat();
    let bytes = numbers.iter().flat_map(|v: &f32| v.to_le_bytes()).collect();
    let bare = r#"{ "attributes": { "POSITION": 0 } }"#;
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
            "meshes": [{{ "primitives": [{bare},
                {{ "attributes": {{ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }} }}, {bare}] }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }},
                {{ "bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC3" }},
                {{ "bufferView": 0, "byteOffset": 72, "componentType": 5126, "count": 3, "type": "VEC2" }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 96 }}],
            "buffers": [{{ "uri": "parts.bin", "byteLength": 96 }}] }}"#
    );
    (text, bytes)
}

#[test]
fn parts_without_texture_coordinates_and_normals_leave_those_of_others() {
    let (text, bytes) = three_parts();
    let mesh = gltf::parse(text.as_bytes(), |_| Ok(bytes.clone()), Limits::default()).unwrap();
    let given = [[0.5, 0.25], [1.0, 0.0], [0.0, 1.0]];
    let uvs = [[[0.0; 2]; 3], given, [[0.0; 2]; 3]].concat();
    assert_eq!(mesh.uvs, Some(uvs));
    let normals = [[DVec3::ZERO; 3], [DVec3::Z; 3], [DVec3::ZERO; 3]].concat();
    assert_eq!(mesh.normals, Some(normals));
    let bare = text.replace(r#""NORMAL": 1, "TEXCOORD_0": 2"#, r#""extras": 0"#);
    let mesh = gltf::parse(bare.as_bytes(), |_| Ok(bytes.clone()), Limits::default()).unwrap();
    assert_eq!((mesh.uvs, mesh.normals), (None, None));
}

#[test]
fn files_that_are_refused() {
    let refused = |text: String, expected: &str| {
        let problem = parse(&text).unwrap_err().to_string();
        assert!(problem.contains(expected), "{problem}");
    };
    refused("{".into(), "not a glTF 2.0 file");
    refused(
        TEXT.replace("\"scenes\"", "\"extras\""),
        "there is no number 0 among its 'scenes'",
    );
    refused(
        TEXT.replacen("\"accessors\"", "\"extras\"", 1),
        "there is no number 1 among its 'accessors'",
    );
    refused(
        TEXT.replacen("\"2.0\"", "\"1.0\"", 1),
        "the file is of version '1.0'",
    );
    refused(
        TEXT.replacen("\"version\": \"2.0\"", "\"extras\": 0", 1),
        "it does not state its version (asset.version)",
    );
    refused(
        TEXT.replacen(
            '{',
            "{ \"extensionsRequired\": [\"KHR_draco_mesh_compression\"],",
            1,
        ),
        "not supported: the glTF extension 'KHR_draco_mesh_compression'",
    );
    let elsewhere = TEXT.replace("\"bufferView\"", "\"extras\"");
    refused(
        elsewhere.replacen('{', "{ \"extensionsUsed\": [\"A_b\"],", 1),
        "not in a buffer; morgana does not support numbers of extensions (A_b)",
    );
    refused(
        TEXT.replace("\"count\": 36", "\"count\": 3600"),
        "beyond the end of their buffer",
    );
    refused(
        TEXT.replace("\"type\": \"VEC3\"", "\"type\": \"VEC2\""),
        "2 components in place of 3",
    );
    let fewer = TEXT.replace("\"count\": 8", "\"count\": 4");
    refused(fewer, "a triangle of vertex 4, of 4");
    refused(
        TEXT.replace("\"mode\": 4", "\"mode\": 0"),
        "the mesh has no faces",
    );
    let cycle = TEXT.replacen(
        "\"name\": \"first\",",
        "\"name\": \"first\", \"children\": [0],",
        1,
    );
    refused(cycle, "a node is its own descendant");
    let short = gltf::parse(TEXT.as_bytes(), |_| Ok(vec![0; 10]), Limits::default()).unwrap_err();
    assert!(short.to_string().contains("272"), "{short}");
    let folder = tempfile::tempdir().unwrap();
    let alone = folder.path().join("alone.gltf");
    std::fs::write(&alone, TEXT).unwrap();
    let missing: FileError = gltf::read(&alone, Limits::default()).unwrap_err();
    let expected = "alone.gltf: its buffer 'two_boxes.bin': cannot read: No such file";
    assert!(missing.to_string().contains(expected), "{missing}");
    let missing: FileError = gltf::read(&path("nowhere.gltf"), Limits::default()).unwrap_err();
    assert!(missing.to_string().contains("nowhere.gltf"), "{missing}");
}

proptest! {
    #![proptest_config(common::inputs())]

    /// Reading a damaged file always ends, with a mesh or an error.
    #[test]
    fn damaged_files_do_no_harm(at in 0..BINARY.len(), byte: u8, end in 0..BINARY.len()) {
        let mut bytes = BINARY.to_vec();
        bytes[at] = byte;
        let _ = gltf::parse(&bytes, |_| Ok(Vec::new()), Limits::default());
        let _ = gltf::parse(&bytes[..end], |_| Ok(Vec::new()), Limits::default());
    }

    #[test]
    fn numbers_in_texts_do_no_harm(place in 0..40_usize, number in prop_oneof![0..40_u64, any::<u64>()]) {
        let digits = |c: char| c.is_ascii_digit();
        let mut seen = 0;
        let words = TEXT.split_inclusive(|c: char| !digits(c)).map(|word| {
            let figures: String = word.chars().filter(|c| digits(*c)).collect();
            seen += usize::from(!figures.is_empty());
            if !figures.is_empty() && seen == place {
word.replace(&figures, &number.to_string())
} else {
word.to_owned()
}
        });
        let _ = parse(&words.collect::<String>());
    }

    #[test]
    fn buffers_of_any_content_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = gltf::parse(TEXT.as_bytes(), |_| Ok(bytes.clone()), Limits::default());
    }
}
