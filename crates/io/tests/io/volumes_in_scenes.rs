//! Volume files in scenes: scaled numbers, placement, other formats, and required parameters.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use std::path::Path;
use tempfile::TempDir;

/// Values x + 10 y + 100 z on a grid of 2 x 3 x 4 that begins at (0.8, −1, 1.6) in steps of (0.1, 0.2, 0.4).
const FIRST: DVec3 = DVec3::new(0.8, -1.0, 1.6);
const LAST: DVec3 = DVec3::new(0.9, -0.6, 2.8);

/// A folder with the files of `data/volumes`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes");
    for entry in std::fs::read_dir(data).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    folder
}

/// A ball of a medium with one volume from a file.
fn load_in(
    folder: &TempDir,
    role: &str,
    plugin: &str,
    file: &str,
    more: &str,
) -> Result<Loaded, String> {
    let medium = if role == "ior" {
        "transparent"
    } else {
        "heterogeneous"
    };
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/>
             <transform name="to_world"><lookat origin="0, 0, 40" target="0, 0, 0" up="0, 1, 0"/></transform>
           </sensor><emitter type="constant"/>
           <shape type="sphere"><float name="radius" value="5"/><bsdf type="null"/>
             <medium type="{medium}" name="interior"><volume name="{role}" type="{plugin}">
               <string name="filename" value="{file}"/>{more}
             </volume></medium></shape></scene>"#
    );
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn load(role: &str, plugin: &str, file: &str, more: &str) -> Result<Loaded, String> {
    load_in(&folder(), role, plugin, file, more)
}

const ZYX: &str = r#"<string name="axis_order" value="zyx"/>"#;
const DENSITY: &str = r#"<string name="dataset" value="density"/>"#;

#[test]
fn scaled_integers_are_an_index() {
    let law = r#"<float name="scale" value="1e-4"/><float name="offset" value="1.3"/>"#;
    let loaded = load("ior", "bspline", "detached.nhdr", law).unwrap();
    let n = |x: DVec3| loaded.scene().medium(1).index.n(x);
    assert!((n(FIRST) - 1.3).abs() < 1e-7);
    assert!((n(LAST) - 1.3321).abs() < 1e-7);
}

#[test]
fn extinction_from_every_format() {
    let scale = r#"<float name="scale" value="0.5"/><float name="offset" value="1"/>"#;
    for (file, says) in [
        ("half.npy", ZYX.to_owned()),
        ("compressed.npz", ZYX.to_owned()),
        ("stored.npz", format!("{ZYX}{DENSITY}")),
        (
            "kwave.h5",
            format!(r#"{ZYX}<string name="dataset" value="p_final"/>"#),
        ),
        (
            "compressed.mat",
            r#"<string name="axis_order" value="xyz"/>"#.to_owned(),
        ),
        ("gzip.nrrd", String::new()),
        ("cells.vti", String::new()),
        ("cells.vtk", String::new()),
        ("grids.vdb", DENSITY.to_owned()),
    ] {
        let loaded = load("sigma_t", "gridvolume", file, &format!("{says}{scale}"));
        let loaded = loaded.unwrap_or_else(|e| panic!("{file}: {e}"));
        let texture = &loaded.scene().medium(1).sigma_t;
        // Beyond the first and the last sample, their values continue.
        let (low, high) = (DVec3::splat(-3.0), DVec3::splat(4.0));
        for (x, expected) in [(low, 1.0), (high, 0.5 * 321.0 + 1.0)] {
            assert_eq!(texture.at(x)[0], expected, "{file}");
        }
    }
}

#[test]
fn data_in_another_file_belong_to_the_scene() {
    let folder = folder();
    let hash = || {
        load_in(&folder, "sigma_t", "gridvolume", "detached.nhdr", "")
            .unwrap()
            .hash
    };
    let before = hash();
    let data = folder.path().join("detached.raw");
    let mut bytes = std::fs::read(&data).unwrap();
    bytes[0] ^= 1;
    std::fs::write(&data, bytes).unwrap();
    assert_ne!(before, hash());
}

#[test]
fn what_a_scene_must_say() {
    let refused = |file, more: &str, expected: &str| {
        let error = load("sigma_t", "gridvolume", file, more).unwrap_err();
        assert!(error.contains(expected), "{error}");
    };
    refused("stored.npz", DENSITY, "give 'axis_order'");
    refused("stored.npz", ZYX, "found the arrays: density, other");
    refused("compressed.mat", DENSITY, "give 'axis_order'");
    refused("cells.vtk", ZYX, "the format has its own");
    refused("raw.nrrd", ZYX, "leave out the order");
    refused("spacings.nrrd", "", "give the order of its axes");
    refused("raw.nrrd", DENSITY, "files hold several");
    refused(
        "raw.nrrd",
        r#"<string name="placement" value="centers"/>"#,
        "leave 'placement' out",
    );
    let order = r#"<string name="axis_order" value="zxx"/>"#;
    refused("half.npy", order, "'zxx' is not an order of axes");
    refused(
        "half.npy",
        &format!(r#"{ZYX}<float name="scale" value="-1"/>"#),
        "voxel (1, 0, 0) is -1",
    );
}
