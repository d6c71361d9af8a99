//! JSON Schema of scenes, made from the table of plugins, for editors and validators.

use super::parameter::number_in_json;
use super::{NumberRange, Parameter, Plugin, Slot, Type, find, plugins};
use crate::scene::PluginKind;
use serde_json::{Map, Value, json};
use std::ops::Bound;

/// Name of the definition of plugins that compute spectra.
const SPECTRA: &str = "spectrum-plugin";

/// Returns a JSON Schema (draft 2020-12) of scenes in JSON. It states names, types, words and
/// limits of numbers. It states no limits of spectra and no rules that involve several parameters.
pub fn json_schema() -> String {
    let mut definitions = values();
    for kind in PluginKind::ALL {
        if kind != PluginKind::Scene {
            for plugin in plugins(kind) {
                let name = format!("{kind}.{}", plugin.name);
                definitions.insert(name, object(plugin));
                choices(plugin, &mut definitions);
            }
        }
    }
    let mut schema = Map::new();
    if let Some(scene) = find(PluginKind::Scene, "") {
        choices(scene, &mut definitions);
        schema = scene_object(scene);
    }
    definitions.insert(SPECTRA.into(), choice(&[PluginKind::Spectrum]));
    schema.insert("$defs".into(), Value::Object(definitions));
    format!("{:#}\n", Value::Object(schema))
}

fn scene_object(scene: &Plugin) -> Map<String, Value> {
    let plain = json!({"type": ["number", "boolean", "string", "array"]});
    let parameters = json!({
        "description": "Values for \"$name\", which -D name=value replaces.",
        "type": "object",
        "additionalProperties": plain,
    });
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A scene of morgana",
        "type": "object",
        "properties": {
            "$schema": {"type": "string"},
            "type": {"const": "scene"},
            "parameters": parameters,
        },
        "required": ["type"],
        "additionalProperties": others(scene),
    });
    match schema {
        Value::Object(schema) => schema,
        _ => Map::new(),
    }
}

/// Returns the schema of an object with this plugin.
fn object(plugin: &Plugin) -> Value {
    let mut properties = Map::new();
    properties.insert("type".into(), json!({"const": plugin.name}));
    properties.insert("id".into(), json!({"type": "string"}));
    for parameter in plugin.parameters() {
        properties.insert(parameter.name.into(), described(parameter));
    }
    for slot in plugin.children() {
        let Some(role) = slot.role else { continue };
        let mut ways = vec![reference(&choice_name(&[slot.kind]))];
        ways.extend(plugin.parameter(role).map(described));
        let value = json!({"description": slot.help, "anyOf": ways});
        properties.insert(role.into(), value);
    }
    let required = plugin.parameters().filter(|p| p.is_required());
    let required: Vec<&str> = std::iter::once("type")
        .chain(required.map(|p| p.name))
        .collect();
    json!({
        "description": plugin.help,
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": others(plugin),
    })
}

/// Returns the schema of keys that are neither parameters nor roles. Their values are children that
/// need no role, or values of [`Plugin::others`].
fn others(plugin: &Plugin) -> Value {
    if let Some(parameter) = plugin.others() {
        return described(parameter);
    }
    match unnamed(plugin).as_slice() {
        [] => Value::Bool(false),
        kinds => reference(&choice_name(kinds)),
    }
}

fn unnamed(plugin: &Plugin) -> Vec<PluginKind> {
    let slots = plugin.children().iter();
    let slots = slots.filter(|slot| slot.role.is_none());
    slots.map(|slot| slot.kind).collect()
}

/// Defines the choices that a plugin's children need.
fn choices(plugin: &Plugin, definitions: &mut Map<String, Value>) {
    let role = |slot: &Slot| slot.role.map(|_| vec![slot.kind]);
    let sets = plugin.children().iter().filter_map(role);
    for kinds in sets.chain([unnamed(plugin)]) {
        definitions
            .entry(choice_name(&kinds))
            .or_insert_with(|| choice(&kinds));
    }
}

fn choice_name(kinds: &[PluginKind]) -> String {
    let words: Vec<&str> = kinds.iter().map(|kind| kind.tag()).collect();
    if words.is_empty() {
        "no-plugin".into()
    } else {
        words.join("-or-")
    }
}

/// Returns the schema of a plugin of any of `kinds`, or of a reference. The property `type` selects
/// the plugin.
fn choice(kinds: &[PluginKind]) -> Value {
    let mut names: Vec<&str> = kinds
        .iter()
        .flat_map(|kind| plugins(*kind))
        .map(|plugin| plugin.name)
        .chain(["ref"])
        .collect();
    names.sort_unstable();
    names.dedup();
    let cases = names.iter().map(|name| {
        let fitting = kinds.iter().filter(|kind| find(**kind, name).is_some());
        let mut ways: Vec<Value> = fitting
            .map(|kind| reference(&format!("{kind}.{name}")))
            .collect();
        if *name == "ref" {
            ways.push(reference("ref"));
        }
        // Write a single rule without `anyOf`: validators explain it better.
        let then = match ways.pop() {
            Some(only) if ways.is_empty() => only,
            last => json!({"anyOf": ways.into_iter().chain(last).collect::<Vec<_>>()}),
        };
        // JSON Schema applies `properties` and `required` to objects only.
        let properties = json!({"type": {"const": name}});
        let case = json!({"type": "object", "properties": properties, "required": ["type"]});
        json!({"if": case, "then": then})
    });
    let cases: Vec<Value> = cases.collect();
    json!({
        "type": "object",
        "properties": {"type": {"enum": names}},
        "required": ["type"],
        "allOf": cases,
    })
}

/// Returns the schema of a parameter's values, with help and default.
fn described(parameter: &Parameter) -> Value {
    let mut schema = match parameter.value {
        Type::Float => limited("number", parameter.limits),
        Type::Integer => limited("integer", parameter.limits),
        Type::Boolean => reference("boolean"),
        Type::Text => json!({"type": "string"}),
        Type::Word(words) => json!({"anyOf": [{"enum": words}, reference("parameter")]}),
        Type::NumberOrWord(words) => {
            json!({"anyOf": [limited("number", parameter.limits), {"enum": words}]})
        }
        Type::List => reference("list"),
        Type::Spectrum => reference("spectrum"),
        Type::Point | Type::Vector => reference("point"),
        Type::Transform => reference("transform"),
        Type::Tensor => json!({"type": "array"}),
    };
    schema["description"] = parameter.description().into();
    if let Some(default) = parameter.default.json() {
        schema["default"] = default;
    }
    schema
}

/// Returns the schema of a number within limits, or of a text with a scene parameter.
fn limited(kind: &str, limits: NumberRange) -> Value {
    let mut number = Map::new();
    let ends = [
        (limits.low, "minimum", "exclusiveMinimum"),
        (limits.high, "maximum", "exclusiveMaximum"),
    ];
    for (end, included, excluded) in ends {
        match end {
            Bound::Included(value) => number.insert(included.into(), number_in_json(value)),
            Bound::Excluded(value) => number.insert(excluded.into(), number_in_json(value)),
            Bound::Unbounded => None,
        };
    }
    if number.is_empty() {
        return reference(kind);
    }
    number.insert("type".into(), kind.into());
    json!({"anyOf": [number, reference("parameter")]})
}

fn reference(name: &str) -> Value {
    json!({"$ref": format!("#/$defs/{name}")})
}

/// Returns the definitions of values. A text with a scene parameter may replace any value.
fn values() -> Map<String, Value> {
    let or_parameter = |schema: Value| json!({"anyOf": [schema, reference("parameter")]});
    let array = |items: Value, length: usize| json!({"type": "array", "items": items, "minItems": length, "maxItems": length});
    let number = reference("number");
    let triple = array(number.clone(), 3);
    let rows = |n: usize| array(array(number.clone(), n), n);
    let matrix = json!({"anyOf": [rows(4), rows(3)]});
    let fixed = |required: &[&str], properties: Value| {
        json!({
            "type": "object", "properties": properties, "required": required, "additionalProperties": false,
        })
    };
    let point = reference("point");
    let axis = json!({"axis": point, "angle": number});
    let view = json!({"origin": point, "target": point, "up": point});
    let parts = json!({
        "translate": point,
        "scale": {"anyOf": [number, point]},
        "rotate": fixed(&["axis", "angle"], axis),
        "lookat": fixed(&["origin", "target"], view),
        "matrix": matrix,
    });
    let part = json!({
        "type": "object", "properties": parts, "additionalProperties": false,
        "minProperties": 1, "maxProperties": 1,
    });
    let rgb = json!({
        "type": {"const": "rgb"},
        "value": {"anyOf": [number, point, {"type": "string", "pattern": "^#[0-9a-fA-F]{6}$"}]},
    });
    let pairs = json!({"type": "array", "items": array(number.clone(), 2)});
    let spectrum = json!({
        "type": {"const": "spectrum"}, "value": {"anyOf": [number, pairs]}, "filename": {"type": "string"},
    });
    let item = json!({"type": ["number", "string"]});
    let list = json!({"anyOf": [item, {"type": "array", "items": item}]});
    let definitions = [
        ("parameter", json!({"type": "string", "pattern": "\\$"})),
        ("number", or_parameter(json!({"type": "number"}))),
        ("integer", or_parameter(json!({"type": "integer"}))),
        ("boolean", or_parameter(json!({"type": "boolean"}))),
        ("list", list),
        ("point", or_parameter(triple)),
        (
            "spectrum",
            json!({"anyOf": [
                number, fixed(&["type", "value"], rgb), fixed(&["type"], spectrum), reference(SPECTRA),
            ]}),
        ),
        (
            "transform",
            json!({"anyOf": [matrix, {"type": "array", "items": part}]}),
        ),
        (
            "ref",
            fixed(
                &["type", "id"],
                json!({"type": {"const": "ref"}, "id": {"type": "string"}}),
            ),
        ),
    ];
    definitions
        .into_iter()
        .map(|(name, schema)| (name.to_owned(), schema))
        .collect()
}
