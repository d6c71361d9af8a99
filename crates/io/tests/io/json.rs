//! Scenes in JSON: equality with scenes in XML, by their hashes; values, references, parameters;
//! JSON Schema.

use crate::common;
use morgana_io::scene::{SceneHash, Value};
use morgana_io::{
    Diagnostics, FileRegistry, Limits, PluginKind, SceneDescription, SpectrumValue, json, xml,
};
use std::path::{Path, PathBuf};

fn hash(scene: &SceneDescription) -> SceneHash {
    scene.hash(&FileRegistry::new()).unwrap()
}

/// Reads a scene; panics if there is any message.
fn read_with(text: &str, overrides: &[(&str, &str)]) -> SceneDescription {
    let overrides = overrides
        .iter()
        .map(|(n, v)| (n.to_string(), v.to_string()));
    let overrides: Vec<_> = overrides.collect();
    let mut diagnostics = Diagnostics::new();
    let scene = json::parse(text, "scene.json", &overrides, &mut diagnostics);
    assert!(diagnostics.is_empty(), "{diagnostics}");
    scene.expect("no error")
}

fn read(contents: &str) -> SceneDescription {
    read_with(&format!("{{\"type\": \"scene\", {contents}}}"), &[])
}

/// The value of a parameter `x` of a shape.
fn value(text: &str) -> Value {
    let scene = read(&format!("\"a\": {{\"type\": \"sphere\", \"x\": {text}}}"));
    common::value(&scene.root.children[0].object, "x").clone()
}

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = std::fs::read_dir(folder).unwrap();
    let files = files.map(|entry| entry.unwrap().path());
    let scenes: Vec<_> = files
        .filter(|f| f.extension().is_some_and(|e| e == "xml"))
        .collect();
    assert!(scenes.len() >= 9);
    scenes
}

fn from_xml(path: &Path) -> SceneDescription {
    let mut diagnostics = Diagnostics::new();
    let scene = xml::load(path, &[], &mut diagnostics);
    scene.unwrap_or_else(|| panic!("{diagnostics}"))
}

#[test]
fn every_example_scene_survives_the_round_trip() {
    for path in scenes() {
        let scene = from_xml(&path);
        let text = json::write(&scene);
        let again = read_with(&text, &[]);
        assert_eq!(hash(&again), hash(&scene), "{}\n{text}", path.display());
        assert_eq!(json::write(&again), text, "{}", path.display());
    }
}

/// The JSON scene was converted by hand.
#[test]
fn a_scene_in_either_language_is_the_same() {
    for name in ["luneburg_fog", "aquarium_laser"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.xml"));
        let text = format!("{}/tests/data/json/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let mut diagnostics = Diagnostics::new();
        let scene = json::load(Path::new(&text), &[], Limits::default(), &mut diagnostics);
        let scene = scene.unwrap_or_else(|| panic!("{diagnostics}"));
        let twin = from_xml(&path);
        assert_eq!(json::write(&scene), json::write(&twin), "{name}");
        assert_eq!(hash(&scene), hash(&twin), "{name}");
        assert_eq!(scene.parameters.len(), twin.parameters.len(), "{name}");
    }
}

#[test]
fn an_example_is_assembled_from_either_language() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let options = morgana_io::LoadOptions::default();
    let load =
        |path: &Path| morgana_io::load_scene(path, &options).unwrap_or_else(|d| panic!("{d}"));
    let json = load(&folder.join("tests/data/json/luneburg_fog.json"));
    let xml = load(&folder.join("../../scenes/luneburg_fog.xml"));
    assert_eq!(json.hash, xml.hash);
    assert_eq!(json.samples, 40);
}

/// The manual's first scenes in XML and JSON are equal.
#[test]
fn the_manual_is_right() {
    let manual = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scene-format.md");
    let manual = std::fs::read_to_string(manual).unwrap();
    let block = |language: &str| {
        let (_, rest) = manual.split_once(&format!("```{language}\n")).unwrap();
        rest.split_once("```").unwrap().0.to_owned()
    };
    let mut diagnostics = Diagnostics::new();
    let twin = xml::parse(&block("xml"), "scene.xml", &[], &mut diagnostics);
    let twin = twin.unwrap_or_else(|| panic!("{diagnostics}"));
    let scene = read_with(&block("json"), &[]);
    assert_eq!(json::write(&scene), json::write(&twin));
    assert_eq!(hash(&scene), hash(&twin));
}

#[test]
fn values() {
    assert_eq!(value("2"), Value::Integer(2));
    assert_eq!(value("2.0"), Value::Integer(2));
    assert_eq!(value("1e3"), Value::Integer(1000));
    assert_eq!(value("-2.5e-1"), Value::Float(-0.25));
    assert_eq!(value("true"), Value::Boolean(true));
    assert_eq!(value(r#""\u00e9\n\"""#), Value::String("é\n\"".into()));
    assert_eq!(value("[1, 2, 3.5]"), Value::Point([1.0, 2.0, 3.5].into()));
    let spectrum = |text: &str| match value(text) {
        Value::Spectrum(spectrum) => spectrum,
        other => panic!("{other:?}"),
    };
    let rgb = |text: &str| spectrum(&format!("{{\"type\": \"rgb\", \"value\": {text}}}"));
    assert_eq!(rgb("[0.1, 0.2, 0.3]"), SpectrumValue::Rgb([0.1, 0.2, 0.3]));
    assert_eq!(rgb("0.5"), SpectrumValue::Rgb([0.5; 3]));
    assert_eq!(rgb("\"#ff00FF\""), SpectrumValue::Rgb([1.0, 0.0, 1.0]));
    let pairs = spectrum(r#"{"type": "spectrum", "value": [[400, 0.1], [700.5, 2]]}"#);
    assert_eq!(
        pairs,
        SpectrumValue::Sampled(vec![(400.0, 0.1), (700.5, 2.0)])
    );
    let number = spectrum(r#"{"value": 3, "type": "spectrum"}"#);
    assert_eq!(number, SpectrumValue::EqualEnergy(3.0));
}

/// Transforms agree with transforms of XML.
#[test]
fn transforms() {
    let xml = |parts: &str| {
        let text = format!("<shape type='sphere'><transform name='x'>{parts}</transform></shape>");
        common::value(&common::object(&text), "x").clone()
    };
    for (json, parts) in [
        ("[]", ""),
        (
            r#"[{"translate": [1, 2, 3]}]"#,
            "<translate value='1, 2, 3'/>",
        ),
        (
            r#"[{"scale": 2}, {"scale": [1, 2, -3]}, {"rotate": {"axis": [0, 0.6, 0.8], "angle": 30}}]"#,
            "<scale value='2'/><scale x='1' y='2' z='-3'/><rotate y='0.6' z='0.8' angle='30'/>",
        ),
        (
            r#"[{"lookat": {"origin": [1, 2, 3], "target": [0, 0, 0]}}]"#,
            "<lookat origin='1 2 3' target='0 0 0'/>",
        ),
        (
            r#"[{"lookat": {"origin": [1, 2, 3], "target": [0, 0, 0], "up": [0, 1, 0]}}]"#,
            "<lookat origin='1 2 3' target='0 0 0' up='0 1 0'/>",
        ),
        (
            "[[1, 2, 3], [4, 5, 6], [7, 8, 10]]",
            "<matrix value='1 2 3 4 5 6 7 8 10'/>",
        ),
        (
            "[[1, 2, 3, 4], [0, 1, 6, 7], [0, 0, 1, 5], [0, 0, 0, 1]]",
            "<matrix value='1 2 3 4 0 1 6 7 0 0 1 5 0 0 0 1'/>",
        ),
        (
            r#"[{"matrix": [[1, 2, 3], [4, 5, 6], [7, 8, 10]]}, {"translate": [0, 0, 1]}]"#,
            "<matrix value='1 2 3 4 5 6 7 8 10'/><translate z='1'/>",
        ),
    ] {
        assert_eq!(value(json), xml(parts), "{json}");
    }
}

#[test]
fn kinds_follow_from_types_places_and_keys() {
    let scene = read(
        r#"
        "sky": {"type": "constant"},
        "volume": {"type": "constant", "id": "glass", "value": 1.5},
        "lens": {
            "type": "sphere",
            "skin": {"type": "null"},
            "interior": {
                "type": "transparent",
                "ior": {"type": "sum", "x": {"type": "gaussian"}, "y": {"type": "constant"}}
            }
        },
        "eye": {"type": "perspective", "film": {"type": "hdrfilm", "f": {"type": "gaussian"}},
                "sampler": {"type": "halton"}}"#,
    );
    let kinds: Vec<_> = scene.root.children.iter().map(|c| c.object.kind).collect();
    use PluginKind::{Bsdf, Emitter, Medium, Rfilter, Sampler, Sensor, Shape, Volume};
    assert_eq!(kinds, [Emitter, Volume, Shape, Sensor]);
    let child = |o: &morgana_io::ObjectDescription, i: usize| o.children[i].object.clone();
    let lens = child(&scene.root, 2);
    let medium = child(&lens, 1);
    assert_eq!([child(&lens, 0).kind, medium.kind], [Bsdf, Medium]);
    let sum = child(&medium, 0);
    assert_eq!([child(&sum, 0).kind, child(&sum, 1).kind], [Volume, Volume]);
    let eye = child(&scene.root, 3);
    assert_eq!(child(&child(&eye, 0), 0).kind, Rfilter);
    assert_eq!(child(&eye, 1).kind, Sampler);
}

#[test]
fn keys_are_ids_and_roles_unless_they_only_say_the_kind() {
    let scene = read(
        r#"
        "ball": {"type": "sphere", "bsdf_2": {"type": "null"}, "paint": {"type": "diffuse"}},
        "shape": {"type": "sphere"},
        "key": {"type": "sphere", "id": "other"},
        "medium_7": {"type": "ref", "id": "shape"}"#,
    );
    let ids: Vec<_> = scene
        .root
        .children
        .iter()
        .map(|c| c.object.id.as_deref())
        .collect();
    assert_eq!(ids, [Some("ball"), None, Some("other"), None]);
    assert_eq!(
        scene.root.children[3].object.number,
        scene.root.children[1].object.number
    );
    let ball = &scene.root.children[0].object;
    let names: Vec<_> = ball.children.iter().map(|c| c.name.as_deref()).collect();
    assert_eq!(names, [None, Some("paint")]);
}

#[test]
fn parameters() {
    let text = r#"{
        "type": "scene", "$schema": "schema.json",
        "parameters": {"r": 2, "where": ["$r", 0, 1], "name": "a", "path": "${name}/b", "on": true},
        "a": {"type": "sphere", "radius": "$r", "center": "$where", "minus": [0, "-$r", "${r}e1"],
              "file": "x/$path.npy", "after": "µ$path", "text": "$name", "flip_normals": "${on}", "cost": "5 $"}
    }"#;
    let get = |scene: &SceneDescription, name: &str| {
        common::value(&scene.root.children[0].object, name).clone()
    };
    let scene = read_with(text, &[]);
    assert_eq!(get(&scene, "radius"), Value::Integer(2));
    assert_eq!(get(&scene, "center"), Value::Point([2.0, 0.0, 1.0].into()));
    assert_eq!(get(&scene, "minus"), Value::Point([0.0, -2.0, 20.0].into()));
    assert_eq!(get(&scene, "file"), Value::String("x/a/b.npy".into()));
    assert_eq!(get(&scene, "after"), Value::String("µa/b".into()));
    assert_eq!(get(&scene, "flip_normals"), Value::Boolean(true));
    assert_eq!(get(&scene, "cost"), Value::String("5 $".into()));
    let scene = read_with(text, &[("r", "0.5"), ("name", "7"), ("on", "false")]);
    assert_eq!(get(&scene, "radius"), Value::Float(0.5));
    assert_eq!(get(&scene, "center"), Value::Point([0.5, 0.0, 1.0].into()));
    assert_eq!(get(&scene, "text"), Value::String("7".into()));
    assert_eq!(get(&scene, "flip_normals"), Value::Boolean(false));
    let values = [
        ("name", "7"),
        ("on", "false"),
        ("path", "7/b"),
        ("r", "0.5"),
        ("where", "[0.5, 0, 1]"),
    ];
    let values = values.map(|(n, v)| (n.to_owned(), v.to_owned()));
    assert_eq!(scene.parameters, values);
}

#[test]
fn lists_may_be_arrays() {
    let film = |wavelengths: &str| {
        let text = format!(
            "\"s\": {{\"type\": \"perspective\", \"film\": {{\"type\": \"hdrfilm\", \"wavelengths\": {wavelengths}}}}}"
        );
        let scene = read(&text);
        common::value(
            &scene.root.children[0].object.children[0].object,
            "wavelengths",
        )
        .clone()
    };
    assert_eq!(
        film("[450, 532.5, 650]"),
        Value::String("450, 532.5, 650".into())
    );
    assert_eq!(film("550"), Value::String("550".into()));
}

#[test]
fn a_byte_order_mark_is_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    std::fs::write(&path, "\u{feff}{\"type\": \"scene\"}").unwrap();
    let mut diagnostics = Diagnostics::new();
    assert!(json::load(&path, &[], Limits::default(), &mut diagnostics).is_some());
    std::fs::write(&path, b"{\"type\": \"\xff\"}").unwrap();
    assert!(json::load(&path, &[], Limits::default(), &mut diagnostics).is_none());
    assert!(
        diagnostics
            .to_string()
            .contains("scene.json:1: not UTF-8 text")
    );
}

/// Returns `line:column message | help` for each mistake.
fn mistakes_with(text: &str, overrides: &[(String, String)]) -> Vec<String> {
    let mut diagnostics = Diagnostics::new();
    assert!(
        json::parse(text, "scene.json", overrides, &mut diagnostics).is_none(),
        "{text}"
    );
    let describe = |d: &morgana_io::Diagnostic| {
        let help = d.help.as_deref().unwrap_or("");
        let place = d.location.as_ref();
        let place = place.map(|at| format!("{}:{} ", at.line(), at.column()));
        format!("{}{} | {help}", place.unwrap_or_default(), d.message)
    };
    diagnostics.iter().map(describe).collect()
}

/// Asserts the mistake in a value of a shape, which begins at line 1, column 1 of its own text.
#[track_caller]
fn bad(value: &str, expected: &str) {
    let text = format!("{{\"type\": \"scene\", \"a\": {{\"type\": \"sphere\", \"x\":\n{value}}}}}");
    assert_eq!(mistakes_with(&text, &[]), [expected], "{value}");
}

#[test]
fn mistakes_in_syntax() {
    for (text, expected) in [
        ("", "1:1 invalid JSON: the file is empty | "),
        (
            "{\"type\": \"scene\",}",
            "1:17 invalid JSON: trailing commas are not allowed | ",
        ),
        (
            "{\"type\": \"scene\"",
            "1:1 invalid JSON: unterminated object | ",
        ),
        (
            "{\n\"a\": 1 // x\n}",
            "2:8 invalid JSON: comments are not allowed | ",
        ),
        (
            "{'a': 1}",
            "1:2 invalid JSON: single-quoted strings are not allowed | ",
        ),
        (
            "{} {}",
            "1:4 invalid JSON: text cannot contain more than one JSON value | ",
        ),
        ("[1]", "1:1 expected an object, found an array | "),
        ("{}", "1:1 this object needs a \"type\" | "),
        ("{\"type\": 3}", "1:10 \"type\" is a text, not a number | "),
        (
            "{\"type\": \"sphere\"}",
            "1:10 expected \"type\": \"scene\", found \"sphere\" | ",
        ),
        (
            "{\"type\": \"scene\", \"a\": {\"type\": \"sphere\"},\n \"a\": {\"type\": \"cube\"}}",
            "2:2 the key \"a\" occurs twice | the first is at scene.json:1:19",
        ),
    ] {
        assert_eq!(mistakes_with(text, &[]), [expected], "{text}");
    }
    let deep = "[".repeat(100_000);
    assert!(mistakes_with(&deep, &[])[0].contains("nesting"));
    let nested = |depth: usize| {
        let open = "\"a\": {\"type\": \"sphere\", ".repeat(depth);
        format!(
            "{{\"type\": \"scene\", {open} \"b\": 1 {}}}",
            "}".repeat(depth)
        )
    };
    read_with(&nested(60), &[]);
    assert!(mistakes_with(&nested(100), &[])[0].contains("objects are nested too deeply"));
}

#[test]
fn mistakes_in_values() {
    bad("null", "2:1 null is not a value: leave the key out | ");
    bad("[1, 2]", "2:1 expected three numbers, found 2 | ");
    bad("[1, 2, \"3\"]", "2:8 expected a number, found a text | ");
    bad("1e999", "2:1 '1e999' is not a finite number | ");
    bad("{\"a\": 1}", "2:1 this object needs a \"type\" | ");
    bad(
        r##"{"type": "rgb", "value": "#12345"}"##,
        "2:26 '#12345' is not a colour like #ff8800 | ",
    );
    bad(
        r#"{"type": "rgb"}"#,
        "2:1 a colour or spectrum needs a \"value\" | ",
    );
    bad(
        r#"{"type": "spectrum", "value": 1, "valeu": 1}"#,
        "2:34 \"valeu\" has no meaning here | did you mean 'value'?",
    );
    bad(
        r#"{"type": "spectrum", "value": [[500, 1], [400, 1]]}"#,
        "2:42 wavelengths must increase: 400 after 500 | ",
    );
    bad(
        "[[1, 2], [3, 4]]",
        "2:1 expected a matrix: 4 rows of 4 numbers, or 3 rows of 3 | ",
    );
    bad(
        "[[1, 0, 0], [0, 1, 0], [0, 0, 0]]",
        "2:1 the matrix cannot be inverted | ",
    );
    bad(
        r#"[{"look_at": {}}]"#,
        "2:3 a transform cannot contain \"look_at\" | did you mean 'lookat'?",
    );
    bad(
        r#"[{"rotate": {"axis": [0, 0, 1]}}]"#,
        "2:13 \"angle\" is missing | ",
    );
    bad(
        r#"[{"scale": [1, 0, 1]}]"#,
        "2:12 a scale of zero cannot be undone | ",
    );
}

#[test]
fn mistakes_in_objects() {
    bad(
        r#"{"type": "spere"}"#,
        "2:10 unknown type 'spere' | did you mean 'sphere'?",
    );
    bad(
        r#"{"type": "gaussian"}"#,
        "2:10 'gaussian' may be of several kinds: \"rfilter\", \"volume\" | say which by the key: the \
         kind, with a number if need be, such as \"volume_2\"",
    );
    bad(
        r#"{"type": "ref", "id": "nobody"}"#,
        "2:23 no object has the id 'nobody' | ",
    );
    let twice = r#"{"type": "scene", "a": {"type": "sphere"}, "b": {"type": "cube", "id": "a"}}"#;
    assert_eq!(
        mistakes_with(twice, &[]),
        ["1:72 the id 'a' is taken | the first object with this id is at scene.json:1:19"]
    );
}

#[test]
fn mistakes_in_parameters() {
    let text = "{\"type\": \"scene\", \"parameters\": {\"radius\": 1},\n\"a\": {\"type\": \"sphere\", \"radius\": \"$radus\"}}";
    assert_eq!(
        mistakes_with(text, &[]),
        ["2:35 parameter '$radus' is not defined | did you mean 'radius'?"]
    );
    let text = text.replace("radus", "radius");
    let set = |name: &str, value: &str| vec![(name.to_owned(), value.to_owned())];
    assert_eq!(
        mistakes_with(&text, &set("radius", "big")),
        ["1:44 -D radius=big: expected a value like 1 | "]
    );
    assert_eq!(
        mistakes_with(&text, &set("radios", "1")),
        ["the scene has no parameter 'radios' (given as -D radios=...) | did you mean 'radius'?"]
    );
}

/// Messages about a JSON file do not use XML terms.
#[test]
fn messages_are_in_the_language_of_the_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.json");
    let text = r#"{"type": "scene", "emitter": {"type": "point", "intensity": "1"},
"ball": {"type": "sphere", "radius": true, "film": {"type": "hdrfilm"}, "interior": {"type": "homogeneous", "phase": {"type": "vmf"}}}}"#;
    std::fs::write(&path, text).unwrap();
    let error = morgana_io::load_scene(&path, &morgana_io::LoadOptions::default()).unwrap_err();
    let error = error.to_string();
    for part in [
        "'radius': expected float, found boolean",
        r#"{"type": "sphere"} takes no film here"#,
        r#"{"type": "vmf"} needs "kappa" (float)"#,
    ] {
        assert!(error.contains(part), "expected {part:?} in:\n{error}");
    }
    let messages = error.lines().filter(|line| line.starts_with("error"));
    assert!(messages.clone().count() >= 4);
    assert!(messages.clone().all(|line| !line.contains('<')), "{error}");
}

/// The kind of a plugin that morgana does not have is not known in JSON; the advice is.
#[test]
fn plugins_that_only_mitsuba_has_are_refused_with_advice() {
    for (plugin, advice) in [
        ("timed_sunsky", "use 'sunsky'"),
        ("ellipsoids", "an ellipsoid is a 'sphere'"),
        ("ellipsoidsmesh", "an ellipsoid is a 'sphere'"),
        ("blender", "'ply'"),
        ("measured", "'principled'"),
        ("measured_polarized", "'principled'"),
        ("specfilm", "'hdrfilm'"),
    ] {
        let text = format!("{{\"type\": \"scene\", \"a\": {{\"type\": \"{plugin}\"}}}}");
        let mut diagnostics = Diagnostics::new();
        json::parse(&text, "scene.json", &[], &mut diagnostics);
        let message = diagnostics.to_string();
        assert!(
            message.contains(&format!("unknown type '{plugin}'")),
            "{message}"
        );
        assert!(message.contains(advice), "{plugin}: {message}");
    }
}
