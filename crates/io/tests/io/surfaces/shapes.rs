//! Shapes from files, groups and instances.

use super::support::*;
use std::fs;

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
    // A group alone adds no shape.
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
        &["a shapegroup must contain shapes, not groups or instances"],
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
        &["a shapegroup must contain shapes, not groups or instances"],
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
        &["Gaussian splats are not read"],
    );
}
