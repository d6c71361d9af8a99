//! `morgana schema`, and scenes in JSON.

use crate::support::Folder;

#[test]
fn the_schema_of_xml_is_xml() {
    let schema = Folder::with_scene("").succeed("schema --format xsd");
    let schema = roxmltree::Document::parse(&schema).unwrap();
    assert_eq!(schema.root_element().tag_name().name(), "schema");
}

#[test]
fn the_schema_is_json() {
    let schema = Folder::with_scene("").succeed("schema");
    let schema: serde_json::Value = serde_json::from_str(&schema).unwrap();
    assert!(schema["$defs"]["shape.sphere"].is_object());
}

#[test]
fn commands_take_scenes_in_json() {
    let folder = Folder::with_scene("");
    let scene = r#"{
        "type": "scene",
        "parameters": {"size": 8},
        "sensor": {
            "type": "perspective", "fov": 40,
            "film": {"type": "hdrfilm", "width": "$size", "height": "$size"},
            "sampler": {"type": "independent", "sample_count": 1}
        },
        "ball": {"type": "sphere", "to_world": [{"translate": [0, 0, 5]}]},
        "sky": {"type": "constant"}
    }"#;
    std::fs::write(folder.path("a.json"), scene).unwrap();
    folder.succeed("render a.json -D size=4 --quiet -o a.npy");
    assert!(folder.path("a.npy").exists());
    assert!(folder.succeed("info a.json").contains("8 × 8"));
    std::fs::write(folder.path("b.json"), scene.replace("fov", "fvo")).unwrap();
    let errors = folder.refuse("info b.json");
    assert!(
        errors.contains("b.json:5:36") && errors.contains("'fvo'"),
        "{errors}"
    );
}
