//! Arrays in JData annotations, as text or compressed (docs/guides/tissue-optics.md#input-of-mcx).

use super::super::tree::{Json, Node};
use super::{Reader, field, numbers};
use crate::element::Element;
use crate::jdata::{AnnotatedArray, Annotations, Payload};
use crate::scene::Tensor;
use std::borrow::Cow;

/// Fields of an array that morgana reads.
const KNOWN_FIELDS: [&str; 6] = [
    "_ArrayType_",
    "_ArraySize_",
    "_ArrayOrder_",
    "_ArrayData_",
    "_ArrayZipType_",
    "_ArrayZipData_",
];
/// Fields on compression that morgana does not need to decompress an array.
const IGNORED_FIELDS: [&str; 2] = ["_ArrayZipSize_", "_ArrayZipLevel_"];

/// An array; its last axis runs fastest.
pub(super) struct Array {
    pub element: Element,
    pub tensor: Tensor,
}

/// Returns true if a value is an array in JData annotations.
pub(super) fn is_one(node: &Node) -> bool {
    field(node, "_ArraySize_").is_some() || field(node, "_ArrayType_").is_some()
}

/// Decodes an array; `None` after an error.
pub(super) fn array(node: &Node, reader: &mut Reader) -> Option<Array> {
    reader.known(node, &KNOWN_FIELDS, &IGNORED_FIELDS);
    decoded(node)
        .map_err(|message| reader.error(node, format!("array of JData: {message}")))
        .ok()
}

fn decoded(node: &Node) -> Result<Array, String> {
    let text = |key| match field(node, key).map(|n| &n.json) {
        Some(Json::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let payload = |key| {
        field(node, key).and_then(|value| match &value.json {
            Json::String(text) => Some(Payload::Text(text)),
            _ => numbers(value).map(|numbers| Payload::Numbers(Cow::Owned(numbers))),
        })
    };
    let stored = AnnotatedArray::new(Annotations {
        kind: text("_ArrayType_"),
        size: field(node, "_ArraySize_").and_then(numbers),
        order: text("_ArrayOrder_"),
        zip: text("_ArrayZipType_"),
        data: payload("_ArrayData_"),
        zipped: payload("_ArrayZipData_"),
    });
    let array = stored.and_then(|stored| {
        Ok(Array {
            element: stored.element,
            tensor: stored.tensor()?,
        })
    });
    array.map_err(|e| e.to_string())
}
