//! Meshes: accepted and refused files.

use glam::DVec3;
use morgana_io::Limits;
use morgana_io::mesh::{MeshData, hair, obj, ply, serialized};
use std::path::{Path, PathBuf};

#[track_caller]
fn obj_error(text: &str, line: Option<usize>, expected: &str) {
    let (problem, found) = obj::parse(text.as_bytes(), Limits::default()).unwrap_err();
    assert_eq!((problem.to_string().as_str(), found), (expected, line));
}

#[test]
fn an_obj_file_with_everything() {
    let text = "# a quad and a triangle\r\nmtllib no.mtl\no thing\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\n\
        v 1 1 0 1.0\nv 0 1 0\nvt 0 0\nvt 1 0.5\nvt 0.25\nvn 0 0 1\ng part\nusemtl m\ns off\n\
        f 1/1/1 2/2/1 3/3/1 \\\n 4/1/1\nf -4/1 -3/2 -1/3\nl 1 2\n";
    let mesh = obj::parse(text.as_bytes(), Limits::default()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
    let corner = |(x, y)| DVec3::new(x, y, 0.0);
    // The last face has its own corners, without normals.
    let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(corner);
    let again = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(corner);
    assert_eq!(mesh.positions, [&square[..], &again[..]].concat());
    let [a, b, c] = [[0.0, 0.0], [1.0, 0.5], [0.25, 0.0]];
    assert_eq!(mesh.uvs, Some(vec![a, b, c, a, a, b, c]));
    let normals = [[DVec3::Z; 4].as_slice(), &[DVec3::ZERO; 3]].concat();
    assert_eq!(mesh.normals, Some(normals));
}

#[test]
fn an_obj_file_without_texture_coordinates() {
    let mesh = obj::parse(
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1",
        Limits::default(),
    )
    .unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.uvs, None);
    assert_eq!(mesh.normals, Some(vec![DVec3::Z; 3]));
}

#[test]
fn faces_of_an_obj_file_without_texture_coordinates_leave_those_of_others() {
    let text =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0.5 0.25\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf 2 4 3\n";
    let mesh = obj::parse(text.as_bytes(), Limits::default()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    let given = [[0.5, 0.25], [1.0, 0.0], [0.0, 1.0]];
    assert_eq!(mesh.uvs, Some([given, [[0.0; 2]; 3]].concat()));
    assert_eq!(mesh.without_uvs, [3, 4, 5]);
}

#[test]
fn faces_of_an_obj_file_with_two_corners_are_left_out() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\nf 3\nf\n";
    let mesh = obj::parse(text.as_bytes(), Limits::default()).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.skipped_faces), (1, 3));
}

#[test]
fn obj_files_that_are_refused() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let face = |face: &str| format!("{vertices}{face}");
    obj_error("", None, "empty: the mesh has no faces");
    obj_error(vertices, None, "empty: the mesh has no faces");
    obj_error("v 0 0 x", Some(1), "'x' is not a number");
    obj_error("\nv 0 0", Some(2), "expected 3 numbers, found 2");
    obj_error(
        "v 0 0 0\nv 0 nan 0",
        Some(2),
        "value NaN at vertex 2 is not finite",
    );
    obj_error(&face("f 1 2"), None, "empty: the mesh has no faces");
    obj_error(&face("f 1 2 a"), Some(4), "'a' is not an index");
    obj_error(
        &face("f 1 2 4"),
        Some(4),
        "vertex 4 does not exist (there are 3)",
    );
    obj_error(
        &face("f 1 2 0"),
        Some(4),
        "vertex 0 does not exist (there are 3)",
    );
    obj_error(
        &face("f 1 2 -4"),
        Some(4),
        "vertex -4 does not exist (there are 3)",
    );
    let least = i64::MIN;
    let message = format!("vertex {least} does not exist (there are 3)");
    obj_error(&face(&format!("f 1 2 {least}")), Some(4), &message);
    obj_error(
        &face("f 1/1 2/1 3/1"),
        Some(4),
        "texture coordinate 1 does not exist (there are 0)",
    );
}

const ASCII: &str = "ply\nformat ascii 1.0\ncomment hello\nelement vertex 4\nproperty float x\n\
    property float y\nproperty double z\nproperty float u\nproperty float v\n\
    element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\n\
    element edge 1\nproperty int a\nend_header\n\
    0 0 0 0 0\n1 0 0 1 0\n1 1 0.5 1 1\n0 1 0 0 1\n7 4 0 1 2 3\n7 3 0 1 2\n5\n";

/// The mesh of `ASCII`, in binary.
fn binary(big: bool) -> Vec<u8> {
    let kind = if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let end = ASCII.find("end_header\n").unwrap() + "end_header\n".len();
    let mut bytes = ASCII[..end].replace("ascii", kind).into_bytes();
    let f32_bytes = |v: f32| {
        if big {
            v.to_be_bytes()
        } else {
            v.to_le_bytes()
        }
    };
    let f64_bytes = |v: f64| {
        if big {
            v.to_be_bytes()
        } else {
            v.to_le_bytes()
        }
    };
    let i32_bytes = |v: i32| {
        if big {
            v.to_be_bytes()
        } else {
            v.to_le_bytes()
        }
    };
    for (x, y, z) in [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (1.0, 1.0, 0.5),
        (0.0, 1.0, 0.0),
    ] {
        bytes.extend([x, y].into_iter().flat_map(f32_bytes));
        bytes.extend(f64_bytes(z));
        bytes.extend([x, y].into_iter().flat_map(f32_bytes));
    }
    for face in [&[0, 1, 2, 3][..], &[0, 1, 2]] {
        bytes.extend([7, face.len() as u8]);
        bytes.extend(face.iter().flat_map(|v| i32_bytes(*v)));
    }
    bytes.extend(i32_bytes(5));
    bytes
}

#[test]
fn ply_files_of_every_encoding() {
    let mesh = ply::parse(ASCII.as_bytes(), Limits::default()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.0, 0.5));
    assert_eq!(mesh.uvs.as_ref().unwrap()[3], [0.0, 1.0]);
    assert_eq!(ply::parse(&binary(false), Limits::default()).unwrap(), mesh);
    assert_eq!(ply::parse(&binary(true), Limits::default()).unwrap(), mesh);
}

#[test]
fn ply_files_name_texture_coordinates_in_three_ways() {
    let mesh = ply::parse(ASCII.as_bytes(), Limits::default()).unwrap();
    for [u, v] in [["s", "t"], ["texture_u", "texture_v"]] {
        let text = ASCII
            .replace("float u\n", &format!("float {u}\n"))
            .replace("float v\n", &format!("float {v}\n"));
        assert_ne!(text, ASCII);
        assert_eq!(
            ply::parse(text.as_bytes(), Limits::default()).unwrap(),
            mesh
        );
    }
}

#[test]
fn attributes_of_ply_files_follow_texture_coordinates_of_any_name() {
    for [u, v] in [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]] {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property float {u}\nproperty float {v}\nproperty float weight_0\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n\
             0 0 0 0 0 0.25\n1 0 0 1 0 0.5\n0 1 0 0 1 0.75\n3 0 1 2\n"
        );
        let mesh = ply::parse(text.as_bytes(), Limits::default()).unwrap();
        let weights: Vec<f32> = mesh.attributes[0].values.iter().map(|v| v[0]).collect();
        assert_eq!(weights, [0.25, 0.5, 0.75], "{u}");
    }
}

/// Two triangles with a common side, along which the second has other texture coordinates.
const WEDGES: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property float weight_0\nproperty float r\nproperty float g\nproperty float b\n\
    element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty float id_0\n\
    end_header\n0 0 0 0.25 1 0 0\n1 0 0 0.5 0 1 0\n0 1 0 0.75 0 0 1\n1 1 0 1 1 1 1\n\
    3 0 1 2 6 0 0 0.5 0 0 0.5 7\n3 1 3 2 6 0.5 0 1 1 0 1 8\n";

#[test]
fn corners_of_ply_files_have_texture_coordinates() {
    let mesh = ply::parse(WEDGES.as_bytes(), Limits::default()).unwrap();
    // Vertex 1 has equal coordinates in both faces; vertex 2 is split.
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 4]]);
    assert_eq!(mesh.originals, Some(vec![0, 1, 2, 3, 2]));
    assert_eq!(mesh.positions[4], mesh.positions[2]);
    assert_eq!(mesh.positions.len(), 5);
    let uvs = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [1.0, 1.0], [0.0, 1.0]];
    assert_eq!(mesh.uvs, Some(uvs.to_vec()));
    assert_eq!(mesh.colours.unwrap()[4], [0.0, 0.0, 1.0]);
    let values = |name: &str| {
        let attribute = mesh.attributes.iter().find(|a| a.name == name).unwrap();
        let values = attribute.values.iter().map(|v| v[0]);
        values.collect::<Vec<f32>>()
    };
    assert_eq!(values("vertex_weight"), [0.25, 0.5, 0.75, 1.0, 0.75]);
    assert_eq!(values("face_id"), [7.0, 8.0]);
}

#[test]
fn faces_of_a_ply_file_with_two_corners_are_left_out() {
    let faces = "face 5\n";
    let text = WEDGES.replace("face 2\n", faces) + "2 0 3 4 9 9 9 9 9\n1 0 0 9\n0 0 9\n";
    let mesh = ply::parse(text.as_bytes(), Limits::default()).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.skipped_faces), (2, 3));
    let whole = ply::parse(WEDGES.as_bytes(), Limits::default()).unwrap();
    assert_eq!((mesh.uvs, mesh.attributes), (whole.uvs, whole.attributes));
    ply_error("face 2", "face 0", "empty: the mesh has no faces");
}

#[test]
fn faces_of_ply_files_may_lack_texture_coordinates() {
    let text = WEDGES.replace("3 0 1 2 6 0 0 0.5 0 0 0.5 7", "3 0 1 2 0 7");
    let mesh = ply::parse(text.as_bytes(), Limits::default()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [4, 3, 5]]);
    assert_eq!(mesh.uvs.unwrap()[..3], [[0.0; 2]; 3]);
    assert_eq!(mesh.without_uvs, [0, 1, 2]);
    let text = WEDGES.replace("6 0 0 0.5 0 0 0.5 7", "6 1e99 0 1e99 1 1e99 2 7");
    assert_eq!(
        ply::parse(text.as_bytes(), Limits::default())
            .unwrap()
            .without_uvs,
        [0, 1, 2]
    );
    let text = text.replace("6 0.5 0 1 1 0 1 8", "0 8");
    assert_eq!(
        ply::parse(text.as_bytes(), Limits::default()).unwrap().uvs,
        None
    );
    let text = WEDGES.replace("6 0 0 0.5 0 0 0.5 7", "4 0 0 0.5 0 7");
    let (problem, _) = ply::parse(text.as_bytes(), Limits::default()).unwrap_err();
    let expected = "face 0 has 4 numbers 'texcoord', not two for each of its 3 vertices";
    assert_eq!(problem.to_string(), expected);
}

#[track_caller]
fn ply_error(from: &str, to: &str, expected: &str) {
    assert!(ASCII.contains(from));
    let (problem, line) =
        ply::parse(ASCII.replacen(from, to, 1).as_bytes(), Limits::default()).unwrap_err();
    let line = line.map_or(String::new(), |line| format!("{line}: "));
    assert_eq!(format!("{line}{problem}"), expected);
}

#[test]
fn ply_files_that_are_refused() {
    ply_error(
        "ply\n",
        "plx\n",
        "1: not a PLY file: Expected magic number 'ply'",
    );
    ply_error(
        "end_header\n",
        "end\n",
        "15: not a PLY file: Couldn't parse line",
    );
    ply_error(
        "format ascii 1.0\n",
        "",
        "not a PLY file: No format line found",
    );
    ply_error("float x", "float a", "there is no property 'x' of 'vertex'");
    ply_error(
        "vertex_indices",
        "indices",
        "there is no property 'vertex_indices' of 'face'",
    );
    ply_error(
        "edge 1",
        "edge 9999999999",
        "too large: 9999999999 elements 'edge' in 329 bytes",
    );
    ply_error("property int a\n", "", "element 'edge' has no properties");
    ply_error(
        "1 1 0.5 1 1",
        "1 one 0.5 1 1",
        "18: not a PLY file: Couldn't read element line",
    );
    ply_error(
        "4 0 1 2 3",
        "4 0 1 2 9",
        "face 0 has the vertex 9 (there are 4)",
    );
    ply_error(
        "3 0 1 2",
        "3 0 1 -2",
        "face 1 has an index that is not a whole number or negative",
    );
    ply_error(
        "1 1 0.5 1 1",
        "1e99 1 0.5 1 1",
        "value inf at vertex 2 is not finite",
    );
    let cut = &binary(false)[..binary(false).len() - 30];
    let (problem, _) = ply::parse(cut, Limits::default()).unwrap_err();
    let expected = "the file ends early, within the 2 elements 'face'";
    assert!(problem.to_string().starts_with(expected), "{problem}");
}

#[test]
fn files_are_read_by_extension_and_named_in_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.PLY");
    std::fs::write(&path, ASCII).unwrap();
    assert!(MeshData::read(&path).is_ok());
    let path = folder.path().join("a.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0").unwrap();
    let error = MeshData::read(&path).unwrap_err().to_string();
    assert_eq!(
        error,
        format!("{}:2: expected 3 numbers, found 2", path.display())
    );
    let error = MeshData::read("no.obj".as_ref()).unwrap_err().to_string();
    assert!(
        error.starts_with("no.obj: cannot read: No such file"),
        "{error}"
    );
    let error = MeshData::read("a.stl".as_ref()).unwrap_err().to_string();
    assert_eq!(
        error,
        "a.stl: not supported: meshes are read from .obj, .ply, .gltf and .glb"
    );
}

fn serialized_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/meshes")
        .join(name)
}

/// Mitsuba 3.9.1 reads these files identically, except for colours.
#[test]
fn serialized_meshes() {
    let corners = [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (0.0, 2.0, 0.0),
        (1.0, 2.0, 0.5),
    ];
    let corners = corners.map(|(x, y, z)| DVec3::new(x, y, z));
    let uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    for name in ["meshes3.serialized", "meshes4.serialized"] {
        let path = serialized_file(name);
        let first = serialized::read(&path, 0, Limits::default()).unwrap();
        assert_eq!(first.positions, corners[..3]);
        assert_eq!(first.triangles, [[0, 1, 2]]);
        assert_eq!((first.uvs, first.colours), (Some(uvs[..3].to_vec()), None));
        let second = serialized::read(&path, 1, Limits::default()).unwrap();
        assert_eq!(second.positions, corners);
        assert_eq!(second.triangles, [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(second.uvs, Some(uvs.to_vec()));
        assert_eq!(second.colours.unwrap()[3], [0.5; 3]);
        let none = serialized::read(&path, 2, Limits::default())
            .unwrap_err()
            .to_string();
        assert!(
            none.ends_with("there is no mesh 2: the file has 2, from 0 on"),
            "{none}"
        );
    }
}

#[test]
fn serialized_files_that_are_refused() {
    let bytes = std::fs::read(serialized_file("meshes4.serialized")).unwrap();
    let error = |bytes: &[u8]| {
        serialized::parse(bytes, 0, Limits::default())
            .unwrap_err()
            .to_string()
    };
    assert_eq!(error(b""), "not a serialized mesh file: too short");
    assert_eq!(
        error(b"PLY file"),
        "not a serialized mesh file: it does not begin with 1c 04"
    );
    assert_eq!(
        error(&[0x1c, 4, 2, 0, 1, 0, 0, 0]),
        "not supported: version 2"
    );
    assert_eq!(
        error(&[0x1c, 4, 4, 0, 1, 0, 0, 0]),
        "not a serialized mesh file: its table of meshes is cut off"
    );
    for cut in 4..bytes.len() {
        // The file ends with the table, which always lacks something here.
        assert!(
            serialized::parse(&bytes[..cut], 0, Limits::default()).is_err(),
            "{cut}"
        );
        let mut damaged = bytes.clone();
        damaged[cut] ^= 0x55;
        // The result may be anything, but reading must not panic.
        let _ = serialized::parse(&damaged, 1, Limits::default());
    }
}

#[test]
fn colours_in_mesh_files() {
    let text = "v 0 0 0 0.25 0.5 1\nv 1 0 0 1 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n";
    let mesh = obj::parse(text.as_bytes(), Limits::default()).unwrap();
    let expected = vec![[0.25, 0.5, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]];
    assert_eq!(mesh.colours, Some(expected));
    // Colours of only some vertices are dropped.
    let mesh = obj::parse(
        b"v 0 0 0 0.25 0.5 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        Limits::default(),
    )
    .unwrap();
    assert_eq!(mesh.colours, None);
    obj_error("v 0 0 0 0.5 red 1", Some(1), "'red' is not a number");
}

/// Names are grouped as in Mitsuba 3: adjacent names with one prefix and one of four schemes, one
/// channel or three.
#[test]
fn attributes_of_ply_files() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float heat_0\nproperty double flow_x\nproperty float flow_y\nproperty float flow_z\n\
        property float lone\nproperty float two_1\nproperty float two_2\nproperty uchar tint_r\nproperty uchar tint_g\n\
        property uchar tint_b\nelement face 2\nproperty list uchar int marks\nproperty int weight_1\n\
        property list uchar int vertex_indices\nend_header\n\
        0 0 0 0.5 1 2 3 9 8 8 10 20 30\n1 0 0 1.5 4 5 6 9 8 8 0 0 0\n1 1 0 2.5 7 8 9 9 8 8 0 0 0\n\
        0 1 0 3.5 0 0 0 9 8 8 0 0 0\n2 5 6 -7 4 0 1 2 3\n0 11 3 0 1 2\n";
    let mesh = ply::parse(text.as_bytes(), Limits::default()).unwrap();
    let names: Vec<&str> = mesh.attributes.iter().map(|a| a.name.as_str()).collect();
    let expected = [
        "vertex_heat",
        "vertex_flow",
        "vertex_tint_color",
        "face_weight",
    ];
    assert_eq!(names, expected);
    let values = |k: usize| &mesh.attributes[k].values;
    assert_eq!(values(0)[3], [3.5; 3]);
    assert_eq!(values(1)[..2], [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    assert_eq!(values(2)[0], [10.0, 20.0, 30.0]);
    // The first face is two triangles.
    assert_eq!(values(3)[..], [[-7.0; 3], [-7.0; 3], [11.0; 3]]);
    let numbers: Vec<bool> = mesh.attributes.iter().map(|a| a.is_number).collect();
    assert_eq!(numbers, [true, false, false, true]);
}

/// Equal strands in both formats of Mitsuba 0.6.
#[test]
fn hair_as_text_and_in_binary() {
    let parse = |bytes: &[u8]| hair::parse(bytes, Limits::default());
    let text = "\n0 0 0\n0 1 0\n0 1 0\n0.5 2 0\n\n\n7 7 7\n \n1 0 0 more\n1 0 -4\n";
    let strands = parse(text.as_bytes()).unwrap();
    let [a, b] = [[0.0, 1.0, 0.0], [0.5, 2.0, 0.0]].map(DVec3::from_array);
    let second = vec![DVec3::X, DVec3::new(1.0, 0.0, -4.0)];
    assert_eq!(strands, [vec![DVec3::ZERO, a, b], second]);
    let points = [
        [f32::INFINITY, 0.0, 0.0, 0.0],
        [f32::NAN, 0.0, 1.0, 0.0],
        [f32::NAN, 0.0, 1.0, 0.0],
        [f32::NAN, 0.5, 2.0, 0.0],
        [f32::INFINITY, 7.0, 7.0, 7.0],
        [f32::INFINITY, 1.0, 0.0, 0.0],
        [f32::NAN, 1.0, 0.0, -4.0],
    ];
    let numbers = points.iter().flatten().filter(|v| !v.is_nan());
    let mut bytes = b"BINARY_HAIR".to_vec();
    bytes.extend((points.len() as u32).to_le_bytes());
    bytes.extend(numbers.flat_map(|v| v.to_le_bytes()));
    assert_eq!(parse(&bytes).unwrap(), strands);
    for cut in 11..bytes.len() {
        assert!(parse(&bytes[..cut]).is_err(), "{cut}");
    }
    for (text, line, expected) in [
        ("", None, "no strand of two points"),
        ("1 2 3\n\n4 5 6\n", None, "no strand of two points"),
        ("1 2 3\n1 2\n", Some(2), "expected x, y and z"),
        ("1 2 inf\n", Some(1), "a point is not finite"),
    ] {
        let (problem, at) = parse(text.as_bytes()).unwrap_err();
        assert!(problem.to_string().contains(expected), "{problem}");
        assert_eq!(at, line, "{text}");
    }
    let many = "1 2 3\n".repeat(2_000_000);
    assert!(hair::parse(many.as_bytes(), Limits::of(1 << 20)).is_err());
}
