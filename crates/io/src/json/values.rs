//! Values of parameters.

use super::keys::TYPE;
use super::transforms;
use super::tree::{Entry, Json, Node};
use crate::diagnostic::{Diagnostic, Diagnostics, suggest};
use crate::draft::shorten;
use crate::scene::{Numbers, SpectrumValue, Tensor, Value, rgb_from_hex};
use crate::schema::Type;
use eikonal::Shown;
use glam::DVec3;
use std::sync::Arc;

/// Reports `message` at a value, unless an error has already been reported there.
pub(super) fn report(node: &Node, message: impl Into<String>, diagnostics: &mut Diagnostics) {
    if !matches!(node.json, Json::Broken) {
        diagnostics.push(Diagnostic::error(message).at(&node.location));
    }
}

/// Returns the value of a parameter. The table of plugins may give its type.
pub(super) fn value(
    node: &Node,
    known: Option<Type>,
    diagnostics: &mut Diagnostics,
) -> Option<Value> {
    let is_text = matches!(known, Some(Type::List | Type::Text));
    match &node.json {
        Json::Integer(v) if is_text => Some(Value::String(v.to_string())),
        Json::Float(v) if is_text => Some(Value::String(v.to_string())),
        Json::Broken => None,
        Json::Null => {
            report(node, "null is not a value: leave the key out", diagnostics);
            None
        }
        Json::Boolean(v) => Some(Value::Boolean(*v)),
        Json::Integer(v) => Some(Value::Integer(*v)),
        Json::Float(v) => Some(Value::Float(*v)),
        Json::String(v) => Some(Value::String(v.clone())),
        Json::Tensor(tensor) if known == Some(Type::Tensor) => Some(Value::Tensor(tensor.clone())),
        Json::Tensor(tensor) if known == Some(Type::List) && tensor.shape().len() == 1 => {
            let words = (0..tensor.len()).map(|i| tensor.get(i).to_string());
            Some(Value::String(words.collect::<Vec<_>>().join(", ")))
        }
        Json::Tensor(tensor) => {
            let message = format!(
                "an array of shape {:?} does not belong here: textures and volumes take theirs as 'data'",
                tensor.shape()
            );
            report(node, message, diagnostics);
            None
        }
        Json::Array(_) if known == Some(Type::Tensor) => tensor(node, diagnostics),
        Json::Array(items) if known == Some(Type::List) => list(items, diagnostics),
        Json::Array(items) => array(node, items, diagnostics),
        Json::Object(entries) => spectrum(node, entries, diagnostics).map(Value::Spectrum),
    }
}

/// Converts an array to a text with a list.
fn list(items: &[Node], diagnostics: &mut Diagnostics) -> Option<Value> {
    let mut words = Vec::with_capacity(items.len());
    for item in items {
        words.push(match &item.json {
            Json::Integer(v) => v.to_string(),
            Json::Float(v) => v.to_string(),
            Json::String(v) => v.clone(),
            other => {
                let message = format!("expected a number or a text, found {}", other.describe());
                report(item, message, diagnostics);
                return None;
            }
        });
    }
    Some(Value::String(words.join(", ")))
}

fn array(node: &Node, items: &[Node], diagnostics: &mut Diagnostics) -> Option<Value> {
    match items.first().map(|first| &first.json) {
        Some(Json::Array(_)) => transforms::matrix(node, diagnostics).map(Value::Transform),
        None | Some(Json::Object(_)) => transforms::parts(items, node, diagnostics),
        _ => triple(node, diagnostics).map(Value::Point),
    }
}

/// Converts nested arrays of numbers to a tensor.
fn tensor(node: &Node, diagnostics: &mut Diagnostics) -> Option<Value> {
    let mut shape = Vec::new();
    let mut first = Some(node);
    while let Some(Json::Array(items)) = first.map(|node| &node.json) {
        shape.push(items.len());
        first = items.first();
    }
    let mut numbers = Vec::new();
    flatten(node, &shape, &mut numbers, diagnostics)?;
    let tensor = Tensor::new(shape, Numbers::Double(numbers)).ok()?;
    Some(Value::Tensor(Arc::new(tensor)))
}

fn flatten(
    node: &Node,
    shape: &[usize],
    numbers: &mut Vec<f64>,
    diagnostics: &mut Diagnostics,
) -> Option<()> {
    match (&node.json, shape) {
        (_, []) => numbers.push(number(node, diagnostics)?),
        (Json::Array(items), [count, rest @ ..]) if items.len() == *count => {
            for item in items {
                flatten(item, rest, numbers, diagnostics)?;
            }
        }
        (_, [count, ..]) => {
            let message = format!("expected an array of {count}, as the first of its kind is");
            report(node, message, diagnostics);
            return None;
        }
    }
    Some(())
}

/// Returns a number.
pub(super) fn number(node: &Node, diagnostics: &mut Diagnostics) -> Option<f64> {
    let number = node.number();
    if number.is_none() {
        let message = format!("expected a number, found {}", node.json.describe());
        report(node, message, diagnostics);
    }
    number
}

/// Returns three numbers.
pub(super) fn triple(node: &Node, diagnostics: &mut Diagnostics) -> Option<DVec3> {
    let Json::Array(items) = &node.json else {
        let message = format!("expected three numbers, found {}", node.json.describe());
        report(node, message, diagnostics);
        return None;
    };
    let [x, y, z] = &items[..] else {
        let message = format!("expected three numbers, found {}", items.len());
        report(node, message, diagnostics);
        return None;
    };
    let [x, y, z] = [x, y, z].map(|item| number(item, diagnostics));
    Some(DVec3::new(x?, y?, z?))
}

/// Reads a spectrum: `{"type": "rgb", "value": ...}`, `{"type": "spectrum", "value": ...}` or
/// `{"type": "spectrum", "filename": ...}`.
fn spectrum(
    node: &Node,
    entries: &[Entry],
    diagnostics: &mut Diagnostics,
) -> Option<SpectrumValue> {
    const VALUE: &str = "value";
    const FILENAME: &str = "filename";
    let is_rgb =
        get(entries, TYPE).is_some_and(|t| matches!(&t.json, Json::String(t) if t == "rgb"));
    let known: &[&str] = if is_rgb {
        &[TYPE, VALUE]
    } else {
        &[TYPE, VALUE, FILENAME]
    };
    only(entries, known, diagnostics);
    if let (Some(file), false) = (get(entries, FILENAME), is_rgb) {
        if get(entries, VALUE).is_some() {
            report(
                file,
                "give a \"value\" or a \"filename\", not both",
                diagnostics,
            );
        }
        return match &file.json {
            Json::String(name) => Some(SpectrumValue::File(name.clone())),
            other => {
                let message = format!("\"filename\" is a text, not {}", other.describe());
                report(file, message, diagnostics);
                None
            }
        };
    }
    let Some(value) = get(entries, VALUE) else {
        report(node, "a colour or spectrum needs a \"value\"", diagnostics);
        return None;
    };
    match (&value.json, is_rgb) {
        (Json::String(text), true) => hexadecimal(text, value, diagnostics),
        (Json::Array(_), true) => {
            triple(value, diagnostics).map(|v| SpectrumValue::Rgb(v.to_array()))
        }
        (Json::Array(pairs), false) => sampled(pairs, diagnostics),
        (_, is_rgb) => number(value, diagnostics).map(|v| {
            if is_rgb {
                SpectrumValue::Rgb([v; 3])
            } else {
                SpectrumValue::EqualEnergy(v)
            }
        }),
    }
}

fn hexadecimal(text: &str, at: &Node, diagnostics: &mut Diagnostics) -> Option<SpectrumValue> {
    let rgb = text.strip_prefix('#').and_then(rgb_from_hex);
    if rgb.is_none() {
        let message = format!("'{}' is not a colour like #ff8800", shorten(text));
        report(at, message, diagnostics);
    }
    rgb.map(SpectrumValue::Rgb)
}

/// Reads pairs of wavelength and value.
fn sampled(pairs: &[Node], diagnostics: &mut Diagnostics) -> Option<SpectrumValue> {
    let mut samples: Vec<(f64, f64)> = Vec::with_capacity(pairs.len());
    for pair in pairs {
        let (wavelength, value) = match &pair.json {
            Json::Array(items) if items.len() == 2 => {
                let [w, v] = [&items[0], &items[1]].map(|item| number(item, diagnostics));
                (w?, v?)
            }
            other => {
                let message = format!("expected [wavelength, value], found {}", other.describe());
                report(pair, message, diagnostics);
                return None;
            }
        };
        let previous = samples.last().map_or(0.0, |(w, _)| *w);
        if wavelength <= previous {
            let message = format!(
                "wavelengths must increase: {} after {}",
                Shown(wavelength),
                Shown(previous)
            );
            report(pair, message, diagnostics);
            return None;
        }
        samples.push((wavelength, value));
    }
    Some(SpectrumValue::Sampled(samples))
}

/// Returns the value of a key.
pub(super) fn get<'n>(entries: &'n [Entry], key: &str) -> Option<&'n Node> {
    entries.iter().find(|e| e.key == key).map(|e| &e.node)
}

/// Reports every key that is not in `known`.
pub(super) fn only(entries: &[Entry], known: &[&str], diagnostics: &mut Diagnostics) {
    for entry in entries.iter().filter(|e| !known.contains(&&*e.key)) {
        let message = format!("\"{}\" has no meaning here", shorten(&entry.key));
        let help = suggest(&entry.key, known.iter().copied())
            .unwrap_or_else(|| format!("known keys: {}", known.join(", ")));
        let diagnostic = Diagnostic::error(message).help(help);
        diagnostics.push(diagnostic.at(&entry.key_location));
    }
}
