//! The JSON reader never panics, and a valid scene survives writing and reading.

use crate::common;
use morgana_io::{Diagnostics, FileRegistry, json};
use proptest::prelude::*;
use serde_json::{Map, Value, json};

/// Reads a text; if it is a scene, writes and reads it again. Returns true if it is a scene.
fn exercise(text: &str) -> bool {
    let mut diagnostics = Diagnostics::new();
    // Unused overrides are errors, so pass only used ones.
    let overrides = [("a".to_owned(), "1".to_owned())];
    let used = usize::from(text.contains("$a"));
    let scene = json::parse(text, "scene.json", &overrides[..used], &mut diagnostics);
    assert_eq!(scene.is_none(), diagnostics.has_errors(), "{diagnostics}");
    diagnostics.to_string();
    let Some(scene) = scene else { return false };
    let written = json::write(&scene);
    let again = json::parse(&written, "scene.json", &[], &mut diagnostics);
    let again = again.unwrap_or_else(|| panic!("{diagnostics}\n{written}"));
    let files = FileRegistry::new();
    let hashes = [scene, again].map(|s| s.hash(&files).unwrap());
    assert_eq!(hashes[0], hashes[1], "{text}\n{written}");
    true
}

/// If only the key gives the kind of an object, writing keeps the kind, even for a named object.
#[test]
fn kinds_that_types_do_not_tell() {
    let scene = r#"{"type": "scene", "shape": {"type": "constant", "id": "sky"}}"#;
    assert!(exercise(scene));
}

/// Fragments whose text is often nearly a scene.
fn pieces() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        "\"",
        "\\",
        "\"type\": ",
        "\"scene\"",
        "\"sphere\"",
        "\"rgb\"",
        "\"ref\"",
        "\"a\": {",
        "\"parameters\": {",
        "\"$a\"",
        "\"${a\"",
        "1",
        "-",
        "1e9",
        "0.5",
        "1e999",
        "true",
        "null",
        "\u{0}",
        "é",
        "\\u12",
        "\"\\ud800\"",
        " ",
        "\n",
        "//",
        "/*",
        "NaN",
        "'",
    ]);
    let piece = prop_oneof![9 => known.prop_map(str::to_owned), 1 => ".*"];
    prop::collection::vec(piece, 0..30).prop_map(|pieces| pieces.concat())
}

const KEYS: [&str; 24] = [
    "type",
    "id",
    "value",
    "a",
    "b",
    "shape",
    "shape_2",
    "volume",
    "sensor",
    "film",
    "emitter",
    "bsdf",
    "interior",
    "ior",
    "radius",
    "to_world",
    "wavelengths",
    "translate",
    "scale",
    "rotate",
    "lookat",
    "matrix",
    "axis",
    "parameters",
];
const WORDS: [&str; 20] = [
    "scene",
    "sphere",
    "rgb",
    "spectrum",
    "ref",
    "constant",
    "gaussian",
    "perspective",
    "hdrfilm",
    "homogeneous",
    "sum",
    "null",
    "a",
    "b",
    "shape",
    "#ff8800",
    "$a",
    "x${a}",
    "$",
    "é\"\n",
];

/// Values with keys and words of scenes.
fn value() -> impl Strategy<Value = Value> {
    let plain = prop_oneof![
        1 => Just(Value::Null),
        1 => any::<bool>().prop_map(Value::from),
        2 => (-3i64..9).prop_map(Value::from),
        1 => any::<i64>().prop_map(Value::from),
        2 => any::<f64>().prop_map(Value::from),
        4 => prop::sample::select(WORDS.to_vec()).prop_map(Value::from),
    ];
    plain.prop_recursive(5, 60, 5, |inner| {
        let triple = prop::collection::vec(inner.clone(), 3);
        let items = prop::collection::vec(inner.clone(), 0..5);
        let plugin = prop::sample::select(WORDS.to_vec());
        prop_oneof![
            1 => triple.prop_map(Value::from),
            1 => items.prop_map(Value::from),
            4 => (plugin, entries(inner)).prop_map(|(plugin, mut entries)| {
                entries.insert("type".into(), plugin.into());
                Value::Object(entries)
            }),
        ]
    })
}

fn entries(value: impl Strategy<Value = Value>) -> impl Strategy<Value = Map<String, Value>> {
    let entry = (prop::sample::select(KEYS.to_vec()), value);
    let entries = prop::collection::vec(entry, 0..6);
    entries.prop_map(|entries| {
        entries
            .into_iter()
            .map(|(k, v)| (k.to_owned(), v))
            .collect()
    })
}

/// Values that every reader accepts.
fn valid_value() -> impl Strategy<Value = Value> {
    let near = -1e3..1e3;
    let triple = prop::array::uniform3(near.clone());
    let finite = any::<f64>().prop_filter("finite", |v| v.is_finite());
    let pairs = prop::collection::btree_map(1u32..5000, finite.clone(), 1..5);
    let axis = prop::array::uniform3(1..5).prop_map(|axis| axis.map(f64::from));
    let part = prop_oneof![
        triple.clone().prop_map(|v| json!({"translate": v})),
        (0.1..9.0).prop_map(|v| json!({"scale": v})),
        (axis, near).prop_map(|(axis, angle)| json!({"rotate": {"axis": axis, "angle": angle}})),
        triple
            .clone()
            .prop_map(|v| json!({"lookat": {"origin": v, "target": [2e3, 0, 0]}})),
    ];
    prop_oneof![
        any::<bool>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        finite.clone().prop_map(Value::from),
        "[^$]*".prop_map(Value::from),
        triple.clone().prop_map(|v| json!(v)),
        prop::array::uniform3(finite).prop_map(|v| json!({"type": "rgb", "value": v})),
        pairs.prop_map(|p| json!({"type": "spectrum", "value": p.into_iter().collect::<Vec<_>>()})),
        prop::collection::vec(part, 0..4).prop_map(Value::from),
    ]
}

/// Objects with parameters and children, some of which refer to `first`.
fn valid_object() -> impl Strategy<Value = Value> {
    let types = [
        "sphere",
        "null",
        "hg",
        "homogeneous",
        "perspective",
        "sum",
        "hdrfilm",
        "envmap",
    ];
    let leaf = (
        prop::sample::select(types.to_vec()),
        prop::collection::vec(valid_value(), 0..4),
    );
    let leaf = leaf.prop_map(|(plugin, values)| {
        let mut object = json!({"type": plugin});
        for (i, value) in values.into_iter().enumerate() {
            object[format!("p{i}")] = value;
        }
        object
    });
    leaf.prop_recursive(4, 24, 3, move |inner| {
        let child =
            prop_oneof![3 => inner.clone(), 1 => Just(json!({"type": "ref", "id": "first"}))];
        let keys = [
            "interior", "exterior", "bsdf", "bsdf_2", "volume", "a", "x_1",
        ];
        let key = prop::sample::select(keys.to_vec());
        (inner, prop::collection::btree_map(key, child, 1..4)).prop_map(|(mut object, children)| {
            for (key, child) in children {
                object[key] = child;
            }
            object
        })
    })
}

proptest! {
    #![proptest_config(common::inputs())]

    #[test]
    fn arbitrary_text(text in ".*") {
        exercise(&text);
        exercise(&format!("{{\"type\": \"scene\", \"a\": {text}}}"));
    }

    #[test]
    fn pieces_of_text(text in pieces()) {
        exercise(&text);
        exercise(&format!("{{\"type\": \"scene\", {text}}}"));
        exercise(&format!("{{\"type\": \"scene\", \"a\": {{\"type\": \"sphere\", {text}}}}}"));
    }

    #[test]
    fn arbitrary_values(value in value()) {
        exercise(&value.to_string());
    }

    #[test]
    fn arbitrary_scenes(mut entries in entries(value())) {
        entries.insert("type".into(), "scene".into());
        let text = Value::Object(entries).to_string();
        exercise(&text);
    }

    #[test]
    fn valid_scenes(objects in prop::collection::vec(valid_object(), 0..5)) {
        let mut scene = json!({"type": "scene", "first": {"type": "null"}});
        for (i, object) in objects.into_iter().enumerate() {
            let key = ["shape", "a", "bsdf_7", "b_x", "sensor"][i];
            scene[key] = object;
        }
        prop_assert!(exercise(&scene.to_string()), "{}", scene);
    }
}

/// A text repeated through parameters does not exhaust the memory.
#[test]
fn parameters_cannot_grow_without_bound() {
    let mut parameters = vec![format!("\"a0\": \"{}\"", "x".repeat(1000))];
    for i in 1..60 {
        let below = i - 1;
        parameters.push(format!("\"a{i}\": \"$a{below}$a{below}\""));
    }
    let text = format!(
        "{{\"type\": \"scene\", \"parameters\": {{{}}}}}",
        parameters.join(", ")
    );
    let mut diagnostics = Diagnostics::new();
    assert!(json::parse(&text, "scene.json", &[], &mut diagnostics).is_none());
    assert!(
        diagnostics.to_string().contains("too long"),
        "{diagnostics}"
    );
}

#[test]
fn deep_nesting_is_refused() {
    for (open, close) in [("[", "]"), ("{\"type\": \"sum\", \"volume\": ", "}")] {
        for depth in [50, 100, 511, 600, 100_000] {
            let value = format!("{}1{}", open.repeat(depth), close.repeat(depth));
            exercise(&format!("{{\"type\": \"scene\", \"a\": {value}}}"));
        }
    }
}
