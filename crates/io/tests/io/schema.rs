//! The table of plugins, compared with the code that queries their parameters, and as JSON Schema.
//!
//! Every other test checks that the table lists all queried parameters: `Query` asserts it.

use morgana_io::schema::{self, NumberRange, Parameter, Plugin, Type};
use morgana_io::{Diagnostics, LoadOptions, PluginKind, json};
use std::ops::Bound;

/// A scene that places an object of a kind.
fn scene(kind: PluginKind, plugin: &str, object: &str) -> String {
    let sensor = r#""sensor": {"type": "perspective", "fov": 40}"#;
    let volume = |role: &str, volume: &str| {
        format!(
            r#"{sensor}, "s": {{"type": "sphere", "interior": {{"type": "homogeneous", "{role}": {volume}}}}}"#
        )
    };
    let contents = match kind {
        PluginKind::Sensor if plugin == "irradiancemeter" => {
            format!(r#""s": {{"type": "sphere", "sensor": {object}}}"#)
        }
        PluginKind::Sensor => format!(r#""sensor": {object}"#),
        PluginKind::Film | PluginKind::Sampler => {
            format!(r#""sensor": {{"type": "perspective", "fov": 40, "{kind}": {object}}}"#)
        }
        PluginKind::Rfilter => format!(
            r#""sensor": {{"type": "perspective", "fov": 40, "film": {{"type": "hdrfilm", "rfilter": {object}}}}}"#
        ),
        PluginKind::Emitter if ["area", "directionalarea"].contains(&plugin) => {
            format!(r#"{sensor}, "s": {{"type": "rectangle", "emitter": {object}}}"#)
        }
        PluginKind::Bsdf => format!(r#"{sensor}, "s": {{"type": "sphere", "bsdf": {object}}}"#),
        PluginKind::Texture => format!(
            r#"{sensor}, "s": {{"type": "sphere", "bsdf": {{"type": "diffuse", "reflectance": {object}}}}}"#
        ),
        PluginKind::Spectrum => format!(
            r#"{sensor}, "s": {{"type": "sphere", "bsdf": {{"type": "dielectric", "specular_reflectance": {object}}}}}"#
        ),
        PluginKind::Shape if plugin == "shapegroup" => {
            format!(r#"{sensor}, "s": {{"type": "instance", "shape": {object}}}"#)
        }
        PluginKind::Medium => {
            format!(r#"{sensor}, "s": {{"type": "sphere", "interior": {object}}}"#)
        }
        PluginKind::Phase => format!(
            r#"{sensor}, "s": {{"type": "sphere", "interior": {{"type": "homogeneous", "phase": {object}}}}}"#
        ),
        PluginKind::Volume if ["gridvolume", "constvolume"].contains(&plugin) => {
            volume("sigma_t", object)
        }
        PluginKind::Volume if plugin == "mode" => volume(
            "ior",
            &format!(r#"{{"type": "acoustic", "n0": 1, "volume": {object}}}"#),
        ),
        PluginKind::Volume => volume("ior", object),
        kind => format!(r#"{sensor}, "{kind}": {object}"#),
    };
    format!(r#"{{"type": "scene", {contents}}}"#)
}

/// Returns the messages of a scene.
fn complaints(text: &str) -> Vec<String> {
    let mut diagnostics = Diagnostics::new();
    let description = json::parse(text, "scene.json", &[], &mut diagnostics);
    let description = description.unwrap_or_else(|| panic!("{diagnostics}\n{text}"));
    let diagnostics = match morgana_io::assemble(&description, &LoadOptions::default(), diagnostics)
    {
        Ok(loaded) => loaded.warnings,
        Err(diagnostics) => diagnostics,
    };
    diagnostics.iter().map(|d| d.message.clone()).collect()
}

/// A value of a parameter; `variant` chooses among words.
fn value(parameter: &Parameter, variant: usize) -> String {
    match parameter.value {
        Type::NumberOrWord(words) if variant > 0 => format!("\"{}\"", words[variant % words.len()]),
        Type::Float | Type::Integer | Type::Spectrum | Type::NumberOrWord(_) => {
            number(parameter.limits).to_string()
        }
        Type::Boolean => "true".into(),
        Type::Text => "\"x\"".into(),
        Type::Word(words) => format!("\"{}\"", words[variant % words.len()]),
        Type::List if parameter.name == "decomposition" => "[\"time\", \"bounce\"]".into(),
        Type::List => "[1, 2]".into(),
        Type::Point | Type::Vector => "[1, 0, 0]".into(),
        Type::Transform => "[]".into(),
        Type::Tensor => "[[0, 0, 0], [1, 0, 0], [0, 1, 0]]".into(),
    }
}

/// A number within limits: 1, or the nearest limit.
fn number(limits: NumberRange) -> f64 {
    match (limits.low, limits.high) {
        (Bound::Included(low), _) if low > 1.0 => low,
        (_, Bound::Included(high)) if high < 1.0 => high,
        (_, Bound::Excluded(high)) if high <= 1.0 => 0.5 * high,
        _ => 1.0,
    }
}

fn object(plugin: &Plugin, variant: usize) -> String {
    // A transform may exclude a position or direction.
    let placed = |p: &&Parameter| variant.is_multiple_of(2) || p.value != Type::Transform;
    let parameters = plugin.parameters().filter(placed);
    let pairs = parameters.map(|p| format!(", \"{}\": {}", p.name, value(p, variant)));
    format!(
        "{{\"type\": \"{}\"{}}}",
        plugin.name,
        pairs.collect::<String>()
    )
}

/// Mutually exclusive parameters are accepted in at least one variant.
#[test]
fn every_parameter_of_the_table_is_one() {
    for kind in PluginKind::ALL
        .into_iter()
        .filter(|k| *k != PluginKind::Scene)
    {
        for plugin in schema::plugins(kind) {
            let texts = (0..8).map(|variant| scene(kind, plugin.name, &object(plugin, variant)));
            let complaints: Vec<Vec<String>> = texts.map(|text| complaints(&text)).collect();
            for parameter in plugin.parameters() {
                let unknown = |message: &String| {
                    let said =
                        |end: &str| message.ends_with(&format!("{end} '{}'", parameter.name));
                    said("has no parameter")
                        || message.ends_with(&format!("does not use '{}' here", parameter.name))
                };
                let refused = complaints
                    .iter()
                    .all(|messages| messages.iter().any(unknown));
                assert!(
                    !refused,
                    "{kind} {}: {}: {complaints:?}",
                    plugin.name, parameter.name
                );
            }
            let unknown = |message: &String| {
                message.starts_with(&format!("unknown {kind} type"))
                    || message.contains("' cannot be '")
            };
            assert!(
                !complaints.iter().flatten().any(unknown),
                "{kind} {}",
                plugin.name
            );
        }
    }
}

/// Numbers just outside the limits of the table are refused by name, in at least one variant; in
/// others another parameter excludes them.
#[test]
fn limits_of_the_table_are_those_of_scenes() {
    let (mut count, mut accepted) = (0, Vec::new());
    for kind in PluginKind::ALL {
        for plugin in schema::plugins(kind) {
            for parameter in plugin.parameters() {
                for outside in outside(parameter) {
                    let refused = |object: String| {
                        let complaints = complaints(&scene(kind, plugin.name, &object));
                        let start = format!("'{}' is ", parameter.name);
                        complaints
                            .iter()
                            .any(|m| m.starts_with(&start) && m.contains(" but must be "))
                    };
                    let among_all = |variant| {
                        let name = format!("\"{}\": ", parameter.name);
                        let usual = format!("{name}{}", value(parameter, variant));
                        object(plugin, variant).replace(&usual, &format!("{name}{outside}"))
                    };
                    count += 1;
                    if !refused(alone(plugin, parameter, outside))
                        && !(0..8).map(among_all).any(refused)
                    {
                        accepted.push(format!("{kind} {}: {}", plugin.name, parameter.name));
                    }
                }
            }
        }
    }
    assert!(count > 200, "{count}");
    accepted.dedup();
    // These are read only with a nested integrator, mode or volume.
    let unread = [
        "integrator tagged: wavelength",
        "integrator tagged: orders",
        "integrator tagged: delays",
        "volume acoustic: wave_number",
        "volume cauchy: reference_wavelength",
        "volume sellmeier: reference_wavelength",
    ];
    assert_eq!(accepted, unread);
}

/// An object with a number and with the content that it requires.
fn alone(plugin: &Plugin, parameter: &Parameter, number: f64) -> String {
    let needed = plugin
        .parameters()
        .filter(|p| p.is_required() && p.name != parameter.name);
    let needed: String = needed
        .map(|p| format!(", \"{}\": {}", p.name, value(p, 0)))
        .collect();
    format!(
        "{{\"type\": \"{}\"{needed}, \"{}\": {number}}}",
        plugin.name, parameter.name
    )
}

/// Numbers just outside a parameter's limits.
fn outside(parameter: &Parameter) -> Vec<f64> {
    let limits = parameter.limits;
    let step = |end: f64| match parameter.value {
        Type::Integer => 1.0,
        _ => 1e-9 * end.abs().max(1e-300),
    };
    let low = match limits.low {
        Bound::Included(low) => Some(low - step(low)),
        Bound::Excluded(low) => Some(low),
        Bound::Unbounded => None,
    };
    let high = match limits.high {
        Bound::Included(high) => Some(high + step(high)),
        Bound::Excluded(high) => Some(high),
        Bound::Unbounded => None,
    };
    low.into_iter().chain(high).collect()
}

#[test]
fn every_child_of_the_table_is_one() {
    for kind in PluginKind::ALL
        .into_iter()
        .filter(|k| *k != PluginKind::Scene)
    {
        for plugin in schema::plugins(kind) {
            for slot in plugin.children() {
                let child = match slot.kind {
                    PluginKind::Volume if slot.role.is_some_and(|r| r != "ior") => "gridvolume",
                    PluginKind::Volume if plugin.name == "acoustic" => "mode",
                    PluginKind::Shape if plugin.name == "instance" => "shapegroup",
                    PluginKind::Emitter => "area",
                    PluginKind::Sensor => "irradiancemeter",
                    kind => schema::plugins(kind)[0].name,
                };
                let key = slot.role.unwrap_or(slot.kind.tag());
                let object = format!(
                    "{{\"type\": \"{}\", \"{key}\": {{\"type\": \"{child}\"}}}}",
                    plugin.name
                );
                let refused = format!("<{kind} type=\"{}\"> ", plugin.name);
                let complaints = complaints(&scene(kind, plugin.name, &object));
                let refused = complaints.iter().any(|m| {
                    m.strip_prefix(&refused)
                        .is_some_and(|m| m.starts_with("takes no ") || m.starts_with("has no <"))
                });
                assert!(!refused, "{kind} {} {key}: {complaints:?}", plugin.name);
            }
        }
    }
}

/// Types that the table does not list are unknown, wherever objects of a kind may stand.
#[test]
fn types_that_are_not_in_the_table_are_unknown() {
    for kind in PluginKind::ALL {
        let is_checked = !matches!(
            kind,
            PluginKind::Scene | PluginKind::Sampler | PluginKind::Spectrum
        );
        if is_checked {
            let messages = complaints(&scene(kind, "nonsense", "{\"type\": \"nonsense\"}"));
            let expected = format!("unknown {kind} type 'nonsense'");
            assert!(messages.contains(&expected), "{kind}: {messages:?}");
        }
    }
}

#[test]
fn names_are_told_apart() {
    for kind in PluginKind::ALL {
        for plugin in schema::plugins(kind) {
            let names: Vec<_> = plugin.parameters().map(|p| p.name).collect();
            for (i, name) in names.iter().enumerate() {
                assert!(
                    !names[..i].contains(name),
                    "{} has {name} twice",
                    plugin.name
                );
                assert!(!["type", "id"].contains(name), "{}", plugin.name);
                assert_eq!(
                    PluginKind::of_key(name).filter(|_| *name != "phase"),
                    None,
                    "{name}"
                );
            }
        }
    }
}

mod json_schema {
    use super::*;
    use serde_json::{Value, json};

    /// Returns an error if a value violates a schema, for the keywords that morgana's schema uses;
    /// by the specification, 2020-12.
    fn check(value: &Value, schema: &Value, root: &Value) -> Result<(), String> {
        let Value::Object(keywords) = schema else {
            return match schema {
                Value::Bool(true) => Ok(()),
                _ => Err(format!("{value} may not be there")),
            };
        };
        for (keyword, rule) in keywords {
            self::keyword(value, keyword, rule, keywords, root)?;
        }
        Ok(())
    }

    fn keyword(
        value: &Value,
        keyword: &str,
        rule: &Value,
        schema: &serde_json::Map<String, Value>,
        root: &Value,
    ) -> Result<(), String> {
        let all = |rules: &Value| rules.as_array().unwrap().clone();
        let holds = match keyword {
            "$ref" => {
                let pointer = rule.as_str().unwrap().strip_prefix('#').unwrap();
                let target = root.pointer(pointer).ok_or(format!("no {pointer}"))?;
                return check(value, target, root);
            }
            "type" => match rule {
                Value::Array(names) => names.iter().any(|n| is(value, n.as_str().unwrap())),
                name => is(value, name.as_str().unwrap()),
            },
            "const" => value == rule,
            "enum" => all(rule).contains(value),
            "pattern" => match (value.as_str(), rule.as_str().unwrap()) {
                (None, _) => true,
                (Some(text), "\\$") => text.contains('$'),
                (Some(text), "^#[0-9a-fA-F]{6}$") => text.starts_with('#') && text.len() == 7,
                (_, other) => panic!("unknown pattern {other}"),
            },
            "anyOf" => all(rule)
                .iter()
                .any(|rule| check(value, rule, root).is_ok()),
            "allOf" => {
                return all(rule)
                    .iter()
                    .try_for_each(|rule| check(value, rule, root));
            }
            "if" => match check(value, rule, root) {
                Ok(()) => return check(value, &schema["then"], root),
                Err(_) => true,
            },
            "required" => value.as_object().is_none_or(|object| {
                all(rule)
                    .iter()
                    .all(|key| object.contains_key(key.as_str().unwrap()))
            }),
            "properties" => {
                let Some(object) = value.as_object() else {
                    return Ok(());
                };
                for (key, rule) in rule.as_object().unwrap() {
                    if let Some(value) = object.get(key) {
                        check(value, rule, root)?;
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = schema.get("properties").and_then(Value::as_object);
                let Some(object) = value.as_object() else {
                    return Ok(());
                };
                for (_, value) in object
                    .iter()
                    .filter(|(k, _)| known.is_none_or(|p| !p.contains_key(*k)))
                {
                    check(value, rule, root)?;
                }
                true
            }
            "items" => {
                let items = value.as_array().into_iter().flatten();
                return items
                    .into_iter()
                    .try_for_each(|item| check(item, rule, root));
            }
            "minItems" => value
                .as_array()
                .is_none_or(|a| a.len() as u64 >= rule.as_u64().unwrap()),
            "maxItems" => value
                .as_array()
                .is_none_or(|a| a.len() as u64 <= rule.as_u64().unwrap()),
            "minProperties" => value
                .as_object()
                .is_none_or(|a| a.len() as u64 >= rule.as_u64().unwrap()),
            "maxProperties" => value
                .as_object()
                .is_none_or(|a| a.len() as u64 <= rule.as_u64().unwrap()),
            "minimum" => value.as_f64().is_none_or(|v| v >= rule.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|v| v <= rule.as_f64().unwrap()),
            "exclusiveMinimum" => value.as_f64().is_none_or(|v| v > rule.as_f64().unwrap()),
            "exclusiveMaximum" => value.as_f64().is_none_or(|v| v < rule.as_f64().unwrap()),
            "then" | "$schema" | "$defs" | "title" | "description" | "default" => true,
            other => panic!("unknown keyword {other}"),
        };
        holds
            .then_some(())
            .ok_or_else(|| format!("{value} breaks {keyword} {rule}"))
    }

    fn is(value: &Value, name: &str) -> bool {
        match name {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "boolean" => value.is_boolean(),
            "number" => value.is_number(),
            "integer" => value.as_f64().is_some_and(|v| v.fract() == 0.0),
            other => panic!("unknown type {other}"),
        }
    }

    fn validate(text: &str) -> Result<(), String> {
        let schema: Value = schema::json_schema().parse().expect("the schema is JSON");
        check(&text.parse().expect("JSON"), &schema, &schema)
    }

    #[test]
    fn every_example_scene_is_valid() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let files = std::fs::read_dir(folder.join("../../scenes")).unwrap();
        let files = files.map(|f| f.unwrap().path());
        for file in files.filter(|f| f.extension().is_some_and(|e| e == "xml")) {
            let scene = morgana_io::xml::load(&file, &[], &mut Diagnostics::new()).unwrap();
            assert_eq!(validate(&json::write(&scene)), Ok(()), "{}", file.display());
        }
        for name in ["luneburg_fog", "aquarium_laser"] {
            let path = folder.join(format!("tests/data/json/{name}.json"));
            assert_eq!(
                validate(&std::fs::read_to_string(path).unwrap()),
                Ok(()),
                "{name}"
            );
        }
    }

    #[test]
    fn every_object_of_the_table_is_valid() {
        for kind in PluginKind::ALL
            .into_iter()
            .filter(|k| *k != PluginKind::Scene)
        {
            for plugin in schema::plugins(kind) {
                let text = scene(kind, plugin.name, &object(plugin, 1));
                assert_eq!(validate(&text), Ok(()), "{text}");
            }
        }
    }

    #[test]
    fn mistakes_are_not_valid() {
        let good =
            r#"{"type": "scene", "a": {"type": "sphere", "radius": 1, "bsdf": {"type": "null"}}}"#;
        assert_eq!(validate(good), Ok(()));
        for (from, to) in [
            ("radius", "radus"),
            ("\"sphere\"", "\"spere\""),
            ("\"null\"", "\"hg\""),
            ("1", "\"1\""),
            ("1", "[1]"),
            ("\"bsdf\": {\"type\"", "\"bsdf\": {\"typ\""),
            ("\"bsdf\"", "\"interior\""),
            ("\"null\"", "\"null\", \"x\": 1"),
            ("\"scene\"", "\"shape\""),
            ("{\"type\": \"null\"}", "{\"type\": \"ref\"}"),
            (
                "\"radius\": 1",
                "\"to_world\": [{\"scale\": 1, \"translate\": [0, 0, 0]}]",
            ),
        ] {
            let bad = good.replacen(from, to, 1);
            assert!(validate(&bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn defaults_and_words_are_told() {
        let schema: Value = schema::json_schema().parse().unwrap();
        let sphere = &schema["$defs"]["shape.sphere"];
        assert_eq!(sphere["properties"]["radius"]["default"], json!(1));
        let sensor = &schema["$defs"]["sensor.perspective"];
        assert_eq!(
            sensor["properties"]["focal_length"]["default"],
            json!("50mm")
        );
        let lens = &schema["$defs"]["sensor.thinlens"];
        assert_eq!(lens["required"], json!(["type", "aperture_radius"]));
        assert_eq!(sensor["properties"]["fov_axis"]["default"], json!("x"));
        let grid = &schema["$defs"]["volume.bspline"];
        assert_eq!(grid["properties"]["smoothing"]["default"], json!("none"));
        let words = &sensor["properties"]["fov_axis"]["anyOf"][0]["enum"];
        assert_eq!(words, &json!(["x", "y", "smaller", "larger", "diagonal"]));
    }
}
