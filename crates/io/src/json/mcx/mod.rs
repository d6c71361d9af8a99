//! Reading input files of MCX as scenes: a volume of labels, a source, and cells of fluence.
//!
//! MCX: Q. Fang and D. A. Boas, "Monte Carlo simulation of photon migration in 3D turbid media
//! accelerated by graphics processing units", Optics Express 2009.
//!
//! A scene unit is a millimetre. A field that morgana does not read is an error if it would change
//! the result, otherwise a warning.

mod across;
mod coefficients;
mod detectors;
mod emitter;
mod jdata;
mod labels;
mod mirrors;
mod pattern;
mod rays;
mod reader;
mod shapes;
mod source;
mod volume;

use super::tree::{Entry, Json, Node};
use crate::diagnostic::{Diagnostics, Location};
use crate::input::Limits;
use crate::scene::Tensor;
use detectors::Recording;
use labels::Labels;
use reader::{Reader, field, numbers, rows};
use serde_json::{Value, json};
use volume::Voxels;

/// Speed of light in millimetres per second.
const LIGHT: f64 = 2.997_924_58e11;

/// Fields of the domain that morgana reads.
const DOMAIN: [&str; 11] = [
    "VolumeFile",
    "Volume",
    "Dim",
    "OriginType",
    "LengthUnit",
    "Media",
    "MediaFormat",
    "ArrayOrder",
    "InverseCDF",
    "Step",
    "Name",
];

/// Fields of a session that only change files, devices or messages.
const SESSION: [&str; 18] = [
    "BlockSize",
    "DebugFlag",
    "DoAutoThread",
    "DoSaveExit",
    "DoSaveSeed",
    "DoSaveVolume",
    "DoDCS",
    "GPUID",
    "ID",
    "MaxJumpDebug",
    "MinEnergy",
    "OutputFormat",
    "RNGSeed",
    "RootPath",
    "SaveDataMask",
    "ThreadNum",
    "WorkloadSize",
    "Comment",
];

/// Returns true for an input file of MCX. No scene has these keys.
pub(super) fn is_one(root: &Node) -> bool {
    let has = |key| field(root, key).is_some();
    has("Domain") && has("Optode") && !has("type")
}

/// Makes the scene that an input file describes; `None` after an error.
pub(super) fn scene(root: &Node, limits: Limits, diagnostics: &mut Diagnostics) -> Option<Node> {
    let errors = diagnostics.error_count();
    let mut reader = Reader {
        limits,
        diagnostics,
    };
    let [domain, optode] = ["Domain", "Optode"].map(|key| field(root, key));
    let (domain, optode) = (domain?, optode?);
    reader.known(domain, &DOMAIN, &["CacheBoxP0", "CacheBoxP1"]);
    reader.known(optode, &["Source", "Detector"], &[]);
    let unit = reader.number_or(domain, "LengthUnit", 1.0);
    reader.only(domain, "Step", |v| {
        numbers(v).is_some_and(|v| v.iter().all(|v| *v == 1.0))
    });
    let media = reader.media(domain);
    let phase = rays::cosines(domain, &mut reader);
    let phase = phase.map(|quantiles| json!({"type": "tabphase", "quantiles": quantiles}));
    let properties = Properties {
        media: media.as_deref(),
        unit,
        phase: phase.as_ref(),
    };
    let voxels = volume::voxels(root, domain, properties, &mut reader);
    let labels = voxels.as_ref().map(Voxels::labels);
    let from_zero = reader.number_or(domain, "OriginType", 0.0) != 0.0;
    let place = Place {
        unit,
        first: if from_zero { 0.0 } else { 1.0 },
    };
    let source = field(optode, "Source");
    if source.is_none() {
        reader.error(optode, "Optode needs a Source");
    }
    let sources = source.and_then(|s| emitter::emitters(s, &place, labels, &mut reader));
    let settings = reader.settings(root, source);
    let detectors = field(optode, "Detector");
    let detectors = detectors.map_or_else(Vec::new, |node| {
        detectors::meters(node, &place, &settings, &mut reader)
    });
    if reader.diagnostics.error_count() > errors {
        return None;
    }
    let (voxels, media, sources) = (voxels?, media?, sources?);
    let labels = voxels.labels();
    let edges = labels.size.map(|n| n as f64 * unit);
    let cells = cells(labels, unit, &settings);
    let mut tissue = json!({
        "type": "labels",
        "to_world": [{"scale": edges}],
        "refraction": settings.refraction,
    });
    if settings.measures_surface {
        // Light is recorded where it enters and where it leaves.
        let most = settings.photons.saturating_mul(2);
        tissue["boundary"] = json!({
            "type": "irradiancemeter", "id": "surface", "normalization": "per_watt", "sampler": settings.sampler(),
            "records": true, "max_records": most,
        });
    }
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
    for (name, mirror) in mirrors::shapes(settings.mirrors, labels.size, unit) {
        push(&mut scene, &name, node(mirror, &root.location).json);
    }
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
    let tissue = field_mut(&mut scene, "tissue")?;
    match voxels {
        Voxels::Labels(labels) => {
            push(tissue, "data", Json::Tensor(labels.into_tensor()?));
            push(tissue, "properties", Json::Tensor(media));
            if let Some(phase) = phase {
                let phase = node(phase, &tissue.location);
                push(tissue, "phase", phase.json);
            }
        }
        Voxels::Coefficients(coefficients) => {
            if settings.refraction && media.get(3) != 1.0 {
                let message = "with coefficients of voxels, the n of medium 0 must be 1: divide all indices by it";
                reader.error(domain, message);
                return None;
            }
            coefficients.add_to(tissue, edges)?;
        }
    }
    Some(scene)
}

/// Coordinate system of a file's positions.
struct Place {
    /// Millimetres per voxel.
    unit: f64,
    /// Coordinate of the first voxel's corner.
    first: f64,
}

impl Place {
    /// Converts a position to millimetres from the corner of the volume.
    fn of(&self, position: [f64; 3]) -> [f64; 3] {
        position.map(|x| (x - self.first) * self.unit)
    }
}

/// Optical properties for all voxels.
#[derive(Clone, Copy)]
struct Properties<'a> {
    /// Rows of μ_a, μ_s, g and n.
    media: Option<&'a Tensor>,
    /// Millimetres per voxel.
    unit: f64,
    /// Phase function of all media, instead of their g.
    phase: Option<&'a Value>,
}

/// Settings of a run.
struct Settings {
    photons: i64,
    refraction: bool,
    /// Sides that are mirrors: −x, −y, −z, +x, +y, +z.
    mirrors: [bool; 6],
    /// First, last and width of time gates, in seconds.
    gates: [f64; 3],
    /// True if weight windows equalise the errors of early and late gates. MCX has no such setting.
    weight_windows: bool,
    /// True if a meter `surface` keeps records of all light that leaves.
    measures_surface: bool,
    recording: Recording,
    /// Frequency in Hz at which the power of the source is modulated, or 0.
    frequency: f64,
}

impl Settings {
    fn sampler(&self) -> Value {
        json!({"type": "independent", "sample_count": self.photons})
    }

    /// Makes a meter measure amplitude and phase, if the source is modulated.
    fn modulate(&self, meter: &mut Value) {
        if self.frequency > 0.0 {
            meter["metres_per_unit"] = json!(1e-3);
            meter["modulation_frequencies"] = json!([self.frequency]);
        }
    }
}

/// Makes the meter of the volume's voxels.
fn cells(labels: &Labels, unit: f64, settings: &Settings) -> Value {
    let [nx, ny, nz] = labels.size;
    let mut cells = json!({
        "type": "fluencemeter",
        "normalization": "per_watt",
        "metres_per_unit": 1e-3,
        "nx": nx, "ny": ny, "nz": nz,
        "to_world": [{"scale": [nx as f64 * unit, ny as f64 * unit, nz as f64 * unit]}],
        "sampler": settings.sampler(),
    });
    let [first, last, width] = settings.gates;
    if first > 0.0 || last - first > 1.5 * width {
        cells["min_bound"] = json!(LIGHT * first);
        cells["max_bound"] = json!(LIGHT * last);
        cells["bin_width"] = json!(LIGHT * width);
        cells["weight_windows"] = json!(settings.weight_windows);
    }
    settings.modulate(&mut cells);
    cells
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

/// Converts a value to a tree, with one place for all its nodes.
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

/// Adds a field to an object.
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
