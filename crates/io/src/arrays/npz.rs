//! NPZ: a ZIP archive of NPY files, not compressed. <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>

use super::Arrays;
use crate::error::FileError;
use crate::{atomic, npy};
use serde_json::{Map, Value, json};
use std::io;
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Archives beyond this need the 64 bit extension, which must be announced for each file.
const LARGE: usize = 1 << 30;

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
    // The time is that of the beginning: equal measurements give equal files.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default())
        .large_file(size >= LARGE);
    Ok(archive.start_file(format!("{name}.npy"), options)?)
}

/// Attributes, and units and axes of all arrays, as JSON.
fn metadata(arrays: &Arrays) -> String {
    let about = arrays.list.iter().map(|array| {
        let value = json!({"unit": array.unit, "axes": array.axes});
        (array.name.clone(), value)
    });
    let text = |(name, value): &(String, String)| (name.clone(), Value::from(value.clone()));
    let mut all: Map<String, Value> = arrays.attributes.iter().map(text).collect();
    all.insert("arrays".into(), about.collect::<Map<_, _>>().into());
    Value::from(all).to_string()
}
