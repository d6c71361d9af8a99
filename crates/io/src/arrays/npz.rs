//! Arrays in NPZ archives.

use super::{Array, Arrays, Read, npy_file};
use crate::element::Element;
use crate::error::{FileError, Problem};
use crate::input::{Budget, Limits};
use crate::volume::INFLATION;
use crate::{input, npy, npz};
use serde_json::{Map, Value, json};
use std::io::{self, Read as _, Seek};
use std::path::Path;
use zip::ZipArchive;
use zip::result::ZipError;

/// Largest number of bytes of metadata that are read.
const MAX_METADATA: u64 = 64 << 20;

/// Writes all arrays and a text `metadata`.
pub(super) fn write(path: &Path, arrays: &Arrays, element: Element) -> Result<(), FileError> {
    npz::write(path, |archive| {
        for array in &arrays.list {
            let element = arrays.element(array, element);
            let file = archive.member(&array.name, array.data.len() * element.size())?;
            let values = array.data.iter().copied();
            npy::write_elements(file, element, &array.shape, values)?;
        }
        npy::write_text(archive.member("metadata", 0)?, &metadata(arrays))
    })
}

/// Returns the attributes, and units and axes of all arrays, as JSON.
pub(super) fn metadata(arrays: &Arrays) -> String {
    let about = arrays.list.iter().map(|array| {
        let value = json!({"unit": array.unit, "axes": array.axes});
        (array.name.clone(), value)
    });
    let mut all: Map<String, Value> = arrays.attributes.iter().cloned().collect();
    all.insert("arrays".into(), about.collect::<Map<_, _>>().into());
    Value::from(all).to_string()
}

/// Reads the arrays of an archive. Units and axes come from [`write`]; in other archives, axes are
/// numbered.
///
/// # Errors
///
/// Returns an error if the file is not an NPZ archive, or if its members overlap.
pub(super) fn read(path: &Path, limits: Limits) -> Result<Read, Problem> {
    let (file, size) = input::open(path).map_err(|error| error.problem)?;
    let mut archive = ZipArchive::new(file).map_err(not_an_archive)?;
    refuse_overlaps(&mut archive, size)?;
    let mut names: Vec<String> = (archive.file_names().filter_map(Result::ok))
        .filter_map(|name| name.strip_suffix(".npy").map(str::to_owned))
        .collect();
    let metadata = match names.iter().position(|name| name == "metadata") {
        Some(i) => {
            names.remove(i);
            metadata_of(&mut archive)?
        }
        None => Value::Null,
    };
    if let Some(about) = metadata["arrays"].as_object() {
        names = about.keys().cloned().collect();
    }
    let mut read = Read::default();
    let mut budget = Budget::new(limits, size);
    for name in &names {
        let array = member(&mut archive, name, &mut budget, size);
        let array = array.and_then(|array| described(array, &metadata["arrays"][name]));
        read.add(name, array);
    }
    let attributes = metadata.as_object().into_iter().flatten();
    let attributes = attributes.filter(|(name, _)| *name != "arrays");
    read.attributes = attributes.map(|(n, v)| (n.clone(), v.clone())).collect();
    Ok(read)
}

fn not_an_archive(reason: ZipError) -> Problem {
    Problem::WrongFormat {
        format: "NPZ",
        reason: format!("it is not a readable archive ({reason})"),
    }
}

fn foreign(reason: impl std::fmt::Display) -> Problem {
    Problem::Unsupported(format!("this archive of arrays ({reason})"))
}

/// Refuses members that together are larger than the file: a small file could claim many large
/// ones.
fn refuse_overlaps<R: io::Read + Seek>(
    archive: &mut ZipArchive<R>,
    size: u64,
) -> Result<(), Problem> {
    let mut left = size;
    for i in 0..archive.len() {
        let stored = archive.by_index_raw(i).map_err(foreign)?.compressed_size();
        left = (left.checked_sub(stored)).ok_or_else(|| foreign("its arrays overlap"))?;
    }
    Ok(())
}

/// Returns the text that describes the arrays; null if `metadata` is an array of another kind.
fn metadata_of<R: io::Read + Seek>(archive: &mut ZipArchive<R>) -> Result<Value, Problem> {
    let file = archive.by_name("metadata.npy").map_err(foreign)?;
    let mut bytes = Vec::new();
    npz::checked(file.take(MAX_METADATA), |file| {
        file.read_to_end(&mut bytes).map_err(Problem::Read)
    })?;
    let text = npy::parse_text(&bytes)?;
    serde_json::from_str(&text).map_err(foreign)
}

/// Reads a member, stored or compressed.
fn member<R: io::Read + Seek>(
    archive: &mut ZipArchive<R>,
    name: &str,
    budget: &mut Budget,
    size: u64,
) -> Result<Array, Problem> {
    let file = archive.by_name(&format!("{name}.npy"));
    let file = file.map_err(|error| match error {
        ZipError::FileNotFound => Problem::Malformed("it is not in the archive".into()),
        error => foreign(error),
    })?;
    let length = file.size();
    if length > size.saturating_mul(INFLATION) {
        let (expected, found) = (length, size);
        return Err(Problem::Truncated { expected, found });
    }
    npz::checked(file, |file| npy_file::read_from(name, file, length, budget))
}

/// Adds axes and unit from the metadata to an array.
fn described(array: Array, about: &Value) -> Result<Array, Problem> {
    let axes = about["axes"].as_array().map(|axes| {
        let names = axes.iter().filter_map(|a| Some(a.as_str()?.to_owned()));
        names.collect::<Vec<_>>()
    });
    let axes = axes.unwrap_or_else(|| array.axes.clone());
    if axes.len() != array.shape.len() {
        return Err(foreign(format!(
            "'{}' has other axes than its metadata",
            array.name
        )));
    }
    Ok(Array {
        axes,
        unit: about["unit"].as_str().unwrap_or_default().into(),
        ..array
    })
}
