//! Structure of glTF files.

use std::borrow::Cow;
use std::collections::HashMap;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::Value;

use super::wrong;
use crate::error::Problem;
use crate::input::Limits;

/// Maximum memory for a JSON value with its name, in bytes.
const BYTES_PER_VALUE: u64 = 128;

/// File with its buffers.
pub(super) struct Document<'a> {
    pub json: Value,
    /// Bytes of all buffers. A file that several buffers share is stored once.
    pub data: Vec<Cow<'a, [u8]>>,
    /// Index into `data` of each buffer.
    pub buffers: Vec<usize>,
    /// Size of the file and of the files of its buffers, in bytes.
    pub size: u64,
}

impl<'a> Document<'a> {
    pub(super) fn new(
        bytes: &'a [u8],
        load: impl Fn(&str) -> Result<Vec<u8>, Problem>,
        limits: Limits,
    ) -> Result<Self, Problem> {
        let (text, binary) = parts(bytes)?;
        limits.check(values(text), BYTES_PER_VALUE, bytes.len() as u64)?;
        let json: Value = serde_json::from_slice(text).map_err(|e| wrong(e.to_string()))?;
        let no_version = || wrong("it does not state its version (asset.version)");
        let version = json["asset"]["version"].as_str().ok_or_else(no_version)?;
        if !version.starts_with("2.") {
            return Err(wrong(format!("the file is of version '{version}'")));
        }
        check_extensions(&json)?;
        let mut known: HashMap<Option<&str>, usize> = HashMap::new();
        let (mut data, mut buffers) = (Vec::new(), Vec::new());
        let mut size = bytes.len() as u64;
        for buffer in list(&json, "buffers") {
            let uri = buffer["uri"].as_str();
            let at = match known.get(&uri) {
                Some(at) => *at,
                None => {
                    let bytes = contents(uri, binary, &load)?;
                    if uri.is_some_and(|uri| !uri.starts_with("data:")) {
                        size += bytes.len() as u64;
                    }
                    known.insert(uri, data.len());
                    data.push(bytes);
                    data.len() - 1
                }
            };
            let expected = index(buffer, "byteLength").unwrap_or(0) as u64;
            let found = data[at].len() as u64;
            if found < expected {
                return Err(Problem::Truncated { expected, found });
            }
            buffers.push(at);
        }
        Ok(Document {
            json,
            data,
            buffers,
            size,
        })
    }

    /// Returns an item of a list.
    pub(super) fn item(&self, list: &str, index: usize) -> Result<&Value, Problem> {
        let item = self.json[list].get(index);
        item.ok_or_else(|| wrong(format!("there is no number {index} among its '{list}'")))
    }
}

/// Returns the bytes of a buffer: from the file itself, a text or another file.
fn contents<'a>(
    uri: Option<&str>,
    binary: Option<&'a [u8]>,
    load: impl Fn(&str) -> Result<Vec<u8>, Problem>,
) -> Result<Cow<'a, [u8]>, Problem> {
    let Some(uri) = uri else {
        let missing = || wrong("the binary part is missing");
        return binary.map(Cow::from).ok_or_else(missing);
    };
    let bytes = match uri.strip_prefix("data:") {
        Some(data) => embedded(data)?,
        None => {
            let name = name(uri).ok_or_else(|| wrong("a file name is not UTF-8"))?;
            let in_buffer = |e| Problem::Malformed(format!("its buffer '{name}': {e}"));
            load(&name).map_err(in_buffer)?
        }
    };
    Ok(bytes.into())
}

/// Unsupported extensions that change the geometry.
const NOT_READ: [&str; 4] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_meshopt_compression",
];

/// Checks that the file does not require an unsupported extension.
fn check_extensions(json: &Value) -> Result<(), Problem> {
    let mut required = list(json, "extensionsRequired")
        .iter()
        .filter_map(Value::as_str);
    match required.find(|name| NOT_READ.contains(name)) {
        Some(name) => Err(Problem::Unsupported(format!(
            "the glTF extension '{name}': write the file without it"
        ))),
        None => Ok(()),
    }
}

/// Returns an upper bound of the number of values in a JSON text: each except the first follows a
/// comma or begins a list or an object.
fn values(text: &[u8]) -> u64 {
    let (mut count, mut inside, mut escaped) = (1, false, false);
    for byte in text {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = inside,
            b'"' => inside = !inside,
            b',' | b'[' | b'{' if !inside => count += 1,
            _ => {}
        }
    }
    count
}

/// Returns the names of the files of buffers.
pub(super) fn data_files(bytes: &[u8], limits: Limits) -> Vec<String> {
    let text = parts(bytes).map_or(&[][..], |(text, _)| text);
    if limits
        .check(values(text), BYTES_PER_VALUE, bytes.len() as u64)
        .is_err()
    {
        return Vec::new();
    }
    let json: Value = serde_json::from_slice(text).unwrap_or_default();
    let uris = list(&json, "buffers")
        .iter()
        .filter_map(|b| b["uri"].as_str());
    let files = uris.filter(|uri| !uri.starts_with("data:"));
    files.filter_map(name).collect()
}

/// Returns the JSON of a file, and the buffer of a binary file.
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

/// Splits a chunk of a binary file, which has length, kind and content, from the bytes after it.
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

/// Returns a list; empty if there is none.
pub(super) fn list<'v>(object: &'v Value, name: &str) -> &'v [Value] {
    object[name].as_array().map_or(&[], Vec::as_slice)
}

/// Returns a whole number.
pub(super) fn index(object: &Value, name: &str) -> Option<usize> {
    usize::try_from(object[name].as_u64()?).ok()
}

/// Returns a list of `N` numbers, if there is one.
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
