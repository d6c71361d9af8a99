//! Valid scene files, and their meaning.

use crate::common::{child, object, read, value};
use glam::{DMat4, DVec3, DVec4};
use morgana_io::scene::Value;
use morgana_io::{Diagnostics, PluginKind, SpectrumValue, xml};

fn data(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn transform(parts: &str) -> DMat4 {
    let text = format!("<shape type='cube'><transform name='t'>{parts}</transform></shape>");
    match value(&object(&text), "t") {
        Value::Transform(matrix) => *matrix,
        other => panic!("{other:?}"),
    }
}

fn assert_maps(matrix: DMat4, from: DVec3, to: DVec3) {
    let image = matrix.transform_point3(from);
    assert!(
        image.distance(to) < 1e-12,
        "{from} -> {image}, expected {to}"
    );
}

#[test]
fn the_reference_scenes_are_read() {
    for (name, objects) in [
        ("p1_fog_cube.xml", 5),
        ("p2_milk_ball.xml", 5),
        ("p3_cornell.xml", 13),
        ("p4_rough_glass.xml", 7),
        ("p5_het_smoke.xml", 5),
    ] {
        let mut diagnostics = Diagnostics::new();
        let scene = xml::load(&data(name), &[], &mut diagnostics);
        assert!(diagnostics.is_empty(), "{name}: {diagnostics}");
        assert_eq!(scene.unwrap().root.children.len(), objects, "{name}");
    }
}

#[test]
fn a_medium_referenced_twice_is_one_object() {
    let mut diagnostics = Diagnostics::new();
    let scene = xml::load(&data("p1_fog_cube.xml"), &[], &mut diagnostics).unwrap();
    let medium = child(&scene.root, PluginKind::Medium);
    let inside = child(child(&scene.root, PluginKind::Shape), PluginKind::Medium);
    let around = child(child(&scene.root, PluginKind::Emitter), PluginKind::Medium);
    assert_eq!(medium.number, inside.number);
    assert_eq!(medium.number, around.number);
    assert!(std::sync::Arc::ptr_eq(inside, around));
    let shape = child(&scene.root, PluginKind::Shape);
    assert_eq!(shape.children[1].name.as_deref(), Some("interior"));
}

#[test]
fn every_kind_of_value() {
    let object = object(
        r##"<shape type="x"><float name="f" value="1.5e2"/><integer name="i" value="-3"/>
        <boolean name="b" value="true"/><string name="s" value="a &amp; b"/>
        <rgb name="c" value="0.1, 0.2 0.3"/><rgb name="grey" value="0.5"/>
        <rgb name="hex" value="#ff0080"/><spectrum name="u" value="2"/>
        <spectrum name="w" value="400:0.1, 500:0.2"/><point name="p" x="1" z="3"/>
        <vector name="v" value="1, 2, 3"/></shape>"##,
    );
    assert_eq!(value(&object, "f"), &Value::Float(150.0));
    assert_eq!(value(&object, "i"), &Value::Integer(-3));
    assert_eq!(value(&object, "b"), &Value::Boolean(true));
    assert_eq!(value(&object, "s"), &Value::String("a & b".into()));
    let rgb = |rgb| Value::Spectrum(SpectrumValue::Rgb(rgb));
    assert_eq!(value(&object, "c"), &rgb([0.1, 0.2, 0.3]));
    assert_eq!(value(&object, "grey"), &rgb([0.5; 3]));
    let Value::Spectrum(SpectrumValue::Rgb([r, g, b])) = value(&object, "hex") else {
        panic!()
    };
    assert_eq!((*r, *g), (1.0, 0.0));
    // 0x80 = 128: ((128/255 + 0.055)/1.055)^2.4.
    assert!((b - 0.215_860_500_113_899).abs() < 1e-12);
    assert_eq!(
        value(&object, "u"),
        &Value::Spectrum(SpectrumValue::EqualEnergy(2.0))
    );
    let pairs = vec![(400.0, 0.1), (500.0, 0.2)];
    assert_eq!(
        value(&object, "w"),
        &Value::Spectrum(SpectrumValue::Sampled(pairs))
    );
    assert_eq!(
        value(&object, "p"),
        &Value::Point(DVec3::new(1.0, 0.0, 3.0))
    );
    assert_eq!(
        value(&object, "v"),
        &Value::Vector(DVec3::new(1.0, 2.0, 3.0))
    );
}

#[test]
fn the_first_transform_acts_first() {
    let matrix = transform("<scale value='2'/><translate x='1'/>");
    assert_maps(matrix, DVec3::X, DVec3::new(3.0, 0.0, 0.0));
    let matrix = transform("<translate x='1'/><scale value='2'/>");
    assert_maps(matrix, DVec3::X, DVec3::new(4.0, 0.0, 0.0));
}

#[test]
fn rotations_are_right_handed_and_in_degrees() {
    let matrix = transform("<rotate z='1' angle='90'/>");
    assert_maps(matrix, DVec3::X, DVec3::Y);
    let matrix = transform("<rotate value='1, 0, 0' angle='90'/>");
    assert_maps(matrix, DVec3::Y, DVec3::Z);
}

#[test]
fn axes_of_rotations_have_any_length() {
    let turn = "<transform name='t'><rotate x='2' angle='90'/></transform>";
    let text = format!(
        "<scene version='3.0.0'><shape type='cube'>{turn}</shape><shape type='cube'>{turn}</shape></scene>"
    );
    let mut diagnostics = morgana_io::Diagnostics::new();
    let scene = morgana_io::xml::parse(&text, "s.xml", &[], &mut diagnostics).unwrap();
    let Value::Transform(matrix) = value(&scene.root.children[1].object, "t") else {
        panic!("no transform");
    };
    assert_maps(*matrix, DVec3::Y, DVec3::Z);
    assert!(diagnostics.is_empty(), "{diagnostics}");
}

#[test]
fn a_scale_leaves_unnamed_axes_alone() {
    assert_maps(
        transform("<scale y='3'/>"),
        DVec3::ONE,
        DVec3::new(1.0, 3.0, 1.0),
    );
}

#[test]
fn lookat_has_x_to_the_left_and_looks_along_z() {
    let matrix = transform("<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/>");
    // Seen from +z towards the origin with y up, left is -x.
    assert!(matrix.x_axis.distance(DVec4::new(-1.0, 0.0, 0.0, 0.0)) < 1e-15);
    assert!(matrix.y_axis.distance(DVec4::Y) < 1e-15);
    assert!(matrix.z_axis.distance(DVec4::new(0.0, 0.0, -1.0, 0.0)) < 1e-15);
    assert!(matrix.w_axis.distance(DVec4::new(0.0, 0.0, 4.0, 1.0)) < 1e-15);
}

#[test]
fn lookat_keeps_up_in_the_plane_of_view() {
    let matrix = transform("<lookat origin='1,2,3' target='-2,0.5,1' up='0.1,1,0.2'/>");
    let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|a| a.truncate());
    let direction = DVec3::new(-3.0, -1.5, -2.0).normalize();
    let up = DVec3::new(0.1, 1.0, 0.2);
    assert!(axes[2].distance(direction) < 1e-15);
    assert!(axes[0].distance(up.cross(direction).normalize()) < 1e-15);
    assert!(axes[1].dot(up) > 0.0);
    assert!((matrix.determinant() - 1.0).abs() < 1e-14);
}

#[test]
fn lookat_without_up_is_still_a_rotation() {
    let matrix = transform("<lookat origin='0,0,0' target='0,2,0'/>");
    assert!((matrix.determinant() - 1.0).abs() < 1e-14);
    assert!(matrix.z_axis.distance(DVec4::Y) < 1e-15);
}

#[test]
fn matrices_are_written_row_by_row() {
    let matrix = transform("<matrix value='1 0 0 5  0 2 0 6  0 0 3 7  0 0 0 1'/>");
    assert_maps(matrix, DVec3::ONE, DVec3::new(6.0, 8.0, 10.0));
    let matrix = transform("<matrix value='0 1 0  0 0 1  1 0 0'/>");
    assert_maps(matrix, DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 3.0, 1.0));
}

#[test]
fn references_may_come_before_what_they_name_and_go_deep() {
    let scene = read(
        "<ref id='b'/><bsdf type='twosided' id='b'><ref id='inner'/></bsdf>
        <shape type='cube'><bsdf type='diffuse' id='inner'/></shape>",
    );
    let outer = &scene.root.children[0].object;
    let inner = &scene.root.children[2].object.children[0].object;
    assert!(std::sync::Arc::ptr_eq(&outer.children[0].object, inner));
}

#[test]
fn aliases_name_the_same_object() {
    let scene = read("<bsdf type='diffuse' id='a'/><alias id='a' as='b'/><ref id='b'/>");
    assert_eq!(
        scene.root.children[0].object.number,
        scene.root.children[1].object.number
    );
}

#[test]
fn defaults_fill_in_and_overrides_win() {
    let text =
        "<scene version='3.0.0'><default name='n' value='8'/><default name='unit' value='m'/>
        <film type='hdrfilm'><integer name='width' value='$n'/>
        <string name='s' value='${n}x$n $unit$ $5'/></film></scene>";
    let width = |overrides: &[(String, String)]| {
        let mut diagnostics = Diagnostics::new();
        let scene = xml::parse(text, "s.xml", overrides, &mut diagnostics).expect("valid");
        let film = &scene.root.children[0].object;
        (value(film, "width").clone(), value(film, "s").clone())
    };
    let text_value = |s: &str| Value::String(s.into());
    assert_eq!(width(&[]), (Value::Integer(8), text_value("8x8 m$ $5")));
    let overrides = [("n".to_owned(), "16".to_owned())];
    assert_eq!(
        width(&overrides),
        (Value::Integer(16), text_value("16x16 m$ $5"))
    );
}

#[test]
fn included_files_add_their_contents() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    let main = "<scene version='3.0.0'><include filename='parts/a.xml'/><ref id='m'/></scene>";
    std::fs::write(folder.path().join("main.xml"), main).unwrap();
    let a =
        "<scene version='3.0.0'><default name='g' value='0.5'/><include filename='b.xml'/></scene>";
    std::fs::write(folder.path().join("parts/a.xml"), a).unwrap();
    let b = "<medium type='homogeneous' id='m'><float name='g' value='$g'/></medium>";
    std::fs::write(folder.path().join("parts/b.xml"), b).unwrap();
    let mut diagnostics = Diagnostics::new();
    let scene = xml::load(&folder.path().join("main.xml"), &[], &mut diagnostics);
    assert!(diagnostics.is_empty(), "{diagnostics}");
    let scene = scene.unwrap();
    assert_eq!(scene.root.children.len(), 2);
    assert_eq!(
        value(&scene.root.children[1].object, "g"),
        &Value::Float(0.5)
    );
    assert_eq!(scene.parameters, [("g".to_owned(), "0.5".to_owned())]);
}

#[test]
fn a_byte_order_mark_and_comments_are_skipped() {
    let text = "\u{feff}<?xml version='1.0'?><!-- c --><scene version='3.0.0'/>";
    let mut diagnostics = Diagnostics::new();
    assert!(
        xml::parse(text, "s.xml", &[], &mut diagnostics).is_some(),
        "{diagnostics}"
    );
}
