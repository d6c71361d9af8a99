//! Emitters from files, and lights with textures.

use super::support::*;
use glam::DVec3;
use morgana_io::Loaded;
use std::fs;

const IES: &str = "IESNA:LM-63-2002\n[MANUFAC] nobody\nTILT=NONE\n1 1000 2 3 2 1 1 0.1 0.1 0.1\n1 1 50\n\
    0 45 90\n0 90\n100 50 0\n200 100 0\n";

#[test]
fn photometric_files() {
    let light = morgana_io::ies::parse(IES.as_bytes()).unwrap();
    assert_eq!(light.vertical, [0.0, 45.0, 90.0]);
    // A quarter of the full turn, mirrored twice, times the multiplier 2.
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
            "not supported: TILT=LIGHT.TLT, a tilt in another file: include it, or use TILT=NONE",
        ),
        ("TILT=NONE", "", "there is no line TILT="),
        (
            "3 2 1 1",
            "3 2 2 1",
            "not supported: photometry of type A or B: convert it to type C",
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
        Emitter::Spot(spot) => spot.intensity(direction),
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
fn spots_throw_textures() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let body = r#"<emitter type="spot">
<transform name="to_world"><lookat origin="0, 3, 0" target="0, 0, 0" up="0, 0, 1"/></transform>
<float name="intensity" value="4"/><float name="cutoff_angle" value="60"/><float name="beam_width" value="30"/>
<texture name="texture" type="bitmap"><string name="filename" value="image.png"/>
<string name="filter_type" value="nearest"/></texture></emitter>"#;
    let load = |body: &str| load_from(directory.path(), "", body);
    let loaded = load(body).unwrap();
    // u runs along local +x, which is world +x. Probe within the beam's width, and halfway between
    // it and the cutoff.
    let at = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        emitted(&loaded, DVec3::new(sin, -cos, 0.0))
    };
    close(at(-20.0), PIXELS[0].map(|v| 4.0 * f64::from(v)));
    close(at(20.0), PIXELS[1].map(|v| 4.0 * f64::from(v)));
    close(at(45.0), PIXELS[1].map(|v| 2.0 * f64::from(v)));
    close(at(61.0), [0.0; 3]);
    for (from, to, expected) in [
        (
            "<lookat",
            "<scale value=\"1, 2, 1\"/><lookat",
            "a spot with a texture can only be rotated",
        ),
        (
            "\"60\"",
            "\"90\"",
            "a spot that throws a texture needs a cutoff_angle below 90",
        ),
    ] {
        let error = load(&body.replace(from, to)).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

/// A light inside a shape.
fn shining(shape: &str, radiance: &str) -> String {
    format!(
        r#"{shape}<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
<emitter type="area">{radiance}</emitter></shape>"#
    )
}

/// Powers divided by π and the area.
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
