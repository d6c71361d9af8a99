//! Parameters far beyond their range: messages contain only short numbers.

use morgana_io::schema::{self, Plugin, Type};
use morgana_io::{Diagnostics, LoadOptions, PluginKind, json};
use serde_json::{Value, json};

/// Numbers whose digits, written out, would fill lines.
const NUMBERS: [f64; 5] = [-1.0, 1e300, -1e300, 1e-300, -1e-300];
/// Maximum number of digits of a well-formatted number.
const MAX_DIGITS: usize = 20;

/// A scene that places an object of a kind.
fn scene(kind: PluginKind, object: Value) -> Value {
    let camera = json!({"type": "perspective", "fov": 40, "to_world": [{"translate": [0, 0, -5]}]});
    let mut scene = json!({"type": "scene", "sensor": camera, "sky": {"type": "constant"}});
    let fog = |name: &str, value: Value| json!({"type": "homogeneous", name: value});
    let ball =
        |inside: Value| json!({"type": "sphere", "bsdf": {"type": "null"}, "interior": inside});
    match kind {
        PluginKind::Bsdf => scene["ball"] = json!({"type": "sphere", "bsdf": object}),
        PluginKind::Phase => scene["ball"] = ball(fog("phase", object)),
        PluginKind::Medium => scene["ball"] = ball(object),
        PluginKind::Volume if object["type"] == "gridvolume" || object["type"] == "constvolume" => {
            scene["ball"] = ball(fog("sigma_t", object));
        }
        PluginKind::Volume => scene["ball"] = ball(fog("ior", object)),
        PluginKind::Texture => {
            let bsdf = json!({"type": "diffuse", "reflectance": object});
            scene["ball"] = json!({"type": "sphere", "bsdf": bsdf});
        }
        PluginKind::Film | PluginKind::Sampler => scene["sensor"][kind.tag()] = object,
        PluginKind::Emitter if object["type"] == "area" => {
            scene["ball"] = json!({"type": "sphere", "emitter": object});
        }
        PluginKind::Emitter if object["type"] == "directionalarea" => {
            scene["panel"] = json!({"type": "rectangle", "emitter": object});
        }
        _ => scene[kind.tag()] = object,
    }
    scene
}

/// Returns the value of a parameter whose numbers are all equal.
fn value(of: Type, number: f64) -> Option<Value> {
    Some(match of {
        Type::Float | Type::Integer | Type::Spectrum | Type::NumberOrWord(_) => number.into(),
        Type::List => format!("{number:e}, {number:e}").into(),
        Type::Point | Type::Vector => json!([number, number, number]),
        Type::Transform => json!([{"scale": number}, {"translate": [number, 0, 0]}]),
        Type::Tensor => json!([[[number, 1.0], [1.0, number]], [[1.0, 1.0], [1.0, 1.0]]]),
        Type::Boolean | Type::Text | Type::Word(_) => return None,
    })
}

/// Objects with all required numbers and one parameter far out of range.
fn objects(plugin: &Plugin) -> Vec<Value> {
    let mut all = Vec::new();
    for parameter in plugin.parameters() {
        for number in NUMBERS {
            let mut object = json!({"type": plugin.name});
            for other in plugin.parameters().filter(|p| p.is_required()) {
                if let Some(value) = value(other.value, 1.0) {
                    object[other.name] = value;
                }
            }
            let Some(value) = value(parameter.value, number) else {
                continue;
            };
            object[parameter.name] = value;
            all.push(object);
        }
    }
    all
}

fn messages(scene: &Value) -> String {
    let mut diagnostics = Diagnostics::new();
    let Some(read) = json::parse(&scene.to_string(), "scene.json", &[], &mut diagnostics) else {
        return lines(&diagnostics);
    };
    match morgana_io::assemble(&read, &LoadOptions::default(), diagnostics) {
        Ok(loaded) => lines(&loaded.warnings),
        Err(diagnostics) => lines(&diagnostics),
    }
}

/// Returns the messages without lines of the file.
fn lines(diagnostics: &Diagnostics) -> String {
    let line =
        |d: &morgana_io::Diagnostic| format!("{} {}", d.message, d.help.as_deref().unwrap_or(""));
    diagnostics.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn longest_number(text: &str) -> usize {
    let runs = text.split(|c: char| !(c.is_ascii_digit() || c == '.'));
    runs.map(str::len).max().unwrap_or(0)
}

#[test]
fn numbers_in_messages_are_short() {
    let mut refused = 0;
    for kind in PluginKind::ALL {
        for plugin in schema::plugins(kind) {
            for object in objects(plugin) {
                let scene = scene(kind, object);
                let message = messages(&scene);
                assert!(longest_number(&message) <= MAX_DIGITS, "{scene}\n{message}");
                refused += usize::from(!message.is_empty());
            }
        }
    }
    assert!(refused > 500, "{refused}");
}
