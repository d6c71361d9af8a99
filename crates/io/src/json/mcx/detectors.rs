//! Detectors: meters, with records, of the light that leaves the volume near them.

use super::super::tree::{Json, Node};
use super::{Place, Reader, Settings, field, numbers};
use serde_json::{Value, json};

/// Makes the meters for a list of detectors.
pub(super) fn meters(
    node: &Node,
    place: &Place,
    settings: &Settings,
    reader: &mut Reader,
) -> Vec<Value> {
    let found: Vec<[f64; 4]> = match &node.json {
        Json::Array(items) => items.iter().filter_map(|item| one(item, reader)).collect(),
        Json::Tensor(table) => table.rows().unwrap_or_else(|error| {
            reader.error(
                node,
                format!("each detector must be a row of x, y, z and radius: {error}"),
            );
            Vec::new()
        }),
        Json::Object(_) => one(node, reader).into_iter().collect(),
        _ => {
            reader.error(
                node,
                "Detector must be a list of {\"Pos\": [x, y, z], \"R\": radius}",
            );
            Vec::new()
        }
    };
    found
        .into_iter()
        .map(|d| meter(d, place, settings))
        .collect()
}

/// Settings for records of detected light.
pub(super) struct Recording {
    pub wanted: bool,
    pub most: i64,
}

/// Returns position and radius of a detector; `None` after an error.
fn one(node: &Node, reader: &mut Reader) -> Option<[f64; 4]> {
    if let Some(&[x, y, z, radius]) = numbers(node).as_deref() {
        return Some([x, y, z, radius]);
    }
    if !matches!(node.json, Json::Object(_)) {
        reader.error(
            node,
            "a detector must be {\"Pos\": [x, y, z], \"R\": radius}",
        );
        return None;
    }
    reader.known(node, &["Pos", "R"], &[]);
    let [x, y, z] = reader.numbers(node, "Pos")?;
    let radius = reader.number(node, "R");
    if radius <= 0.0 {
        let at = field(node, "R").unwrap_or(node);
        reader.error(at, "the radius R of a detector must be above 0");
        return None;
    }
    Some([x, y, z, radius])
}

fn meter([x, y, z, radius]: [f64; 4], place: &Place, settings: &Settings) -> Value {
    let recording = &settings.recording;
    let mut meter = json!({
        "type": "irradiancemeter",
        "normalization": "per_watt",
        "center": place.of([x, y, z]),
        "radius": radius * place.unit,
        "records": recording.wanted,
    });
    if recording.wanted {
        meter["max_records"] = json!(recording.most);
    }
    settings.modulate(&mut meter);
    meter
}
