//! Input files of MCX (Q. Fang and D. A. Boas, "Monte Carlo simulation of photon migration in 3D turbid media accelerated by graphics
//! processing units", Optics Express 2009) as scenes: a volume of labels, a source, and cells of fluence.
//!
//! A scene unit is a millimetre. What is not read is an error where it would change the result, and a warning where it would not.

mod detectors;
mod jdata;
mod labels;
mod pattern;
mod shapes;
mod source;
mod volume;

use super::tree::{Entry, Json, Node};
use super::values::{get, value};
use crate::diagnostic::{Diagnostic, Diagnostics, Location};
use crate::scene::{Numbers, Tensor, Value as Held};
use crate::schema::Type;
use detectors::Recording;
use labels::Labels;
use serde_json::{Value, json};
use std::sync::Arc;

/// Speed of light in millimetres per second.
const LIGHT: f64 = 2.997_924_58e11;

/// What is read of the domain.
const DOMAIN: [&str; 9] = [
    "VolumeFile",
    "Volume",
    "Dim",
    "OriginType",
    "LengthUnit",
    "Media",
    "MediaFormat",
    "Step",
    "Name",
];

/// What a session may say that changes files, devices or messages.
const SESSION: [&str; 21] = [
    "BlockSize",
    "DebugFlag",
    "DoAutoThread",
    "DoSaveExit",
    "DoSaveRef",
    "DoSaveSeed",
    "DoSaveVolume",
    "DoSpecular",
    "DoDCS",
    "GPUID",
    "ID",
    "MaxJumpDebug",
    "MinEnergy",
    "OutputFormat",
    "OutputType",
    "RNGSeed",
    "RootPath",
    "SaveDataMask",
    "ThreadNum",
    "WorkloadSize",
    "Comment",
];

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
    reader.known(domain, &DOMAIN, &["CacheBoxP0", "CacheBoxP1"]);
    reader.known(optode, &["Source", "Detector"], &[]);
    let unit = reader.number_or(domain, "LengthUnit", 1.0);
    reader.only(
        domain,
        "MediaFormat",
        |v| matches!(&v.json, Json::String(s) if s == "byte"),
    );
    reader.only(domain, "Step", |v| {
        numbers(v).is_some_and(|v| v.iter().all(|v| *v == 1.0))
    });
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
    let sources = source.and_then(|s| source::emitters(s, &place, labels.as_ref(), &mut reader));
    let settings = reader.settings(root);
    let detectors = field(optode, "Detector");
    let detectors = detectors.map_or_else(Vec::new, |node| {
        detectors::meters(node, &place, &settings.recording, &mut reader)
    });
    if reader.diagnostics.error_count() > errors {
        return None;
    }
    let (labels, media, sources) = (labels?, media?, sources?);
    let cells = cells(&labels, unit, &settings);
    let mut tissue = json!({
        "type": "labels",
        "to_world": [{"scale": labels.size.map(|n| n as f64 * unit)}],
        "refraction": settings.refraction,
    });
    for (i, mut detector) in detectors.into_iter().enumerate() {
        let name = format!("detector{}", i + 1);
        detector["id"] = json!(name);
        detector["sampler"] = settings.sampler();
        tissue[name] = detector;
    }
    let all = json!({
        "type": "scene",
        "integrator": {"type": "particle"},
        "tissue": tissue,
        "cells": cells,
    });
    let mut scene = node(all, &root.location);
    for (i, emitter) in sources.into_iter().enumerate() {
        let mut source = node(emitter.plugin, &root.location);
        if let (Some(image), Some(texture)) = (emitter.image, field_mut(&mut source, "texture")) {
            push(texture, "data", Json::Tensor(image));
        }
        let name = if i == 0 {
            "source".to_owned()
        } else {
            format!("source{}", i + 1)
        };
        push(&mut scene, &name, source.json);
    }
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
    recording: Recording,
}

impl Settings {
    fn sampler(&self) -> Value {
        json!({"type": "independent", "sample_count": self.photons})
    }
}

/// The meter of the volume's voxels.
fn cells(labels: &Labels, unit: f64, settings: &Settings) -> Value {
    let [nx, ny, nz] = labels.size;
    let mut cells = json!({
        "type": "fluencemeter",
        "normalization": "per_watt",
        "nx": nx, "ny": ny, "nz": nz,
        "to_world": [{"scale": [nx as f64 * unit, ny as f64 * unit, nz as f64 * unit]}],
        "sampler": settings.sampler(),
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

    /// A number that a field must have; 0 after an error.
    fn number(&mut self, node: &Node, key: &str) -> f64 {
        if field(node, key).is_none() {
            self.error(node, format!("{key} is missing"));
        }
        self.number_or(node, key, 0.0)
    }

    /// Refuses a field whose value is not as it `must` be.
    fn only(&mut self, node: &Node, key: &str, must: impl Fn(&Node) -> bool) {
        if let Some(value) = field(node, key).filter(|v| !must(v)) {
            let message =
                format!("this {key} is not read: give LengthUnit, and a byte for each voxel");
            self.error(value, message);
        }
    }

    /// Refuses fields other than those that are `read`, and those that do not change the result.
    fn known(&mut self, node: &Node, read: &[&str], harmless: &[&str]) {
        let Json::Object(entries) = &node.json else {
            return;
        };
        for entry in entries {
            let is = |name: &&str| entry.key.eq_ignore_ascii_case(name);
            if !read.iter().chain(harmless).any(is) {
                let message = format!("'{}' is not read, and may change the result", entry.key);
                self.error(&entry.node, message);
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

    /// Rows of at least so many numbers, or one of them.
    fn table(&mut self, node: &Node, key: &str, least: usize) -> Option<Vec<Vec<f64>>> {
        let Some(value) = field(node, key) else {
            self.error(node, format!("{key} is missing"));
            return None;
        };
        let found = rows(value).filter(|rows| {
            let enough = |row: &Vec<f64>| row.len() >= least && row.iter().all(|v| v.is_finite());
            !rows.is_empty() && rows.iter().all(enough)
        });
        if found.is_none() {
            let message =
                format!("{key} is a list of {least} or more numbers, or a list of such lists");
            self.error(value, message);
        }
        found
    }

    /// An array that a program hands over: small ones come as lists of lists.
    fn array(&mut self, node: &Node) -> Option<Arc<Tensor>> {
        match value(node, Some(Type::Tensor), self.diagnostics) {
            Some(Held::Tensor(array)) => Some(array),
            _ => None,
        }
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
        let names = ["mua", "mus", "g", "n"];
        let mut table = Vec::with_capacity(4 * rows.len());
        for row in rows {
            if matches!(row.json, Json::Object(_)) {
                self.known(row, &names, &["label", "name"]);
                table.extend(names.map(|name| self.number(row, name)));
            } else if let Some(numbers) = numbers(row).filter(|numbers| numbers.len() == 4) {
                table.extend(numbers);
            } else {
                self.error(
                    row,
                    "a medium is {\"mua\", \"mus\", \"g\", \"n\"}, or these four numbers",
                );
                return None;
            }
        }
        let numbers = Numbers::Double(table);
        Tensor::new(vec![rows.len(), 4], numbers).map(Arc::new).ok()
    }

    fn settings(&mut self, root: &Node) -> Settings {
        let nothing = node(json!({}), &root.location);
        let session = field(root, "Session").unwrap_or(&nothing);
        let forward = field(root, "Forward").unwrap_or(&nothing);
        let read = [
            "Photons",
            "DoMismatch",
            "DoNormalize",
            "DoPartialPath",
            "MaxDetPhoton",
            "MaxDetPhotons",
        ];
        self.known(session, &read, &SESSION);
        self.known(forward, &["T0", "T1", "Dt"], &[]);
        if self.number_or(session, "DoNormalize", 1.0) != 1.0 {
            self.error(session, "DoNormalize is 1: values are fluence per joule");
        }
        let photons = self.number_or(session, "Photons", 1e6);
        let most = self.number_or(session, "MaxDetPhotons", 1e6);
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
            recording: Recording {
                wanted: self.number_or(session, "DoPartialPath", 1.0) != 0.0,
                most: self.number_or(session, "MaxDetPhoton", most).max(1.0) as i64,
            },
        }
    }
}

/// Rows of numbers, or one of them.
fn rows(node: &Node) -> Option<Vec<Vec<f64>>> {
    match &node.json {
        Json::Tensor(tensor) => {
            let columns = *tensor.shape().last().filter(|n| **n > 0)?;
            let all: Vec<f64> = tensor.iter().collect();
            Some(all.chunks_exact(columns).map(<[f64]>::to_vec).collect())
        }
        Json::Array(items) if items.iter().all(|item| item.number().is_none()) => {
            items.iter().map(numbers).collect()
        }
        _ => Some(vec![numbers(node)?]),
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
