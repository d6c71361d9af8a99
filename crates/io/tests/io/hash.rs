//! The hash of a scene.

use crate::common::read;
use morgana_io::scene::SceneHash;
use morgana_io::{FileRegistry, SceneDescription};

fn hash(scene: &SceneDescription) -> SceneHash {
    scene.hash(&FileRegistry::new()).unwrap()
}

#[test]
fn layout_order_of_parameters_and_spelling_do_not_matter() {
    let a = read(
        "<shape type='sphere'><float name='a' value='1.0'/><float name='b' value='2'/></shape>",
    );
    let b = read(
        "<!-- the same --><shape  type='sphere'><float value='2e0' name='b'/>\n
         <float name='a' value='1'/></shape>",
    );
    assert_eq!(hash(&a), hash(&b));
    assert_eq!(hash(&a).to_string().len(), 64);
}

#[test]
fn every_part_of_the_description_matters() {
    let scenes = [
        "<shape type='sphere'><float name='a' value='1'/></shape>",
        "<shape type='sphere'><float name='a' value='2'/></shape>",
        "<shape type='sphere'><float name='b' value='1'/></shape>",
        "<shape type='sphere'><rgb name='a' value='1'/></shape>",
        "<shape type='sphere'><boolean name='a' value='true'/></shape>",
        "<shape type='sphere'><string name='a' value='1'/></shape>",
        "<shape type='sphere'><spectrum name='a' value='500:1'/></shape>",
        "<shape type='sphere'><spectrum name='a' value='501:1'/></shape>",
        "<shape type='cube'><float name='a' value='1'/></shape>",
        "<bsdf type='sphere'><float name='a' value='1'/></bsdf>",
        "<shape type='sphere' id='x'><float name='a' value='1'/></shape>",
        "<shape type='sphere' name='x'><float name='a' value='1'/></shape>",
        "<shape type='sphere'><point name='a' value='1'/></shape>",
        "<shape type='sphere'><bsdf name='x' type='null'/></shape>",
        "<shape type='sphere'><bsdf type='null'/></shape>",
        "<shape type='sphere'><transform name='a'/></shape>",
        "<shape type='sphere'/><shape type='sphere'/>",
        "<shape type='sphere' id='x'/><ref id='x'/>",
    ];
    let hashes: std::collections::HashSet<_> = scenes.iter().map(|s| hash(&read(s))).collect();
    assert_eq!(hashes.len(), scenes.len());
}

#[test]
fn what_no_plugin_tells_apart_is_the_same() {
    let same = |values: &[&str]| {
        let shapes = values
            .iter()
            .map(|v| format!("<shape type='sphere'>{v}</shape>"));
        let hashes: std::collections::HashSet<_> = shapes.map(|s| hash(&read(&s))).collect();
        assert_eq!(hashes.len(), 1, "{values:?}");
    };
    same(&[
        "<float name='a' value='1'/>",
        "<integer name='a' value='1'/>",
    ]);
    same(&[
        "<float name='a' value='0'/>",
        "<float name='a' value='-0'/>",
    ]);
    same(&[
        "<point name='a' value='1'/>",
        "<vector name='a' value='1'/>",
    ]);
    same(&[
        "<bsdf type='null'/>",
        "<bsdf name='bsdf' type='null'/>",
        "<bsdf name='bsdf_1' type='null'/>",
    ]);
}

#[test]
fn contents_of_data_files_matter_but_not_where_they_lie() {
    let scene = read("<shape type='sphere'/>");
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let hash_in = |folder: &tempfile::TempDir, content: &str| {
        let path = folder.path().join("a.vol");
        std::fs::write(&path, content).unwrap();
        let mut files = FileRegistry::new();
        files.add(path, "a.vol");
        scene.hash(&files).unwrap()
    };
    assert_eq!(hash_in(&folders[0], "one"), hash_in(&folders[1], "one"));
    assert_ne!(hash_in(&folders[0], "one"), hash_in(&folders[0], "two"));
}

#[test]
fn a_data_file_that_is_gone_is_an_error() {
    let mut files = FileRegistry::new();
    files.add("no/such/file.vol".into(), "file.vol");
    let error = read("").hash(&files).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("no/such/file.vol: cannot read: "),
        "{error}"
    );
}

#[test]
fn shared_objects_are_hashed_once() {
    // Expanded, the scene has 2^60 media. It is allowed, because each shared medium is made once.
    let mut text = "<medium type='x' id='b0'/>".to_owned();
    for i in 1..60 {
        let below = i - 1;
        text += &format!(
            "<medium type='x' id='b{i}'><ref id='b{below}'/><ref id='b{below}'/></medium>"
        );
    }
    hash(&read(&text));
}
