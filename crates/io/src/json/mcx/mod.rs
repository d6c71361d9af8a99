//! Input files of MCX (Q. Fang and D. A. Boas, "Monte Carlo simulation of photon migration in 3D turbid media accelerated by graphics
//! processing units", Optics Express 2009) as scenes: a volume of labels, a source, and cells of fluence.
//!
//! A scene unit is a millimetre. What is not read is an error where it would change the result, and a warning where it would not.

mod labels;
mod shapes;
mod source;
mod volume;

use super::tree::{Entry, Json, Node};
use super::values::get;
use crate::diagnostic::{Diagnostic, Diagnostics, Location};
use crate::scene::{Numbers, Tensor};
use labels::Labels;
use serde_json::{Value, json};
use std::sync::Arc;

/// Speed of light in millimetres per second.
const LIGHT: f64 = 2.997_924_58e11;

/// Whether a file is of MCX: no scene has these keys.
pub(super) fn is_one(root: &Node) -> bool {
    let has = |key| field(root, key).is_some();
    has("Domain") && has("Optode") && !has("type")
}

/// The scene that an input file describes; `None` after an error.
pub(super) fn scene(root: &Node, diagnostics: &mut Diagnostics) -> Option<Node> {
    let errors = diagnostics.error_count();
    let mut reader = Reader { diagnostics };
    let [domain, optode] = ["Domain", "Optode"].map(|key| field(root, key));
    let (domain, optode) = (domain?, optode?);
    let unit = reader.number_or(domain, "LengthUnit", 1.0);
    let media = reader.media(domain);
    let labels = volume::labels(root, domain, &mut reader);
    let from_zero = reader.number_or(domain, "OriginType", 0.0) != 0.0;
    let place = Place {
        unit,
        first: if from_zero { 0.0 } else { 1.0 },
    };
    let source = field(optode, "Source");
    if source.is_none() {
        reader.error(optode, "Optode needs a Source");
    }
    let source = source.and_then(|s| source::emitter(s, &place, labels.as_ref(), &mut reader));
    if let Some(detector) = field(optode, "Detector") {
        let message = "detectors are not read: all light is measured, in cells of fluence";
        reader.warning(detector, message);
    }
    let settings = reader.settings(root);
    if reader.diagnostics.error_count() > errors {
        return None;
    }
    let (labels, media, source) = (labels?, media?, source?);
    let cells = cells(&labels, unit, &settings);
    let tissue = json!({
        "type": "labels",
        "to_world": [{"scale": labels.size.map(|n| n as f64 * unit)}],
        "refraction": settings.refraction,
    });
    let all = json!({
        "type": "scene",
        "integrator": {"type": "particle"},
        "tissue": tissue,
        "source": source,
        "cells": cells,
    });
    let mut scene = node(all, &root.location);
    if let Some(tissue) = field_mut(&mut scene, "tissue") {
        push(tissue, "data", Json::Tensor(labels.tensor()?));
        push(tissue, "properties", Json::Tensor(media));
    }
    Some(scene)
}

/// Where positions of a file are.
struct Place {
    /// Millimetres per voxel.
    unit: f64,
    /// Coordinate of the first voxel's corner.
    first: f64,
}

impl Place {
    /// A position in millimetres from the corner of the volume.
    fn of(&self, position: [f64; 3]) -> [f64; 3] {
        position.map(|x| (x - self.first) * self.unit)
    }
}

/// What a run is to do.
struct Settings {
    photons: i64,
    refraction: bool,
    /// First, last and width of time gates, in seconds.
    gates: [f64; 3],
}

/// The meter of the volume's voxels.
fn cells(labels: &Labels, unit: f64, settings: &Settings) -> Value {
    let [nx, ny, nz] = labels.size;
    let mut cells = json!({
        "type": "fluencemeter",
        "normalization": "per_watt",
        "nx": nx, "ny": ny, "nz": nz,
        "to_world": [{"scale": [nx as f64 * unit, ny as f64 * unit, nz as f64 * unit]}],
        "sampler": {"type": "independent", "sample_count": settings.photons},
    });
    let [first, last, width] = settings.gates;
    if first > 0.0 || last - first > 1.5 * width {
        cells["min_bound"] = json!(LIGHT * first);
        cells["max_bound"] = json!(LIGHT * last);
        cells["bin_width"] = json!(LIGHT * width);
    }
    cells
}

/// Reads fields and reports what is wrong with them.
struct Reader<'d> {
    diagnostics: &'d mut Diagnostics,
}

impl Reader<'_> {
    fn error(&mut self, at: &Node, message: impl Into<String>) {
        self.diagnostics
            .push(Diagnostic::error(message).at(&at.location));
    }

    fn warning(&mut self, at: &Node, message: impl Into<String>) {
        self.diagnostics
            .push(Diagnostic::warning(message).at(&at.location));
    }

    /// A number or a truth value that a field may have.
    fn number_or(&mut self, node: &Node, key: &str, default: f64) -> f64 {
        let Some(value) = field(node, key) else {
            return default;
        };
        match (value.number(), &value.json) {
            (Some(v), _) => v,
            (None, Json::Boolean(v)) => f64::from(u8::from(*v)),
            _ => {
                self.error(value, format!("{key} is a number"));
                default
            }
        }
    }

    /// At least so many numbers.
    fn numbers<const N: usize>(&mut self, node: &Node, key: &str) -> Option<[f64; N]> {
        let Some(value) = field(node, key) else {
            self.error(node, format!("{key} is missing"));
            return None;
        };
        let found = numbers(value).and_then(|all| all.get(..N)?.try_into().ok());
        if found.is_none() {
            self.error(value, format!("{key} is a list of {N} numbers"));
        }
        found
    }

    /// The table of media: a row for each label.
    fn media(&mut self, domain: &Node) -> Option<Arc<Tensor>> {
        let Some(media) = field(domain, "Media") else {
            self.error(domain, "Media is missing");
            return None;
        };
        match &media.json {
            Json::Tensor(table) => Some(table.clone()),
            Json::Array(rows) => self.rows(rows),
            _ => {
                self.error(media, "Media is a list of {\"mua\", \"mus\", \"g\", \"n\"}");
                None
            }
        }
    }

    /// Media as objects, or as four numbers each.
    fn rows(&mut self, rows: &[Node]) -> Option<Arc<Tensor>> {
        let mut table = Vec::with_capacity(4 * rows.len());
        for row in rows {
            if let Some(numbers) = numbers(row).filter(|numbers| numbers.len() == 4) {
                table.extend(numbers);
                continue;
            }
            for (key, default) in [("mua", 0.0), ("mus", 0.0), ("g", 1.0), ("n", 1.0)] {
                table.push(self.number_or(row, key, default));
            }
        }
        let numbers = Numbers::Double(table);
        Tensor::new(vec![rows.len(), 4], numbers).map(Arc::new).ok()
    }

    fn settings(&mut self, root: &Node) -> Settings {
        let nothing = node(json!({}), &root.location);
        let session = field(root, "Session").unwrap_or(&nothing);
        let forward = field(root, "Forward").unwrap_or(&nothing);
        let photons = self.number_or(session, "Photons", 1e6);
        let t0 = self.number_or(forward, "T0", 0.0);
        let t1 = self.number_or(forward, "T1", 5e-9);
        let dt = self.number_or(forward, "Dt", t1 - t0);
        if !(photons >= 1.0 && t0 >= 0.0 && t1 > t0 && dt > 0.0) {
            self.error(
                root,
                "the number of photons, and times T0 < T1 in steps of Dt, are positive",
            );
        }
        Settings {
            photons: photons.round() as i64,
            refraction: self.number_or(session, "DoMismatch", 1.0) != 0.0,
            gates: [t0, t1, dt.min(t1 - t0)],
        }
    }
}

/// The value of a key, whatever the case of its letters.
fn field<'n>(node: &'n Node, key: &str) -> Option<&'n Node> {
    let Json::Object(entries) = &node.json else {
        return None;
    };
    let same = |entry: &&Entry| entry.key.eq_ignore_ascii_case(key);
    get(entries, key).or_else(|| entries.iter().find(same).map(|entry| &entry.node))
}

fn field_mut<'n>(node: &'n mut Node, key: &str) -> Option<&'n mut Node> {
    let Json::Object(entries) = &mut node.json else {
        return None;
    };
    entries
        .iter_mut()
        .find(|e| e.key == key)
        .map(|e| &mut e.node)
}

/// The numbers of a list.
fn numbers(node: &Node) -> Option<Vec<f64>> {
    match &node.json {
        Json::Array(items) => items.iter().map(Node::number).collect(),
        Json::Tensor(tensor) => Some(tensor.iter().collect()),
        _ => None,
    }
}

/// A tree of a value, as if it had been written at one place.
fn node(value: Value, at: &Location) -> Node {
    let json = match value {
        Value::Null => Json::Null,
        Value::Bool(v) => Json::Boolean(v),
        Value::Number(v) => v
            .as_i64()
            .map_or_else(|| Json::Float(v.as_f64().unwrap_or(0.0)), Json::Integer),
        Value::String(v) => Json::String(v),
        Value::Array(items) => Json::Array(items.into_iter().map(|v| node(v, at)).collect()),
        Value::Object(entries) => Json::Object(
            entries
                .into_iter()
                .map(|(key, value)| Entry {
                    key,
                    key_location: at.clone(),
                    node: node(value, at),
                })
                .collect(),
        ),
    };
    Node {
        json,
        location: at.clone(),
    }
}

/// Adds a field.
fn push(node: &mut Node, key: &str, json: Json) {
    let location = node.location.clone();
    if let Json::Object(entries) = &mut node.json {
        entries.push(Entry {
            key: key.to_owned(),
            key_location: location.clone(),
            node: Node { json, location },
        });
    }
}
