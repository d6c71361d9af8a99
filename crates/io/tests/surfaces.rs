//! Bsdfs, textures, emitters and shapes from files, and instances in scene files: what becomes of them, and what is
//! refused.

mod common;

use glam::DVec3;
use morgana_io::image::tone::Tone;
use morgana_io::image::{RgbImage, png};
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use std::path::Path;
use transport::bsdf::{Bsdf, Surface};
use transport::shape::{Site, Uv};

/// A camera on a film of some format, and light.
fn scene(format: &str, body: &str) -> String {
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

fn load_from(directory: &Path, format: &str, body: &str) -> Result<Loaded, String> {
    let path = directory.join("scene.xml");
    fs::write(&path, scene(format, body)).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn load(body: &str) -> Result<Loaded, String> {
    load_from(tempfile::tempdir().unwrap().path(), "", body)
}

#[track_caller]
fn refused(body: &str, expected: &[&str]) {
    let message = load(body).expect_err("the scene was accepted");
    for part in expected {
        assert!(message.contains(part), "expected {part:?} in:\n{message}");
    }
}

/// The bsdf of the only shape.
fn bsdf(loaded: &Loaded) -> &Bsdf {
    &loaded.scene().objects()[0].bsdf
}

/// Value of a diffuse surface along its normal, times π: its reflectance.
fn reflectance(bsdf: &Bsdf, uv: [f64; 2]) -> [f64; 3] {
    let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
    s.site = Site {
        uv: Uv::Plain(uv),
        ..Site::default()
    };
    let value = bsdf.eval(&s, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
    [value[0], value[1], value[2]]
}

#[track_caller]
fn close(found: [f64; 3], expected: [f64; 3]) {
    let error = (0..3)
        .map(|k| (found[k] - expected[k]).abs())
        .fold(0.0, f64::max);
    assert!(error < 2e-4, "{found:?} against {expected:?}");
}

const PIXELS: [[f32; 3]; 2] = [[0.5, 0.25, 0.0], [0.125, 0.5, 1.0]];

fn write_image(directory: &Path, pixels: &[[f32; 3]; 2]) {
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

fn textured(parameters: &str) -> String {
    format!(
        r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
<string name="filename" value="image.png"/>{parameters}</texture></bsdf></shape>"#
    )
}

#[test]
fn bitmaps_are_decoded_unless_raw() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let load = |text: &str| load_from(directory.path(), "", &textured(text)).unwrap();
    let plain = load(r#"<string name="filter_type" value="nearest"/>"#);
    close(reflectance(bsdf(&plain), [0.2, 0.5]), [0.5, 0.25, 0.0]);
    close(reflectance(bsdf(&plain), [0.7, 0.5]), [0.125, 0.5, 1.0]);
    let raw = load(r#"<boolean name="raw" value="true"/>"#);
    let encoded = PIXELS[0].map(|v| morgana_io::scene::srgb_from_linear(f64::from(v)));
    close(reflectance(bsdf(&raw), [0.25, 0.5]), encoded);
    let wrapped = load(r#"<string name="wrap_mode" value="clamp"/>"#);
    close(reflectance(bsdf(&wrapped), [7.0, 0.5]), [0.125, 0.5, 1.0]);
    let moved = load(
        r#"<transform name="to_uv"><scale value="1, 1, 1"/><translate value="0.5, 0, 0"/></transform>"#,
    );
    close(reflectance(bsdf(&moved), [0.25, 0.5]), [0.125, 0.5, 1.0]);
}

#[test]
fn bitmaps_in_other_channels() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let body = textured(r#"<string name="filter_type" value="nearest"/>"#);
    let luminance = r#"<string name="pixel_format" value="luminance"/>"#;
    let loaded = load_from(directory.path(), luminance, &body).unwrap();
    let y = 0.2126 * 0.5 + 0.7152 * 0.25;
    close(
        reflectance(bsdf(&loaded), [0.2, 0.5]),
        [y; 3].map(|y| y * 1.0),
    );
    let spectral = r#"<string name="pixel_format" value="spectral"/><string name="wavelengths" value="500, 600"/>"#;
    let error = load_from(directory.path(), spectral, &body).unwrap_err();
    assert!(
        error.contains("a coloured bitmap has no meaning on a spectral film"),
        "{error}"
    );
    assert_eq!(error.matches("a coloured bitmap").count(), 1, "{error}");
    write_image(directory.path(), &[[0.25; 3], [0.5; 3]]);
    let loaded = load_from(directory.path(), spectral, &body).unwrap();
    close(reflectance(bsdf(&loaded), [0.2, 0.5]), [0.25, 0.25, 0.25]);
}

#[test]
fn one_bitmap_for_many_shapes_is_read_once() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let body = r#"<texture type="bitmap" id="t"><string name="filename" value="image.png"/></texture>
<shape type="sphere"><bsdf type="diffuse"><ref id="t" name="reflectance"/></bsdf></shape>
<shape type="disk"><bsdf type="diffuse"><ref id="t" name="reflectance"/></bsdf></shape>"#;
    let loaded = load_from(directory.path(), "", body).unwrap();
    let [a, b] = [0, 1].map(|i| reflectance(&loaded.scene().objects()[i].bsdf, [0.3, 0.4]));
    assert_eq!(a, b);
}

#[test]
fn checkerboards_nest() {
    let body = r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
<rgb name="color0" value="0.1, 0.2, 0.3"/>
<texture name="color1" type="checkerboard"><float name="color0" value="0.9"/><float name="color1" value="0.8"/>
<transform name="to_uv"><scale value="2, 2, 1"/></transform></texture>
</texture></bsdf></shape>"#;
    let loaded = load(body).unwrap();
    close(reflectance(bsdf(&loaded), [0.1, 0.1]), [0.1, 0.2, 0.3]);
    close(reflectance(bsdf(&loaded), [0.6, 0.1]), [0.9; 3]);
    close(reflectance(bsdf(&loaded), [0.8, 0.1]), [0.8; 3]);
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n\
    0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 128 128 128\n3 0 1 2\n";

#[test]
fn colours_of_vertices() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("t.ply"), PLY).unwrap();
    let obj = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0.2 0.2 0.2\nf 1 2 3\n";
    fs::write(directory.path().join("t.obj"), obj).unwrap();
    fs::write(
        directory.path().join("plain.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    let body = |kind: &str, name: &str| {
        format!(
            r#"<shape type="{kind}"><string name="filename" value="{name}"/>
<transform name="to_world"><scale value="2"/></transform>
<bsdf type="diffuse"><texture name="reflectance" type="mesh_attribute">
<string name="name" value="vertex_color"/></texture></bsdf></shape>"#
        )
    };
    let grey = morgana_io::scene::linear_from_srgb(128.0 / 255.0);
    for (kind, name, third) in [("ply", "t.ply", grey), ("obj", "t.obj", 0.2)] {
        let loaded = load_from(directory.path(), "", &body(kind, name)).unwrap();
        let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
        s.site.position = DVec3::new(0.5, 1.0, 0.0);
        let value = bsdf(&loaded).eval(&s, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
        let part = 0.5 * third;
        close(
            [value[0], value[1], value[2]],
            [0.25 + part, 0.25 + part, part],
        );
    }
    let error = load_from(directory.path(), "", &body("obj", "plain.obj")).unwrap_err();
    assert!(error.contains("the shape has no colours"), "{error}");
}

/// Two faces, of which the first is two triangles; the names are those that Mitsuba writes.
#[test]
fn colours_of_faces() {
    let directory = tempfile::tempdir().unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element face 2\nproperty list uchar int vertex_indices\nproperty float color_0\nproperty float color_1\n\
        property float color_2\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n4 0 1 2 3 0.5 0.25 0.125\n3 1 4 2 0.1 0.2 0.3\n";
    fs::write(directory.path().join("t.ply"), ply).unwrap();
    let body = |name: &str| {
        format!(
            r#"<shape type="ply"><string name="filename" value="t.ply"/><bsdf type="diffuse">
               <texture type="mesh_attribute" name="reflectance"><string name="name" value="{name}"/></texture></bsdf></shape>"#
        )
    };
    let loaded = load_from(directory.path(), "", &body("face_color")).unwrap();
    let first = [0.5, 0.25, 0.125];
    for (triangle, expected) in [(0, first), (1, first), (2, [0.1, 0.2, 0.3])] {
        let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
        s.site.primitive = triangle;
        let value = bsdf(&loaded).eval(&s, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
        close([value[0], value[1], value[2]], expected);
    }
    let error = load_from(directory.path(), "", &body("vertex_color")).unwrap_err();
    assert!(error.contains("the shape has no colours: "), "{error}");
    let error = load_from(directory.path(), "", &body("face_colour")).unwrap_err();
    assert!(error.contains("did you mean 'face_color'?"), "{error}");
}

/// Images begin at the top, and v in .obj files at the bottom.
#[test]
fn coordinates_of_obj_files_are_turned() {
    let directory = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.2\nvt 0.3 0.4\nvt 0.5 0.6\nf 1/1 2/2 3/3\n";
    fs::write(directory.path().join("t.obj"), obj).unwrap();
    for (flip, expected) in [
        ("", 0.8),
        (r#"<boolean name="flip_tex_coords" value="false"/>"#, 0.2),
    ] {
        let body =
            format!(r#"<shape type="obj"><string name="filename" value="t.obj"/>{flip}</shape>"#);
        let loaded = load_from(directory.path(), "", &body).unwrap();
        let shape = &loaded.scene().objects()[0].shape;
        let sample = shape.sample_area([0.0, 0.0]);
        let uv = sample.uv.get();
        assert!((uv[1] - expected).abs() < 1e-12, "{uv:?}");
    }
}

fn shape(bsdf: &str) -> String {
    format!("<shape type=\"rectangle\">{bsdf}</shape>")
}

#[test]
fn nested_surfaces() {
    let kind = |text: &str| {
        let loaded = load(&shape(text)).unwrap_or_else(|e| panic!("{e}"));
        loaded.scene().objects()[0].bsdf.clone()
    };
    let diffuse = r#"<bsdf type="diffuse"/>"#;
    let two = kind(&format!(r#"<bsdf type="twosided">{diffuse}</bsdf>"#));
    assert!(matches!(two, Bsdf::TwoSided(_)));
    let behind = Surface::plain(DVec3::Z, 1.0, 1.0);
    assert!(!two.eval(&behind, -DVec3::Z, -DVec3::Z).is_zero());
    let mask = kind(&format!(
        r#"<bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="twosided">{diffuse}{diffuse}</bsdf></bsdf>"#
    ));
    let through = mask.through(&Site::default(), 1.0).unwrap();
    assert_eq!(through.probability, 0.75);
    let blend = kind(&format!(
        r#"<bsdf type="blendbsdf"><float name="weight" value="0.25"/>{diffuse}
<bsdf type="diffuse"><float name="reflectance" value="0.9"/></bsdf></bsdf>"#
    ));
    close(reflectance(&blend, [0.0; 2]), [0.75 * 0.5 + 0.25 * 0.9; 3]);
    assert!(matches!(
        kind(r#"<bsdf type="thindielectric"/>"#),
        Bsdf::ThinDielectric(_)
    ));
    assert!(matches!(
        kind(r#"<bsdf type="plastic"/>"#),
        Bsdf::Plastic(_)
    ));
    let text = r#"<bsdf type="principled"><rgb name="base_color" value="0.1, 0.5, 0.2"/>
<float name="metallic" value="1"/><float name="sheen" value="0"/></bsdf>"#;
    assert!(matches!(kind(text), Bsdf::Principled(_)));
}

/// Reflectance of copper for light along the normal: ((η − 1)² + k²)/((η + 1)² + k²).
#[test]
fn metals_have_names() {
    let loaded = load(&shape(
        r#"<bsdf type="conductor"><string name="material" value="Cu"/></bsdf>"#,
    ));
    let loaded = loaded.unwrap();
    let s = Surface::plain(DVec3::Z, 1.0, 1.0);
    let weight = bsdf(&loaded).sample(&s, DVec3::Z, [0.5; 3]).unwrap().weight;
    for (channel, (eta, k)) in [(0.201005, 3.91326), (0.92375, 2.45305), (1.10222, 2.14209)]
        .into_iter()
        .enumerate()
    {
        let (eta, k): (f64, f64) = (eta, k);
        let expected = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((weight[channel] - expected).abs() < 1e-12);
    }
}

#[test]
fn what_is_refused() {
    let nested =
        |outer: &str, inner: &str| shape(&format!("<bsdf type=\"{outer}\">{inner}</bsdf>"));
    refused(
        &nested("mask", "<bsdf type=\"dielectric\"/>"),
        &["a mask takes surfaces that let no light through"],
    );
    refused(&nested("mask", ""), &["takes one nested bsdf, not 0"]);
    refused(
        &nested("blendbsdf", "<bsdf type=\"diffuse\"/>"),
        &["takes 2 nested bsdfs, not 1"],
    );
    refused(
        &nested("twosided", &"<bsdf type=\"diffuse\"/>".repeat(3)),
        &["takes 1 or 2 nested bsdfs, not 3"],
    );
    refused(
        &nested(
            "principled",
            "<float name=\"eta\" value=\"1.5\"/><float name=\"specular\" value=\"0.5\"/>",
        ),
        &["give 'eta' or 'specular', not both"],
    );
    refused(
        &nested("hk", ""),
        &["a thin scattering layer is a medium here"],
    );
    refused(
        &nested("conductor", "<string name=\"material\" value=\"Cuu\"/>"),
        &["'material' cannot be 'Cuu'", "Cu"],
    );
    refused(
        &nested("diffuse", "<texture name=\"reflectance\" type=\"bitmpa\"/>"),
        &["unknown texture type 'bitmpa'", "bitmap"],
    );
    refused(
        &nested(
            "diffuse",
            "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"no.png\"/></texture>",
        ),
        &["no.png"],
    );
    refused(
        &nested(
            "diffuse",
            "<texture name=\"reflectance\" type=\"checkerboard\"><float name=\"color0\" value=\"1.5\"/></texture>",
        ),
        &["reflectance must lie in [0, 1] in every channel, got 1.5"],
    );
    refused(
        "<shape type=\"sphere\"><bsdf type=\"thindielectric\"/>\
         <medium name=\"interior\" type=\"homogeneous\"/></shape>",
        &["separates media, but light passes it straight on"],
    );
    refused(
        "<shape type=\"sphere\"><bsdf type=\"mask\"><bsdf type=\"diffuse\"/></bsdf>\
         <emitter type=\"area\"><float name=\"radiance\" value=\"1\"/></emitter></shape>",
        &["emits light from a specular, null, masked or thin surface"],
    );
}

const IES: &str = "IESNA:LM-63-2002\n[MANUFAC] nobody\nTILT=NONE\n1 1000 2 3 2 1 1 0.1 0.1 0.1\n1 1 50\n\
    0 45 90\n0 90\n100 50 0\n200 100 0\n";

#[test]
fn photometric_files() {
    let light = morgana_io::ies::parse(IES.as_bytes()).unwrap();
    assert_eq!(light.vertical, [0.0, 45.0, 90.0]);
    // A quarter of the turn, mirrored twice; all times the multiplier 2.
    assert_eq!(light.horizontal, [0.0, 90.0, 180.0, 270.0, 360.0]);
    let (a, b) = ([200.0, 100.0, 0.0], [400.0, 200.0, 0.0]);
    assert_eq!(light.candela, [a, b, a, b, a].concat());
    let half = IES
        .replace("3 2 1 1", "3 3 1 1")
        .replace("\n0 90\n100", "\n90 180 270\n7 8 9 100");
    let light = morgana_io::ies::parse(half.as_bytes()).unwrap();
    assert_eq!(light.horizontal, [0.0, 90.0, 180.0, 270.0, 360.0]);
    assert_eq!(light.candela[..6], [200.0, 100.0, 0.0, 14.0, 16.0, 18.0]);
    let tilted = IES.replace("TILT=NONE", "TILT=INCLUDE\n1\n2\n0 90\n1 0.9");
    assert_eq!(
        morgana_io::ies::parse(tilted.as_bytes())
            .unwrap()
            .vertical
            .len(),
        3
    );
    for (from, to, expected) in [
        (
            "TILT=NONE",
            "TILT=LIGHT.TLT",
            "not supported: TILT=LIGHT.TLT: a tilt in another file",
        ),
        ("TILT=NONE", "", "there is no line TILT="),
        (
            "3 2 1 1",
            "3 2 2 1",
            "not supported: photometry of type A or B; type C is read",
        ),
        ("3 2 1 1", "3 2.5 1 1", "number of horizontal angles: 2.5"),
        (
            "3 2 1 1",
            "3000000 2 1 1",
            "number of vertical angles: 3000000",
        ),
        ("200 100 0\n", "200 100\n", "the file ends before candela"),
        ("45", "fourty", "vertical angles: 'fourty' is not a number"),
        ("\n0 90\n1", "\n0 80\n1", "horizontal angles from 0 to 80"),
    ] {
        let error = morgana_io::ies::parse(IES.replace(from, to).as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
}

fn emitted(loaded: &Loaded, direction: DVec3) -> [f64; 3] {
    use transport::emitter::Emitter;
    let direction = direction.normalize();
    let value = match &loaded.scene().emitters()[1] {
        Emitter::Projector(p) => p.intensity(direction),
        Emitter::Luminaire(l) => l.intensity(direction),
        other => panic!("{other:?}"),
    };
    [value[0], value[1], value[2]]
}

#[test]
fn lights_from_files() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    fs::write(directory.path().join("light.ies"), IES).unwrap();
    let pose = r#"<transform name="to_world"><lookat origin="0, 3, 0" target="0, 0, 0" up="0, 0, 1"/></transform>"#;
    let body = format!(
        r#"<emitter type="ies">{pose}<string name="filename" value="light.ies"/>
<rgb name="scale" value="1, 0.5, 0.25"/></emitter>"#
    );
    let loaded = load_from(directory.path(), "", &body).unwrap();
    close(emitted(&loaded, -DVec3::Y), [200.0, 100.0, 50.0]);
    // Halfway between the first two vertical angles, in the plane of the first horizontal one: local +x.
    let tilt = 22.5f64.to_radians();
    let aside = emitted(&loaded, DVec3::new(tilt.sin(), -tilt.cos(), 0.0));
    close(aside, [150.0, 75.0, 37.5]);
    close(emitted(&loaded, DVec3::Y), [0.0; 3]);
    let body = format!(
        r#"<emitter type="projector">{pose}<float name="fov" value="90"/><float name="scale" value="2"/>
<texture name="irradiance" type="bitmap"><string name="filename" value="image.png"/></texture></emitter>"#
    );
    let loaded = load_from(directory.path(), "", &body).unwrap();
    // The left half of the image is on the side of local +x.
    let left = DVec3::new(0.5, -1.0, 0.1);
    let cos = left.normalize().dot(-DVec3::Y);
    let factor = 2.0 * std::f64::consts::PI / cos.powi(3);
    close(emitted(&loaded, left).map(|v| v / factor), [0.5, 0.25, 0.0]);
    let right = DVec3::new(-0.5, -1.0, 0.1);
    close(
        emitted(&loaded, right).map(|v| v / factor),
        [0.125, 0.5, 1.0],
    );
    let error = load_from(directory.path(), "", &body.replace("90", "900")).unwrap_err();
    assert!(error.contains("'fov' is 900"), "{error}");
    let scaled = body.replace("<lookat", "<scale value=\"1, 2, 1\"/><lookat");
    let error = load_from(directory.path(), "", &scaled).unwrap_err();
    assert!(
        error.contains("a projector can only be rotated, mirrored and scaled evenly"),
        "{error}"
    );
}

#[test]
fn roughness_from_images() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &[[0.25; 3], [0.5; 3]]);
    let nearest = r#"<string name="filename" value="image.png"/>
<string name="filter_type" value="nearest"/><boolean name="raw" value="true"/>"#;
    let texture = format!(r#"<texture name="alpha" type="bitmap">{nearest}</texture>"#);
    for kind in ["roughconductor", "roughdielectric", "roughplastic"] {
        let value = |alpha: &str, u: f64| {
            let body = shape(&format!(r#"<bsdf type="{kind}">{alpha}</bsdf>"#));
            let loaded = load_from(directory.path(), "", &body).unwrap_or_else(|e| panic!("{e}"));
            let mut s = Surface::plain(DVec3::Z, 1.0, 1.5);
            s.site.uv = Uv::Plain([u, 0.5]);
            let direction = DVec3::new(0.2, 0.1, 1.0).normalize();
            bsdf(&loaded).eval(&s, DVec3::Z, direction)[0]
        };
        // The numbers in the file, not what they encode.
        let stored = [0.25, 0.5].map(morgana_io::scene::srgb_from_linear);
        for (u, alpha) in [(0.2, stored[0]), (0.8, stored[1])] {
            let even = format!(r#"<float name="alpha" value="{alpha}"/>"#);
            let (found, expected) = (value(&texture, u), value(&even, u));
            assert!(
                (found / expected - 1.0).abs() < 1e-4,
                "{kind}: {found}, {expected}"
            );
        }
    }
    refused(
        &shape(r#"<bsdf type="roughplastic"><float name="alpha" value="2"/></bsdf>"#),
        &["'alpha' is 2"],
    );
}

/// A light inside of a shape.
fn shining(shape: &str, radiance: &str) -> String {
    format!(
        r#"{shape}<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
<emitter type="area">{radiance}</emitter></shape>"#
    )
}

/// Powers over π and area.
fn mean_radiance(loaded: &Loaded) -> [f64; 3] {
    let scene = loaded.scene();
    let area = scene.objects()[0].shape.area();
    let power = scene.powers(3).next().unwrap() / (std::f64::consts::PI * area);
    [power[0], power[1], power[2]]
}

#[test]
fn textures_shine() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let picture = |how: &str| {
        format!(
            r#"<texture name="radiance" type="bitmap"><string name="filename" value="image.png"/>{how}</texture>"#
        )
    };
    let load =
        |shape: &str, radiance: &str| load_from(directory.path(), "", &shining(shape, radiance));
    let loaded = load(r#"<shape type="rectangle">"#, &picture("")).unwrap();
    let mean = [0, 1, 2].map(|c| f64::from(PIXELS[0][c] + PIXELS[1][c]) / 2.0);
    close(mean_radiance(&loaded), mean);
    // Rings of a disk: the inner half has a quarter of the area.
    let nearest = picture(r#"<string name="filter_type" value="nearest"/>"#);
    let loaded = load(r#"<shape type="disk">"#, &nearest).unwrap();
    let rings = [0, 1, 2].map(|c| f64::from(0.25 * PIXELS[0][c] + 0.75 * PIXELS[1][c]));
    close(mean_radiance(&loaded), rings);
    let board = r#"<texture name="radiance" type="checkerboard">
<rgb name="color0" value="4, 0, 1"/><float name="color1" value="0"/></texture>"#;
    let loaded = load(r#"<shape type="sphere">"#, board).unwrap();
    close(mean_radiance(&loaded), [2.0, 0.0, 0.5]);
    fs::write(directory.path().join("t.ply"), PLY).unwrap();
    let mesh = r#"<shape type="ply"><string name="filename" value="t.ply"/>"#;
    let colours = r#"<texture name="radiance" type="mesh_attribute">
<string name="name" value="vertex_color"/></texture>"#;
    let third = morgana_io::scene::linear_from_srgb(128.0 / 255.0) / 3.0;
    let loaded = load(mesh, colours).unwrap();
    close(
        mean_radiance(&loaded),
        [1.0 / 3.0 + third, 1.0 / 3.0 + third, third],
    );
    let squeezed =
        r#"<shape type="sphere"><transform name="to_world"><scale value="1, 1, 2"/></transform>"#;
    for (shape, radiance, expected) in [
        (
            squeezed,
            board,
            "an ellipsoid or elliptic cylinder cannot emit a texture",
        ),
        (mesh, board, "the mesh has no texture coordinates"),
        (
            r#"<shape type="rectangle">"#,
            &board.replace("4, 0, 1", "4, -2, 1"),
            "a radiance of the texture is -2",
        ),
    ] {
        let error = load(shape, radiance).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

const GROUP: &str = r#"<shape type="shapegroup" id="g">
<shape type="ply"><string name="filename" value="t.ply"/><transform name="to_world"><scale value="2"/></transform>
<bsdf type="diffuse"><texture name="reflectance" type="mesh_attribute"><string name="name" value="vertex_color"/></texture></bsdf>
</shape><shape type="sphere"/></shape>"#;

#[test]
fn instances_are_copies() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("t.ply"), PLY).unwrap();
    let instance = |x: f64| {
        format!(
            r#"<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="{x}"/></transform></shape>"#
        )
    };
    let body = format!("{GROUP}{}{}", instance(1.0), instance(-4.0));
    let loaded = load_from(directory.path(), "", &body).unwrap_or_else(|e| panic!("{e}"));
    let objects = loaded.scene().objects();
    assert_eq!(objects.len(), 4);
    for (k, x) in [(0, 1.0), (2, -4.0)] {
        let mesh = objects[k].shape.aabb();
        assert!((mesh.min.x - x).abs() < 1e-9 && (mesh.max.x - x - 2.0).abs() < 1e-9);
        let ball = objects[k + 1].shape.aabb();
        assert!((ball.center().x - x).abs() < 1e-9);
    }
    // A group alone puts up nothing.
    assert!(
        load_from(directory.path(), "", GROUP)
            .unwrap()
            .scene()
            .objects()
            .is_empty()
    );
    let broken = body.replace("sphere", "spere");
    let error = load_from(directory.path(), "", &broken).unwrap_err();
    assert_eq!(
        error.matches("unknown shape type 'spere'").count(),
        1,
        "{error}"
    );
    refused(
        "<shape type=\"instance\"/>",
        &["an instance needs a shape of type 'shapegroup'"],
    );
    refused(
        "<shape type=\"shapegroup\" id=\"a\"><shape type=\"instance\"/></shape>\
         <shape type=\"instance\"><ref id=\"a\"/></shape>",
        &["a shapegroup holds shapes, not groups or instances"],
    );
}

#[test]
fn serialized_shapes() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/data/meshes/meshes4.serialized"
    );
    let shape = |index: i32| {
        format!(
            "<shape type=\"serialized\"><string name=\"filename\" value=\"{file}\"/>\
             <integer name=\"shape_index\" value=\"{index}\"/></shape>"
        )
    };
    let loaded = load(&shape(1)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.scene().objects()[0].shape.part_areas().len(), 2);
    refused(&shape(2), &["there is no mesh 2"]);
    refused(&shape(-1), &["'shape_index' is -1"]);
}

/// Along the normal, by the formulae of the models.
#[test]
fn older_bsdfs_take_their_parameters() {
    let along = |bsdf_text: &str| {
        let shape = format!(r#"<shape type="rectangle"><bsdf {bsdf_text}</bsdf></shape>"#);
        reflectance(bsdf(&load(&shape).unwrap()), [0.5; 2])[0]
    };
    let passes = 1.0 - (0.5f64 / 2.5).powi(2);
    let cases = [
        (
            r#"type="phong"><float name="exponent" value="6"/>"#,
            0.5 + 0.2 * 4.0,
        ),
        (
            r#"type="phong"><float name="exponent" value="6"/><rgb name="diffuse_reflectance" value="0.8"/><rgb name="specular_reflectance" value="0.8"/>"#,
            0.5 + 0.5 * 4.0,
        ),
        (
            r#"type="ward"><float name="alpha" value="0.5"/>"#,
            0.5 + 0.2,
        ),
        (
            r#"type="ward"><float name="alpha_u" value="0.5"/><float name="alpha_v" value="0.125"/>"#,
            0.5 + 0.2 * 4.0,
        ),
        (
            r#"type="roughdiffuse"><float name="alpha" value="0.4"/>"#,
            0.5 * (1.0 - 0.04 / 0.41) + 0.25 * 0.17 * 0.08 / 0.21,
        ),
        (
            r#"type="roughdiffuse"><float name="alpha" value="0.4"/><boolean name="use_fast_approx" value="true"/>"#,
            0.5 * (1.0 - 0.04 / 0.41),
        ),
        (
            r#"type="coating"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/><bsdf type="diffuse"/>"#,
            0.5 * passes * passes / 2.25,
        ),
        (
            r#"type="coating"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/><float name="sigma_a" value="0.3"/><float name="thickness" value="2"/><bsdf type="diffuse"/>"#,
            0.5 * passes * passes / 2.25 * (-1.2f64).exp(),
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="0.5, 0.25"/><bsdf type="diffuse"/><bsdf type="diffuse"><float name="reflectance" value="0.2"/></bsdf>"#,
            0.3,
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="3 1"/><bsdf type="diffuse"/><bsdf type="diffuse"><float name="reflectance" value="0.1"/></bsdf>"#,
            0.4,
        ),
    ];
    for (text, expected) in cases {
        let found = along(text);
        assert!(
            (found - expected).abs() < 1e-6,
            "{text}: {found} for {expected}"
        );
    }
}

#[test]
fn older_bsdfs_that_are_refused() {
    let shape = |bsdf: &str| format!(r#"<shape type="rectangle"><bsdf {bsdf}</bsdf></shape>"#);
    for (text, expected) in [
        (
            r#"type="mixturebsdf"><string name="weights" value="1, x"/><bsdf type="diffuse"/>"#,
            "numbers ≥ 0",
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="0.5, 0.5"/><bsdf type="diffuse"/>"#,
            "2 nested bsdfs",
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="0.5, 0.5"/><bsdf type="diffuse"/><bsdf type="dielectric"/>"#,
            "let no light through",
        ),
        (
            r#"type="coating"><bsdf type="dielectric"/>"#,
            "let no light through",
        ),
        (r#"type="coating">"#, "one nested bsdf"),
        (
            r#"type="phong"><float name="exponent" value="-1"/>"#,
            "exponent must be finite and ≥ 0",
        ),
        (
            r#"type="roughdiffuse"><float name="alpha" value="-1"/>"#,
            "alpha must be finite and ≥ 0",
        ),
        (r#"type="hk">"#, "thin scattering layer"),
        (r#"type="measured">"#, "measured reflectances"),
        (r#"type="hair">"#, "hairs are not modelled"),
    ] {
        refused(&shape(text), &[expected]);
    }
}

#[test]
fn merged_shapes_are_those_that_it_holds() {
    let pair = "<shape type='merge'><shape type='sphere' id='a'/><shape type='merge'><shape type='cube' id='b'/></shape></shape>";
    let names = |text: &str| {
        let loaded = load(text).unwrap();
        let names = loaded.scene().objects().iter().map(|o| o.name.clone());
        names.collect::<Vec<_>>()
    };
    assert_eq!(names(pair), ["a", "b"]);
    let group = format!("<shape type='shapegroup' id='g'>{pair}</shape>");
    let twice = "<shape type='instance'><ref id='g'/></shape>".repeat(2);
    assert_eq!(names(&format!("{group}{twice}")), ["a", "b", "a", "b"]);
    refused(
        "<shape type='shapegroup' id='g'><shape type='merge'><shape type='instance'/></shape></shape><shape type='instance'><ref id='g'/></shape>",
        &["a shapegroup holds shapes, not groups or instances"],
    );
    refused(
        "<shape type='merge'><float name='radius' value='2'/></shape>",
        &["radius"],
    );
}

#[test]
fn ellipsoids_are_refused() {
    refused(
        "<shape type='ellipsoids'><string name='filename' value='a.ply'/></shape>",
        &["clouds of ellipsoids"],
    );
}
