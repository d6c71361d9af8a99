//! A small scene for each plugin that accepts a transform.

use crate::transforms::map::Map;
use morgana_io::PluginKind;
use morgana_io::image::{ImageLayers, Layer, exr};
use serde_json::{Value, json};
use std::path::Path;

/// A scene in which a plugin emits, senses or blocks light.
pub struct Case {
    pub kind: PluginKind,
    pub plugin: &'static str,
    pub scene: fn(&Map) -> Value,
}

macro_rules! cases {
    ($kind:ident: $($plugin:literal => $scene:expr),* $(,)?) => {
        [$(Case { kind: PluginKind::$kind, plugin: $plugin, scene: $scene }),*]
    };
}

pub fn all() -> Vec<Case> {
    let emitters = cases!(Emitter:
        "point" => |m| lit(m, json!({"type": "point", "to_world": m.place(ABOVE), "intensity": 30.0 * m.area()})),
        "spot" => |m| lit(m, json!({"type": "spot", "to_world": m.view(ABOVE), "intensity": 30.0 * m.area(), "cutoff_angle": 12})),
        "projector" => |m| lit(m, json!({"type": "projector", "to_world": m.view(ABOVE), "fov": 25, "scale": 10.0 * m.area(),
            "irradiance": {"type": "bitmap", "filename": "picture.exr", "filter_type": "nearest", "raw": true}})),
        "ies" => |m| lit(m, json!({"type": "ies", "filename": "light.ies", "to_world": m.view(ABOVE), "scale": m.area()})),
        "directional" => |m| lit(m, json!({"type": "directional", "to_world": m.view(ABOVE), "irradiance": 2})),
        "constant" => |m| lit(m, json!({"type": "constant", "to_world": m.turned()})),
        "envmap" => |m| lit(m, sky(m)),
        "sunsky" => |m| lit(m, json!({"type": "sunsky", "hour": 9, "turbidity": 6, "to_world": m.turned(), "sun_aperture": 20})),
        "collimated" => |m| lit(m, json!({"type": "collimated", "to_world": m.view(ABOVE), "radius": 0.6 * m.scale(), "irradiance": 3})),
        "volumelight" => |m| lit(m, json!({"type": "volumelight", "radiance": {"type": "gridvolume",
            "data": [[[2, 10], [4, 20]], [[0, 5], [30, 1]]], "to_world": m.unit_cube()}, "power": 60.0 * m.area()})),
        "fiber" => |m| lit(m, json!({"type": "fiber", "to_world": m.view(ABOVE), "profile": "rectangle",
            "width": 1.2 * m.scale(), "height": 0.8 * m.scale(), "cutoff_angle": 3, "power": 3.0 * m.area(),
            "texture": {"type": "bitmap", "filename": "picture.exr", "filter_type": "nearest", "raw": true}})),
    );
    let sensors = cases!(Sensor:
        "perspective" => |m| seen(m, json!({"type": "perspective", "fov": 25})),
        "thinlens" => |m| seen(m, json!({"type": "thinlens", "fov": 25, "aperture_radius": 0.2, "focus_point": m.point([0.1, -0.2, 0.3])})),
        "orthographic" => |m| seen(m, json!({"type": "orthographic"})),
        "telecentric" => |m| seen(m, json!({"type": "telecentric", "focus_distance": 5, "acceptance_angle": 4,
            "knife_edge": [1, 0.3, 0]})),
    );
    let shapes = cases!(Shape:
        "sphere" => |m| shape(m, json!({"type": "sphere"})),
        "cube" => |m| shape(m, json!({"type": "cube"})),
        "rectangle" => |m| shape(m, json!({"type": "rectangle"})),
        "disk" => |m| shape(m, json!({"type": "disk"})),
        "cylinder" => |m| shape(m, json!({"type": "cylinder", "radius": 0.7, "capped": true})),
        "obj" => |m| shape(m, json!({"type": "obj", "filename": "wedge.obj"})),
        "ply" => |m| shape(m, json!({"type": "ply", "filename": "wedge.ply"})),
        "mesh" => |m| shape(m, json!({"type": "mesh", "vertex_positions": WEDGE, "faces": FACES})),
        "serialized" => |m| shape(m, json!({"type": "serialized", "filename": "meshes4.serialized"})),
        "gltf" => |m| shape(m, json!({"type": "gltf", "filename": "two_boxes.glb"})),
        "sdfgrid" => |m| shape(m, json!({"type": "sdfgrid", "grid": [[[-0.2, 0.4], [0.3, 0.5]], [[0.6, 0.2], [0.4, 0.7]]]})),
        "tetrahedra" => |m| {
            let nodes = json!([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]);
            let elements = json!([[0, 1, 2, 3], [1, 2, 3, 4]]);
            let medium = |sigma: f64| json!({"type": "homogeneous", "sigma_t": sigma / m.scale()});
            shape(m, json!({"type": "tetrahedra", "nodes": nodes, "elements": elements, "regions": [1, 2], "1": medium(0.7), "2": medium(2.0)}))
        },
        "labels" => |m| {
            let medium = |sigma: f64| json!({"type": "homogeneous", "sigma_t": sigma / m.scale()});
            shape(m, json!({"type": "labels", "data": [[[1, 2], [2, 0]], [[1, 0], [2, 1]]], "1": medium(0.7), "2": medium(2.0)}))
        },
        "instance" => |m| {
            let mut scene = shape(m, json!({"type": "instance", "shapegroup": {"type": "ref", "id": "group"}}));
            scene["group"] = json!({"type": "shapegroup", "a": {"type": "sphere", "radius": 0.5}, "b": {"type": "disk"}});
            scene
        },
    );
    let volumes = cases!(Volume:
        "gridvolume" => |m| {
            let density = json!({"type": "gridvolume", "data": [[[0.2, 1.0], [0.4, 2.0]], [[0.0, 0.5], [3.0, 0.1]]],
                "to_world": m.unit_cube()});
            let fog = json!({"type": "heterogeneous", "sigma_t": density, "scale": m.scale().recip()});
            inside(m, fog)
        },
        "constant" => |m| index(m, json!({"type": "constant", "value": 1.1})),
        "linear" => |m| index(m, json!({"type": "linear", "n0": 1.3, "slope": [0.1, 0.05, 0.0]})),
        "linear_square" => |m| index(m, json!({"type": "linear_square", "n0": 1.3, "slope": [0.1, 0.0, 0.2]})),
        "luneburg" => |m| index(m, json!({"type": "luneburg", "radius": 1.8})),
        "selfoc" => |m| index(m, json!({"type": "selfoc", "n0": 1.3, "alpha": 0.3, "direction": [1, 2, 0.5]})),
        "fisheye" => |m| index(m, json!({"type": "fisheye", "n0": 1.5, "radius": 3})),
        "gaussian" => |m| index(m, json!({"type": "gaussian", "n0": 1, "delta": 0.2, "width": 0.5, "center": [0.2, 0.1, 0]})),
        "acoustic" => |m| index(m, json!({"type": "acoustic", "n0": 1.3, "amplitude": 0.02, "order": 1, "wave_number": 3,
            "direction": [0.2, 1, 0.4], "reference": [1, 0, 0]})),
        "expression" => |m| index(m, json!({"type": "expression", "n": "1.2 + a*exp(-rho^2)*sin(2*z)", "a": 0.1})),
        "standard_atmosphere" => |m| index(m, json!({"type": "standard_atmosphere", "radius": 1, "metres_per_unit": 5000, "constant": 0.1})),
        "profile" => |m| index(m, json!({"type": "profile", "coordinate": "rho", "table": "0, 1.4, 0.5, 1.35, 1, 1.2, 2.5, 1.1"})),
        "bspline" => |m| index(m, samples("bspline", m)),
        "gladstone_dale" => |m| {
            let mut gas = samples("gladstone_dale", m);
            gas["scale"] = 100.0.into();
            gas["constant"] = 2.26e-4.into();
            index(m, gas)
        },
        "pressure" => |m| {
            let mut liquid = samples("pressure", m);
            (liquid["n0"], liquid["dn_dp"]) = (1.33.into(), 1e-10.into());
            liquid["scale"] = 1e8.into();
            index(m, liquid)
        },
        "transducer" => |m| index(m, json!({"type": "transducer", "aperture": "linear_array", "elements": 5, "pitch": 0.6,
            "height": 0.8, "origin": [0.3, -0.2, -4.5], "direction": [0.1, 0.2, 1], "focus": [0.2, 0, 0], "pressure": 2e8,
            "frequency": 1, "sound_speed": 1.1, "n0": 1.33, "dn_dp": 1e-10, "min": [-2.6, -2.6, -2.6], "max": [2.6, 2.6, 2.6]})),
        "sum" => |m| {
            let bump = json!({"type": "gaussian", "n0": 1, "delta": 0.1, "width": 0.5});
            index(m, json!({"type": "sum", "a": bump, "b": {"type": "linear", "n0": 1, "slope": [0, 0.02, 0]}}))
        },
    );
    let mut cases: Vec<Case> = emitters.into_iter().chain(sensors).chain(shapes).collect();
    cases.extend(volumes);
    cases
}

/// Image-textured lights on curved shapes, which transforms must not make uneven.
pub fn shining() -> Vec<Case> {
    let cases = cases!(Shape:
        "sphere" => |m| shining_shape(m, json!({"type": "sphere"})),
        "cylinder" => |m| shining_shape(m, json!({"type": "cylinder", "radius": 0.5})),
    );
    cases.into()
}

/// Position of emitters that light the ball from beside the sensor.
const ABOVE: [f64; 3] = [2.0, 3.0, 4.0];
const WEDGE: [[f64; 3]; 4] = [
    [-1.0, -1.0, 0.3],
    [1.0, -1.0, 0.0],
    [0.2, 1.0, 0.1],
    [0.0, 0.0, 1.0],
];
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

/// The sensor in front of everything.
fn scene(m: &Map) -> Value {
    json!({"type": "scene", "sensor": with(json!({"type": "perspective", "fov": 25}), json!({
        "film": film(), "to_world": m.view([0.3, 0.2, 6.0])}))})
}

fn film() -> Value {
    json!({"type": "hdrfilm", "width": 4, "height": 4})
}

fn with(mut object: Value, more: Value) -> Value {
    for (key, value) in more.as_object().unwrap() {
        object[key] = value.clone();
    }
    object
}

fn sky(m: &Map) -> Value {
    json!({"type": "envmap", "filename": "sky.exr", "to_world": m.turned()})
}

/// A ball in the light of an emitter.
fn lit(m: &Map, emitter: Value) -> Value {
    with(
        scene(m),
        json!({"ball": {"type": "sphere", "to_world": m.turned()}, "light": emitter}),
    )
}

/// A ball under the sky, in front of a sensor.
fn seen(m: &Map, sensor: Value) -> Value {
    let sensor = with(
        sensor,
        json!({"film": film(), "to_world": m.view([0.3, 0.2, 5.0])}),
    );
    with(lit(m, sky(m)), json!({"sensor": sensor}))
}

/// A shape under the sky.
fn shape(m: &Map, shape: Value) -> Value {
    let shape = with(shape, json!({"to_world": m.turned()}));
    with(scene(m), json!({"shape": shape, "sky": sky(m)}))
}

/// A shape that shows and emits an image.
fn shining_shape(m: &Map, light: Value) -> Value {
    let picture = json!({"type": "bitmap", "filename": "picture.exr", "raw": true});
    let light = with(
        light,
        json!({"emitter": {"type": "area", "radiance": picture},
        "to_world": m.place([1.0, 0.5, 1.5])}),
    );
    with(lit(m, light), json!({}))
}

/// A ball of a medium under the sky.
fn inside(m: &Map, medium: Value) -> Value {
    let ball = json!({"type": "sphere", "bsdf": {"type": "null"}, "interior": medium, "to_world": m.turned()});
    with(scene(m), json!({"ball": ball, "sky": sky(m)}))
}

/// Cells around a ball of fog in a beam.
pub fn metered(m: &Map) -> Value {
    let fog = json!({"type": "homogeneous", "sigma_t": 2.0 / m.scale()});
    let beam = json!({"type": "collimated", "to_world": m.view(ABOVE), "radius": 0.6 * m.scale(), "power": 3});
    let meter =
        json!({"type": "fluencemeter", "to_world": m.unit_cube(), "nx": 2, "ny": 3, "nz": 4});
    let mut scene = with(inside(m, fog), json!({"sky": beam, "sensor": meter}));
    scene["integrator"] = json!({"type": "particle"});
    scene
}

/// A ball of an index.
fn index(m: &Map, mut field: Value) -> Value {
    if field.get("to_world").is_none() {
        field["to_world"] = m.turned();
    }
    inside(m, json!({"type": "transparent", "ior": field}))
}

fn samples(plugin: &str, m: &Map) -> Value {
    let at = |i: usize, j: usize, k: usize| 1.2 + 0.05 * ((i + 2 * j * k) % 3) as f64;
    let row = |j, k| (0..4).map(|i| at(i, j, k)).collect::<Vec<_>>();
    let plane = |k| (0..4).map(|j| row(j, k)).collect::<Vec<_>>();
    let data: Vec<_> = (0..4).map(plane).collect();
    json!({"type": plugin, "data": data, "placement": "nodes", "to_world": m.unit_cube()})
}

/// Writes the files that the scenes name.
pub fn write_files(folder: &Path) {
    write_picture(&folder.join("sky.exr"), 16, 8);
    write_picture(&folder.join("picture.exr"), 6, 4);
    std::fs::write(folder.join("light.ies"), LIGHT).unwrap();
    let vertices = |tag: &str| {
        WEDGE
            .map(|[x, y, z]| format!("{tag}{x} {y} {z}\n"))
            .concat()
    };
    let faces = FACES
        .map(|f| format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1))
        .concat();
    std::fs::write(folder.join("wedge.obj"), vertices("v ") + &faces).unwrap();
    let faces = FACES
        .map(|f| format!("3 {} {} {}\n", f[0], f[1], f[2]))
        .concat();
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 4\nproperty list uchar int vertex_indices\nend_header\n";
    std::fs::write(
        folder.join("wedge.ply"),
        header.to_owned() + &vertices("") + &faces,
    )
    .unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/meshes");
    for name in ["meshes4.serialized", "two_boxes.glb"] {
        std::fs::copy(data.join(name), folder.join(name)).unwrap();
    }
}

/// Writes an image whose colours have no symmetry.
fn write_picture(path: &Path, width: usize, height: usize) {
    let channel = |c: usize| {
        let value = |i: usize| 0.1 + 0.2 * ((i * (7 + c)) % 11) as f32;
        (
            ["B", "G", "R"][c].to_owned(),
            (0..width * height).map(value).collect(),
        )
    };
    let layer = Layer {
        name: String::new(),
        channels: [0, 1, 2].map(channel).into(),
    };
    let image = ImageLayers {
        width,
        height,
        layers: vec![layer],
        attributes: Vec::new(),
    };
    exr::write(path, &image).unwrap();
}

/// A light profile, brighter on one side.
const LIGHT: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 5 1 2 0 0 0\n1 1 100\n0 45 90\n0 90 180 270 360\n\
                    40 30 10\n20 15 5\n60 20 5\n10 5 2\n40 30 10\n";
