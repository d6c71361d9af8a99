//! Arrays in JData annotations, as text or compressed (docs/guides/tissue-optics.md#input-of-mcx).

use super::super::tree::{Json, Node};
use super::{Reader, field, numbers};
use crate::element::Element;
use crate::scene::{Numbers, Tensor};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::{GzDecoder, ZlibDecoder};
use std::io::Read;

/// Fields of an array that morgana reads.
const KNOWN_FIELDS: [&str; 5] = [
    "_ArrayType_",
    "_ArraySize_",
    "_ArrayData_",
    "_ArrayZipType_",
    "_ArrayZipData_",
];
/// Fields on compression that morgana does not need to decompress an array.
const IGNORED_FIELDS: [&str; 2] = ["_ArrayZipSize_", "_ArrayZipLevel_"];
/// Largest number of elements of an array.
const MAX_ELEMENTS: usize = 1 << 31;

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
    let element = element(node)?;
    let shape = shape(node)?;
    let count = shape.iter().try_fold(1usize, |n, m| n.checked_mul(*m));
    let count = count
        .filter(|n| (1..=MAX_ELEMENTS).contains(n))
        .ok_or("an array needs _ArraySize_ and numbers")?;
    let values = match field(node, "_ArrayZipData_") {
        Some(data) => values(&unzipped(node, data, count * element.size())?, element),
        None => match field(node, "_ArrayData_") {
            Some(data) if numbers(data).is_some() => {
                Numbers::Double(numbers(data).unwrap_or_default())
            }
            _ => {
                return Err(
                    "an array needs _ArrayData_, a list of numbers, or _ArrayZipData_, a text, with _ArrayZipType_"
                        .to_owned(),
                );
            }
        },
    };
    let tensor = Tensor::new(shape, values).map_err(|e| e.to_string())?;
    Ok(Array { element, tensor })
}

fn element(node: &Node) -> Result<Element, String> {
    let name = match field(node, "_ArrayType_").map(|n| &n.json) {
        Some(Json::String(name)) => name.as_str(),
        _ => "",
    };
    let found = match name {
        "single" => Some(Element::F32),
        "double" => Some(Element::F64),
        name => Element::of_name(name),
    };
    found.ok_or_else(|| {
        format!(
            "_ArrayType_ is '{name}', but must be uint8, int8, uint16, ..., int64, single or double"
        )
    })
}

fn shape(node: &Node) -> Result<Vec<usize>, String> {
    let sizes = field(node, "_ArraySize_").and_then(numbers);
    let whole = |v: &f64| (v.fract() == 0.0 && *v >= 1.0).then_some(*v as usize);
    sizes
        .and_then(|sizes| sizes.iter().map(whole).collect())
        .ok_or_else(|| "_ArraySize_ must be a list of whole numbers, each at least 1".to_owned())
}

/// Decompresses the bytes of an array. Reads at most one byte more than the array has.
fn unzipped(node: &Node, data: &Node, expected: usize) -> Result<Vec<u8>, String> {
    let Json::String(text) = &data.json else {
        return Err("_ArrayZipData_ must be a text".to_owned());
    };
    let packed: Vec<u8> = text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
    let packed = STANDARD
        .decode(packed)
        .map_err(|e| format!("_ArrayZipData_ is not base64: {e}"))?;
    let kind = match field(node, "_ArrayZipType_").map(|n| &n.json) {
        Some(Json::String(kind)) => kind.to_ascii_lowercase(),
        _ => String::new(),
    };
    let unpacked: Box<dyn Read> = match kind.as_str() {
        "zlib" => Box::new(ZlibDecoder::new(&*packed)),
        "gzip" => Box::new(GzDecoder::new(&*packed)),
        "base64" => Box::new(&*packed),
        _ => {
            return Err(format!(
                "_ArrayZipType_ is '{kind}', but must be zlib, gzip or base64"
            ));
        }
    };
    let mut bytes = Vec::new();
    unpacked
        .take(expected as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| format!("_ArrayZipData_ is not valid {kind}: {e}"))?;
    if bytes.len() == expected {
        Ok(bytes)
    } else {
        let more = if bytes.len() > expected {
            "more"
        } else {
            "less"
        };
        Err(format!(
            "_ArrayZipData_ has {more} than the {expected} bytes of _ArraySize_"
        ))
    }
}

fn values(bytes: &[u8], element: Element) -> Numbers {
    let count = bytes.len() / element.size();
    if element.is_single() {
        let mut values = Vec::with_capacity(count);
        element.decode(bytes, &mut |v| values.push(v as f32));
        Numbers::Single(values)
    } else {
        let mut values = Vec::with_capacity(count);
        element.decode(bytes, &mut |v| values.push(v));
        Numbers::Double(values)
    }
}
