//! Meshes and grids that scenes share in memory, between groups of channels and between scenes of
//! equal content.

use eikonal::field::Bspline;
use morgana_io::{LoadOptions, Loaded};
use std::fs::write;
use std::path::Path;
use std::ptr;
use std::sync::Arc;
use tempfile::TempDir;
use transport::scene::Scene;
use transport::shape::{Mesh, Shape};
use transport::volume::{VolumeGrid, VolumeTexture};

/// A folder with a mesh and a grid.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let tetrahedron = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    write(folder.path().join("body.obj"), tetrahedron).unwrap();
    folder
}

/// Loads a body of a medium with a grid of extinctions, seen at nine wavelengths: three groups of
/// channels.
fn load(folder: &Path, name: &str, samples: &str, albedo: f64) -> Loaded {
    let text = format!(
        r#"{{"type": "scene", "light": {{"type": "constant"}},
          "camera": {{"type": "perspective", "film": {{"type": "hdrfilm", "pixel_format": "spectral",
            "wavelengths": [400, 450, 500, 550, 600, 650, 700, 750, 800]}}}},
          "body": {{"type": "obj", "filename": "body.obj", "bsdf": {{"type": "null"}},
            "interior": {{"type": "heterogeneous", "albedo": {albedo},
              "ior": {{"type": "bspline", "data": {samples}, "offset": 1, "placement": "nodes", "to_world": [{{"scale": 10}}]}},
              "sigma_t": {{"type": "gridvolume", "data": {samples}, "to_world": [{{"scale": 10}}]}}}}}}}}"#
    );
    load_text(folder, name, &text)
}

fn load_text(folder: &Path, name: &str, text: &str) -> Loaded {
    let path = folder.join(name);
    write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|d| panic!("{d}"))
}

fn mesh(scene: &Scene) -> &Arc<Mesh> {
    match &scene.objects()[0].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn grid(scene: &Scene) -> &Arc<VolumeGrid> {
    match &scene.media()[1].sigma_t {
        VolumeTexture::Grid(grid) => grid,
        other => panic!("{other:?}"),
    }
}

fn spline(loaded: &Loaded) -> &Bspline {
    let [held] = &loaded.held[..] else {
        panic!("{} parts", loaded.held.len());
    };
    held.downcast_ref::<Bspline>().unwrap()
}

const SAMPLES: &str = "[[[0.1, 0.2], [0.3, 0.4]], [[0.5, 0.6], [0.7, 0.8]]]";

#[test]
fn groups_of_channels_share_meshes_and_grids() {
    let folder = folder();
    let loaded = load(folder.path(), "scene.json", SAMPLES, 0.5);
    assert_eq!(loaded.groups.len(), 3);
    for other in &loaded.groups[1..] {
        assert!(Arc::ptr_eq(mesh(&loaded.groups[0]), mesh(other)));
        assert!(Arc::ptr_eq(grid(&loaded.groups[0]), grid(other)));
    }
}

/// A sweep over a parameter holds its data once.
#[test]
fn scenes_with_equal_data_share_them() {
    let folder = folder();
    let first = load(folder.path(), "first.json", SAMPLES, 0.5);
    let second = load(folder.path(), "second.json", SAMPLES, 0.7);
    assert!(Arc::ptr_eq(grid(first.scene()), grid(second.scene())));
    assert!(Arc::ptr_eq(mesh(first.scene()), mesh(second.scene())));
    assert!(ptr::eq(spline(&first), spline(&second)));
    let other = load(
        folder.path(),
        "third.json",
        &SAMPLES.replace("0.8", "0.9"),
        0.5,
    );
    assert!(!Arc::ptr_eq(grid(first.scene()), grid(other.scene())));
    assert!(!ptr::eq(spline(&first), spline(&other)));
    // Equal triangles in another place are other triangles.
    assert!(Arc::ptr_eq(mesh(first.scene()), mesh(other.scene())));
    let flat = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 8\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    write(folder.path().join("body.obj"), flat).unwrap();
    let flatter = load(folder.path(), "fourth.json", SAMPLES, 0.5);
    assert!(!Arc::ptr_eq(mesh(first.scene()), mesh(flatter.scene())));
}

/// Loads a volume of two labels seen at nine wavelengths: three groups of channels.
fn load_labels(folder: &Path, labels: &str, surface: &str, scale: f64) -> Loaded {
    let text = format!(
        r#"{{"type": "scene", "light": {{"type": "constant"}},
          "camera": {{"type": "perspective", "film": {{"type": "hdrfilm", "pixel_format": "spectral",
            "wavelengths": [400, 450, 500, 550, 600, 650, 700, 750, 800]}}}},
          "tissue": {{"type": "labels", "data": {labels}, "surface": "{surface}", "to_world": [{{"scale": {scale}}}],
            "1": {{"type": "homogeneous", "ior": 1.3, "sigma_a": {{"type": "spectrum", "value": [[400, 1], [800, 2]]}}}},
            "2": {{"type": "homogeneous", "ior": 1.4, "sigma_a": 0.1}}}}}}"#
    );
    load_text(folder, "labels.json", &text)
}

#[test]
fn groups_of_channels_and_scenes_share_surfaces_between_labels() {
    let labels = "[[[1, 2], [2, 2]], [[1, 1], [0, 2]]]";
    let folder = tempfile::tempdir().unwrap();
    for surface in ["voxels", "smooth"] {
        let load_labels = |labels, scale| load_labels(folder.path(), labels, surface, scale);
        let loaded = load_labels(labels, 1.0);
        assert_eq!(loaded.groups.len(), 3);
        let again = load_labels(labels, 1.0);
        let first = loaded.scene().objects();
        for other in loaded.groups[1..].iter().chain(&again.groups) {
            assert_eq!(first.len(), other.objects().len());
            let mut pairs = first.iter().zip(other.objects());
            assert!(pairs.all(|(a, b)| a.shape.is_same(&b.shape)), "{surface}");
        }
        for different in [
            load_labels("[[[1, 2], [2, 2]], [[1, 1], [0, 1]]]", 1.0),
            load_labels(labels, 2.0),
        ] {
            let mut pairs = first.iter().zip(different.scene().objects());
            assert!(!pairs.any(|(a, b)| a.shape.is_same(&b.shape)), "{surface}");
        }
    }
}
