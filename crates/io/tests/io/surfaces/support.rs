//! Scenes of one shape, and access to their bsdfs.

use glam::DVec3;
use morgana_io::image::tone::Tone;
use morgana_io::image::{RgbImage, png};
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use std::path::Path;
use transport::bsdf::{Bsdf, Surface};
use transport::shape::{Site, Uv};

/// A camera on a film of some format, and light.
pub fn scene(format: &str, body: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm">{format}<integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>
<emitter type="constant"/>
{body}
</scene>"#
    )
}

pub fn load_from(directory: &Path, format: &str, body: &str) -> Result<Loaded, String> {
    let path = directory.join("scene.xml");
    fs::write(&path, scene(format, body)).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

pub fn load(body: &str) -> Result<Loaded, String> {
    load_from(tempfile::tempdir().unwrap().path(), "", body)
}

#[track_caller]
pub fn refused(body: &str, expected: &[&str]) {
    let message = load(body).expect_err("the scene was accepted");
    for part in expected {
        assert!(message.contains(part), "expected {part:?} in:\n{message}");
    }
}

/// The bsdf of the only shape.
pub fn bsdf(loaded: &Loaded) -> &Bsdf {
    &loaded.scene().objects()[0].bsdf
}

/// Value of a diffuse surface along its normal, times π: its reflectance.
pub fn reflectance(bsdf: &Bsdf, uv: [f64; 2]) -> [f64; 3] {
    let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
    s.site = Site {
        uv: Uv::Plain(uv),
        ..Site::default()
    };
    let value = bsdf.eval(&s, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
    [value[0], value[1], value[2]]
}

#[track_caller]
pub fn close(found: [f64; 3], expected: [f64; 3]) {
    let error = (0..3)
        .map(|k| (found[k] - expected[k]).abs())
        .fold(0.0, f64::max);
    assert!(error < 2e-4, "{found:?} against {expected:?}");
}

pub const PIXELS: [[f32; 3]; 2] = [[0.5, 0.25, 0.0], [0.125, 0.5, 1.0]];

pub fn write_image(directory: &Path, pixels: &[[f32; 3]; 2]) {
    let image = RgbImage {
        width: 2,
        height: 1,
        pixels: pixels.to_vec(),
    };
    png::write(
        &directory.join("image.png"),
        &image,
        png::Depth::Sixteen,
        Tone::default(),
    )
    .unwrap();
}

pub fn textured(parameters: &str) -> String {
    format!(
        r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
<string name="filename" value="image.png"/>{parameters}</texture></bsdf></shape>"#
    )
}

pub fn shape(bsdf: &str) -> String {
    format!("<shape type=\"rectangle\">{bsdf}</shape>")
}

/// A triangle with colours of its vertices.
pub const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n\
    0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 128 128 128\n3 0 1 2\n";
