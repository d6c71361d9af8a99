//! Several patterns of one source, each of which is a run.

use super::options::{set, take};
use serde_json::{Map, Value, json};

/// Returns the inputs of all runs: one for each pattern of the source, or a single one.
pub(super) fn inputs(mut root: Value) -> Vec<Value> {
    let count = source(&mut root).map_or(1, count);
    if count == 1 {
        return vec![root];
    }
    let of = |number: usize| {
        let mut input = root.clone();
        if let Some(source) = source(&mut input) {
            set(source, PATTERN, json!(number));
        }
        input
    };
    (1..=count).map(of).collect()
}

/// Key that selects a pattern.
const PATTERN: &str = "PatternID";

/// Largest number of patterns of a source.
const MAX_PATTERNS: usize = 65536;

/// Returns the number of patterns that are wanted.
fn count(source: &mut Map<String, Value>) -> usize {
    let is_chosen = take(source, PATTERN).inspect(|id| {
        source.insert(PATTERN.to_owned(), id.clone());
    });
    if is_chosen.is_some_and(|id| id.as_f64() != Some(0.0)) {
        return 1;
    }
    let find = |key: &str| {
        let mut entries = source.iter();
        let found = entries.find(|(k, _)| k.eq_ignore_ascii_case(key));
        found.map(|(_, value)| value)
    };
    let stated = find("SrcNum").and_then(Value::as_u64).unwrap_or(1);
    let shape = find("Pattern").and_then(|pattern| pattern["_ArraySize_"].as_array());
    let of_shape = match shape.map(Vec::as_slice) {
        Some([first, _, _]) => first.as_u64().unwrap_or(1),
        _ => 1,
    };
    let count = if stated > 1 { stated } else { of_shape };
    usize::try_from(count).map_or(1, |n| n.clamp(1, MAX_PATTERNS))
}

/// Returns the source of an input.
fn source(root: &mut Value) -> Option<&mut Map<String, Value>> {
    let optode = section(root, "Optode")?;
    section(optode, "Source")?.as_object_mut()
}

/// Returns the value of a key, whatever the case of its letters.
fn section<'a>(root: &'a mut Value, name: &str) -> Option<&'a mut Value> {
    let mut entries = root.as_object_mut()?.iter_mut();
    let found = entries.find(|(key, _)| key.eq_ignore_ascii_case(name));
    found.map(|(_, value)| value)
}
