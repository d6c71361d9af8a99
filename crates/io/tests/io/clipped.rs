//! Values of images and grids outside their range: rounding errors are clipped with a note, and all
//! others are reported.

use glam::DVec3;
use morgana_io::image::{ImageLayers, Layer, exr};
use morgana_io::volume::{Volume, vol};
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use transport::emitter::Emitter;

/// Writes a row of pixels, equal in all channels.
fn image(folder: &Path, layer: &str, values: &[f32]) {
    let channels = ["R", "G", "B"].map(|name| (name.to_owned(), values.to_vec()));
    let image = ImageLayers {
        width: values.len(),
        height: 1,
        layers: vec![Layer {
            name: layer.to_owned(),
            channels: channels.to_vec(),
        }],
        attributes: Vec::new(),
    };
    exr::write(&folder.join("image.exr"), &image).unwrap();
}

fn load(folder: &Path, body: &str) -> Result<Loaded, String> {
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, 0, 40" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>{body}</scene>"#
    );
    let path = folder.join("scene.xml");
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

const SKY: &str = r#"<emitter type="constant"/>"#;
const ENVIRONMENT: &str =
    r#"<emitter type="envmap"><string name="filename" value="image.exr"/></emitter>"#;

/// Loads a scene that uses a row of pixels. Returns the scene or its messages.
fn with_image(values: &[f32], body: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    image(folder.path(), "", values);
    load(folder.path(), body)
}

#[track_caller]
fn says(found: Result<Loaded, String>, parts: &[&str]) {
    let text = found.map_or_else(|text| text, |loaded| loaded.warnings.to_string());
    for part in parts {
        assert!(text.contains(part), "expected {part:?} in:\n{text}");
    }
}

#[track_caller]
fn accepted(found: Result<Loaded, String>, parts: &[&str]) {
    says(Ok(found.unwrap()), parts);
}

#[track_caller]
fn refused(found: Result<Loaded, String>, parts: &[&str]) {
    says(Err(found.expect_err("the scene was accepted")), parts);
}

#[test]
fn environments_are_clipped_at_black() {
    let note = "image.exr: 1 of 4 pixels are negative, down to -1e-7: rounding, clipped to 0";
    accepted(
        with_image(&[1.0, 0.5, -1e-7, 0.25], ENVIRONMENT),
        &["note[clipped_values]: ", note],
    );
    let light = |values: &[f32]| {
        let loaded = with_image(values, ENVIRONMENT).unwrap();
        let [Emitter::Environment(environment)] = loaded.scene().emitters() else {
            panic!("one environment");
        };
        let turns = (0..16).map(|i| f64::from(i) * 0.4);
        let radiance = |angle: f64| environment.radiance(DVec3::new(angle.cos(), 0.0, angle.sin()));
        turns.map(radiance).collect::<Vec<_>>()
    };
    let black = light(&[1.0, 0.5, 0.0, 0.25]);
    assert_eq!(light(&[1.0, 0.5, -1e-7, 0.25]), black);
    assert_eq!(light(&[1.0, 0.5, -0.1, 0.25]), black);
    // Small negative values, as filters with negative lobes leave beside bright pixels.
    let warning = "image.exr: 1 of 4 pixels are negative, down to -0.1: clipped to 0, which adds 5.7 % to its light";
    accepted(
        with_image(&[1.0, 0.5, -0.1, 0.25], ENVIRONMENT),
        &["warning[clipped_values]: ", warning, "lanczos"],
    );
    refused(
        with_image(&[1.0, 0.5, -0.2, 0.25], ENVIRONMENT),
        &[
            "image.exr: 1 of 4 pixels are negative, down to -0.2",
            "help: ",
        ],
    );
}

/// A black environment changes no picture, as in Mitsuba. False-alarm rate of the six comparisons: 4e-4.
#[test]
fn black_emitters_load_and_add_no_light() {
    let warning = "warning[black_emitter]: the environment is black, because all pixels of ";
    accepted(with_image(&[0.0; 4], ENVIRONMENT), &[warning, "image.exr"]);
    let scaled = ENVIRONMENT.replace("</emitter>", r#"<float name="scale" value="0"/></emitter>"#);
    let light =
        r#"<shape type="sphere"/><emitter type="point"><point name="position" z="40"/></emitter>"#;
    let picture = |values: &[f32], environment: &str, integrator: &str| {
        let integrator = format!(r#"<integrator type="{integrator}"/>"#);
        let found = with_image(values, &format!("{integrator}{environment}{light}")).unwrap();
        let run = morgana_io::Run {
            total: Some(16),
            ..morgana_io::Run::new(&found)
        };
        run.render().unwrap().film.summary()
    };
    for integrator in ["path", "particle", "bdpt"] {
        let (mean, error) = picture(&[0.0; 4], "", integrator);
        assert!(mean > 0.0);
        for (values, environment) in [([0.0; 4], ENVIRONMENT), ([1.0; 4], scaled.as_str())] {
            let (found, its) = picture(&values, environment, integrator);
            let z = (found - mean) / error.hypot(its);
            assert!(z.abs() < 4.0, "{integrator}: {found} in place of {mean}");
        }
    }
}

#[test]
fn environments_that_are_no_numbers_are_refused() {
    let nan = with_image(&[1.0, f32::NAN, 0.5, f32::INFINITY], ENVIRONMENT);
    let expected = "image.exr: value NaN at pixel (1, 0), the first of 2, is not finite";
    refused(nan, &[expected]);
}

/// A square with an image as a parameter.
fn square(bsdf: &str) -> String {
    format!(r#"{SKY}<shape type="rectangle">{bsdf}</shape>"#)
}

const BITMAP: &str = r#"type="bitmap"><string name="filename" value="image.exr"/></texture>"#;

#[test]
fn reflectances_are_clipped_at_their_limits() {
    let diffuse = square(&format!(
        r#"<bsdf type="diffuse"><texture name="reflectance" {BITMAP}</bsdf>"#
    ));
    let above = 1.0 + f32::EPSILON;
    accepted(
        with_image(&[0.5, -1.2e-7], &diffuse),
        &["image.exr: 1 of 2 pixels are negative, down to -1.2e-7: rounding, clipped to 0"],
    );
    accepted(
        with_image(&[0.5, above], &diffuse),
        &[
            "image.exr: 1 of 2 pixels exceed 1, up to 1.0000001",
            "rounding, clipped to 1",
        ],
    );
    refused(
        with_image(&[0.5, -0.01], &diffuse),
        &[
            "image.exr: 1 of 2 pixels are negative, down to -0.01",
            "clip the values",
        ],
    );
    refused(
        with_image(&[0.5, 2.5], &diffuse),
        &[
            "image.exr: 1 of 2 pixels exceed 1, up to 2.5",
            "a texture 'scale' with a scale of at most 0.4",
        ],
    );
    // After scaling, the values may be within the limits.
    let dimmed = square(&format!(
        r#"<bsdf type="diffuse"><texture name="reflectance" type="scale"><float name="scale" value="0.4"/>
<texture {BITMAP}</texture></bsdf>"#
    ));
    let loaded = with_image(&[0.5, 2.5], &dimmed).unwrap();
    assert!(!loaded.warnings.to_string().contains("pixels"));
    // Heights have no limits.
    let bumps = square(&format!(
        r#"<bsdf type="bumpmap"><texture {BITMAP}<bsdf type="diffuse"/></bsdf>"#
    ));
    let loaded = with_image(&[0.5, -1e-7], &bumps).unwrap();
    assert!(!loaded.warnings.to_string().contains("pixels"));
}

#[test]
fn numbers_of_a_scene_are_clipped_at_their_limits() {
    let folder = tempfile::tempdir().unwrap();
    let medium = |albedo: &str| {
        let body = format!(
            r#"{SKY}<shape type="sphere"><bsdf type="null"/><medium type="homogeneous" name="interior">
<rgb name="albedo" value="{albedo}"/></medium></shape>"#
        );
        load(folder.path(), &body)
    };
    accepted(
        medium("1.0000001, 1, 1"),
        &["note[clipped_values]: 1.0000001 is clipped to 1: rounding"],
    );
    refused(medium("1.001, 1, 1"), &["'albedo' is 1.001"]);
    let surface = |value: &str| {
        let bsdf =
            format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{value}"/></bsdf>"#);
        load(folder.path(), &square(&bsdf))
    };
    accepted(
        surface("0.5, 0.5, -1e-9"),
        &["note[clipped_values]: -1e-9 is clipped to 0: rounding"],
    );
    refused(
        surface("0.5, 0.5, -1e-3"),
        &["reflectance must lie in [0, 1]"],
    );
}

/// A medium whose albedo is a grid of two voxels in its own box.
fn grid(folder: &TempDir, values: [f32; 2], end: DVec3) -> Result<Loaded, String> {
    let volume = Volume::new([2, 1, 1], 1, values.to_vec()).unwrap();
    let volume = volume.with_bbox([DVec3::ZERO, end]);
    vol::write(&folder.path().join("grid.vol"), &volume).unwrap();
    let body = format!(
        r#"{SKY}<shape type="cube"><bsdf type="null"/><medium type="heterogeneous" name="interior">
<volume name="albedo" type="gridvolume"><string name="filename" value="grid.vol"/>
<boolean name="use_grid_bbox" value="true"/></volume></medium></shape>"#
    );
    load(folder.path(), &body)
}

#[test]
fn grids_are_clipped_at_their_limits() {
    let folder = tempfile::tempdir().unwrap();
    let above = 1.0 + f32::EPSILON;
    accepted(
        grid(&folder, [0.5, above], DVec3::ONE),
        &[
            "note[clipped_values]: grid.vol: 1 of 2 samples are outside of [0, 1]",
            "rounding, clipped",
        ],
    );
    refused(
        grid(&folder, [-0.25, 1.5], DVec3::ONE),
        &[
            "grid.vol: 2 of 2 samples are outside of [0, 1]: voxel (0, 0, 0) is -0.25, and all lie in [-0.25, 1.5]",
            "'scale' and 'offset'",
        ],
    );
}

#[test]
fn boxes_of_grids_are_finite() {
    let folder = tempfile::tempdir().unwrap();
    refused(
        grid(&folder, [0.5, 0.5], DVec3::new(1.0, f64::NAN, 1.0)),
        &["the bounding box in the file is not finite: [0, 0, 0] to [1, NaN, 1]"],
    );
}

#[test]
fn the_only_layer_in_colour_is_the_image() {
    let folder = tempfile::tempdir().unwrap();
    image(folder.path(), "beauty", &[0.5, 0.25]);
    let read = || morgana_io::image::RgbImage::read(&folder.path().join("image.exr"));
    assert_eq!(read().unwrap().pixels, [[0.5; 3], [0.25; 3]]);
    let layer = |name: &str| {
        let channels = ["R", "G", "B"].map(|channel| (channel.to_owned(), vec![1.0]));
        Layer {
            name: name.to_owned(),
            channels: channels.to_vec(),
        }
    };
    let image = ImageLayers {
        width: 1,
        height: 1,
        layers: vec![layer("left"), layer("right")],
        attributes: Vec::new(),
    };
    exr::write(&folder.path().join("image.exr"), &image).unwrap();
    let error = read().unwrap_err().to_string();
    let expected = "expected the channels R, G, B or Y, or R, G, B in one layer, \
                    found left.B, left.G, left.R, right.B, right.G, right.R";
    assert!(error.ends_with(expected), "{error}");
}
