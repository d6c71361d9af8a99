//! NPZ: a ZIP archive of NPY files, not compressed. <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>

use super::{Array, Arrays, numbered};
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

/// Reads the arrays of an archive: with units and axes where [`write`] has written them, else with axes that have numbers.
///
/// # Errors
///
/// A file that is no such archive, or compressed, or holds other arrays than of floating-point numbers in C order.
pub(super) fn read(path: &Path) -> Result<Arrays, FileError> {
    let (file, mut left) = input::open(path)?;
    let open = || -> Result<Arrays, Problem> {
        let mut archive = ZipArchive::new(file).map_err(foreign)?;
        let mut names: Vec<String> = (archive.file_names().filter_map(Result::ok))
            .filter_map(|name| name.strip_suffix(".npy").map(str::to_owned))
            .collect();
        let metadata = match names.iter().position(|name| name == "metadata") {
            Some(i) => {
                names.remove(i);
                let text = npy::parse_text(&member(&mut archive, "metadata", &mut left)?)?;
                serde_json::from_str(&text).map_err(foreign)?
            }
            None => Value::Null,
        };
        if let Some(about) = metadata["arrays"].as_object() {
            names = about.keys().cloned().collect();
        }
        let list = names.iter().map(|name| {
            let stored = npy::parse(&member(&mut archive, name, &mut left)?)?;
            array(name, &metadata["arrays"][name], stored)
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
    Problem::Unsupported(format!("this archive of arrays ({reason})"))
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

/// An array of which the metadata may say something.
fn array(name: &str, about: &Value, stored: NpyArray) -> Result<Array, Problem> {
    let axes = match about["axes"].as_array() {
        Some(axes) => (axes.iter())
            .filter_map(|a| Some(a.as_str()?.to_owned()))
            .collect(),
        None => numbered(stored.shape.len()),
    };
    let data = match stored.data {
        NpyData::F64(data) => data,
        NpyData::F32(data) => data.into_iter().map(f64::from).collect(),
    };
    if stored.fortran_order && stored.shape.len() > 1 {
        return Err(foreign(format!("'{name}' is in Fortran order")));
    }
    if axes.len() != stored.shape.len() {
        return Err(foreign(format!(
            "'{name}' has other axes than its metadata"
        )));
    }
    Ok(Array {
        name: name.into(),
        axes,
        shape: stored.shape,
        unit: about["unit"].as_str().unwrap_or_default().into(),
        data,
    })
}
