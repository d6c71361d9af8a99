//! The structure of glTF files.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::Value;

use super::wrong;
use crate::error::Problem;

/// A file with its buffers.
pub(super) struct Document {
    pub json: Value,
    pub buffers: Vec<Vec<u8>>,
}

impl Document {
    pub fn new(
        bytes: &[u8],
        load: impl Fn(&str) -> Result<Vec<u8>, Problem>,
    ) -> Result<Self, Problem> {
        let (text, binary) = parts(bytes)?;
        let json: Value = serde_json::from_slice(text).map_err(|e| wrong(e.to_string()))?;
        let version = json["asset"]["version"]
            .as_str()
            .unwrap_or("without a version");
        if !version.starts_with("2.") {
            return Err(wrong(format!("the file is of version '{version}'")));
        }
        let mut buffers = Vec::new();
        for buffer in list(&json, "buffers") {
            let data = match buffer["uri"].as_str() {
                None => binary
                    .ok_or_else(|| wrong("the binary part is missing"))?
                    .to_vec(),
                Some(uri) => match uri.strip_prefix("data:") {
                    Some(data) => embedded(data)?,
                    None => load(&name(uri).ok_or_else(|| wrong("a file name is not UTF-8"))?)?,
                },
            };
            let expected = index(buffer, "byteLength").unwrap_or(0) as u64;
            let found = data.len() as u64;
            if found < expected {
                return Err(Problem::Truncated { expected, found });
            }
            buffers.push(data);
        }
        Ok(Document { json, buffers })
    }

    /// One of the objects of a list.
    pub fn item(&self, list: &str, index: usize) -> Result<&Value, Problem> {
        let item = self.json[list].get(index);
        item.ok_or_else(|| wrong(format!("there is no number {index} among its '{list}'")))
    }
}

/// Names of the files that hold buffers.
pub(super) fn data_files(bytes: &[u8]) -> Vec<String> {
    let text = parts(bytes).map_or(&[][..], |(text, _)| text);
    let json: Value = serde_json::from_slice(text).unwrap_or_default();
    let uris = list(&json, "buffers")
        .iter()
        .filter_map(|b| b["uri"].as_str());
    let files = uris.filter(|uri| !uri.starts_with("data:"));
    files.filter_map(name).collect()
}

/// The JSON of a file, and the buffer of a binary one.
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Problem> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let (text, rest) = bytes
        .get(12..)
        .and_then(|b| chunk(b, b"JSON"))
        .ok_or_else(early)?;
    Ok((text, chunk(rest, b"BIN\0").map(|(binary, _)| binary)))
}

fn early() -> Problem {
    wrong("the file ends early")
}

/// A chunk of a binary file: length, kind, content; and what follows.
fn chunk<'b>(bytes: &'b [u8], kind: &[u8; 4]) -> Option<(&'b [u8], &'b [u8])> {
    let (head, rest) = bytes.split_at_checked(8)?;
    let length = u32::from_le_bytes(*head.first_chunk()?);
    rest.split_at_checked(length as usize)
        .filter(|_| head.ends_with(kind))
}

fn name(uri: &str) -> Option<String> {
    urlencoding::decode(uri).ok().map(|name| name.into_owned())
}

fn embedded(uri: &str) -> Result<Vec<u8>, Problem> {
    let data = uri.split_once(";base64,").map(|(_, data)| data);
    let data = data.ok_or_else(|| wrong("embedded data are not base64"))?;
    BASE64_STANDARD
        .decode(data)
        .map_err(|e| wrong(e.to_string()))
}

/// A list; empty if there is none.
pub(super) fn list<'v>(object: &'v Value, name: &str) -> &'v [Value] {
    object[name].as_array().map_or(&[], Vec::as_slice)
}

/// A whole number.
pub(super) fn index(object: &Value, name: &str) -> Option<usize> {
    usize::try_from(object[name].as_u64()?).ok()
}

/// A list of so many numbers, if there is one.
pub(super) fn numbers<const N: usize>(
    object: &Value,
    name: &str,
) -> Result<Option<[f64; N]>, Problem> {
    if object[name].is_null() {
        return Ok(None);
    }
    let values: Option<Vec<f64>> = list(object, name).iter().map(Value::as_f64).collect();
    let values = values.and_then(|v| <[f64; N]>::try_from(v).ok());
    let expected = || wrong(format!("'{name}' is not a list of {N} numbers"));
    values.map(Some).ok_or_else(expected)
}
