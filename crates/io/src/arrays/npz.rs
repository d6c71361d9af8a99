//! NPZ: a ZIP archive of NPY files, not compressed. <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>

use super::{Array, Arrays};
use crate::error::{FileError, Problem};
use crate::npy::{NpyArray, NpyData};
use crate::{atomic, input, npy};
use serde_json::{Map, Value, json};
use std::io::{self, Read, Seek};
use std::path::Path;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Writes all arrays and a text `metadata`.
pub(super) fn write(path: &Path, arrays: &Arrays) -> Result<(), FileError> {
    atomic::write(path, |file| {
        let mut archive = ZipWriter::new(file);
        for array in &arrays.list {
            start(
                &mut archive,
                &array.name,
                array.data.len() * size_of::<f64>(),
            )?;
            npy::write_f64(&mut archive, &array.shape, &array.data)?;
        }
        start(&mut archive, "metadata", 0)?;
        npy::write_text(&mut archive, &metadata(arrays))?;
        archive.finish()?;
        Ok(())
    })
}

fn start<W: io::Write + io::Seek>(
    archive: &mut ZipWriter<W>,
    name: &str,
    size: usize,
) -> io::Result<()> {
    Ok(archive.start_file(format!("{name}.npy"), npy::stored(size))?)
}

/// Attributes, and units and axes of all arrays, as JSON.
fn metadata(arrays: &Arrays) -> String {
    let about = arrays.list.iter().map(|array| {
        let value = json!({"unit": array.unit, "axes": array.axes});
        (array.name.clone(), value)
    });
    let mut all: Map<String, Value> = arrays.attributes.iter().cloned().collect();
    all.insert("arrays".into(), about.collect::<Map<_, _>>().into());
    Value::from(all).to_string()
}

/// Reads what [`write`] has written: arrays with their units and axes. Where they lie is left out.
///
/// # Errors
///
/// A file that is no such archive, compressed, or without the text `metadata`.
pub(super) fn read(path: &Path) -> Result<Arrays, FileError> {
    let (file, mut left) = input::open(path)?;
    let open = || -> Result<Arrays, Problem> {
        let mut archive = ZipArchive::new(file).map_err(foreign)?;
        let metadata = npy::parse_text(&member(&mut archive, "metadata", &mut left)?)?;
        let metadata: Value = serde_json::from_str(&metadata).map_err(foreign)?;
        let about = metadata["arrays"].as_object();
        let about = about.ok_or_else(|| foreign("its metadata lists no arrays"))?;
        let list = about.iter().map(|(name, about)| {
            let stored = npy::parse(&member(&mut archive, name, &mut left)?)?;
            array(name, about, stored)
        });
        let list = list.collect::<Result<_, Problem>>()?;
        let attributes = metadata.as_object().into_iter().flatten();
        let attributes = attributes.filter(|(name, _)| *name != "arrays");
        Ok(Arrays {
            list,
            main: None,
            placement: None,
            attributes: attributes.map(|(n, v)| (n.clone(), v.clone())).collect(),
        })
    };
    open().map_err(|problem| problem.at(path))
}

fn foreign(reason: impl std::fmt::Display) -> Problem {
    Problem::Unsupported(format!(
        "archives that were not written by a meter ({reason})"
    ))
}

/// The bytes of a member, which are stored as they are; all together are no more than the file has `left`.
fn member<R: Read + Seek>(
    archive: &mut ZipArchive<R>,
    name: &str,
    left: &mut u64,
) -> Result<Vec<u8>, Problem> {
    let mut file = archive.by_name(&format!("{name}.npy")).map_err(foreign)?;
    if file.compression() != CompressionMethod::Stored {
        return Err(foreign("it is compressed"));
    }
    let overlap = || foreign("its arrays overlap");
    *left = left.checked_sub(file.size()).ok_or_else(overlap)?;
    let mut bytes = Vec::new();
    let size = file.size();
    let read = file.by_ref().take(size).read_to_end(&mut bytes);
    read.map_err(Problem::Read)?;
    Ok(bytes)
}

fn array(name: &str, about: &Value, stored: NpyArray) -> Result<Array, Problem> {
    let axes = about["axes"].as_array().into_iter().flatten();
    let axes: Vec<String> = axes.filter_map(|a| Some(a.as_str()?.to_owned())).collect();
    let data = match stored.data {
        NpyData::F64(data) => data,
        NpyData::F32(_) => return Err(foreign("it holds single precision")),
    };
    if stored.fortran_order || axes.len() != stored.shape.len() {
        return Err(foreign("its arrays do not have the axes of its metadata"));
    }
    Ok(Array {
        name: name.into(),
        axes,
        shape: stored.shape,
        unit: about["unit"].as_str().unwrap_or_default().into(),
        data,
    })
}
