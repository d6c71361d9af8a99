//! Volumes in archives of NumPy's arrays.
//! <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>

use std::io::{Cursor, Read, Seek};
use std::path::Path;

use zip::ZipArchive;
use zip::read::ZipFile;

use super::series::{Plan, Series};
use super::{INFLATION, Options, Sample, Volume, choose, npy};
use crate::error::{FileError, Problem};
use crate::{input, npz};

/// Reads a volume from the array of the given name, stored or compressed; from the only one if none is given.
///
/// # Errors
///
/// A file that cannot be read or is no such archive, an array that it does not have, and everything that
/// [`npy::read`] reports.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let (reader, size) = input::open(path)?;
    read_from(reader, size, options).map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    read_from(Cursor::new(bytes), bytes.len() as u64, options)
}

fn read_from<T: Sample>(
    reader: impl Read + Seek,
    size: u64,
    options: Options,
) -> Result<Volume<T>, Problem> {
    with_array(reader, size, options, |file, length| {
        npy::read_from(file, [length, size], options)
    })
}

/// Sums the frames of a file's array.
pub(super) fn read_series(
    path: &Path,
    options: Options,
    plan: &mut Plan,
) -> Result<Series, FileError> {
    let (reader, stored) = input::open(path)?;
    let read = with_array(reader, stored, options, |reader, size| {
        let file = npy::ArrayFile {
            reader,
            size,
            stored,
            skip: npy::skip_by_reading,
        };
        npy::series_from(file, options, plan)
    });
    read.map_err(|problem| problem.at(path))
}

/// Reads the array that is meant, of so many bytes, in a file of `size` bytes.
fn with_array<T, R: Read + Seek>(
    reader: R,
    size: u64,
    options: Options,
    read: impl FnOnce(&mut ZipFile<'_, R>, u64) -> Result<T, Problem>,
) -> Result<T, Problem> {
    let mut archive = ZipArchive::new(reader).map_err(bad)?;
    // Other members are none of ours.
    let arrays = archive.file_names().filter_map(Result::ok);
    let arrays = arrays.filter_map(|n| n.strip_suffix(".npy").map(str::to_owned));
    let arrays: Vec<String> = arrays.collect();
    let names: Vec<&str> = arrays.iter().map(String::as_str).collect();
    let name = names[choose(&names, options.dataset)?];
    let mut file = archive.by_name(&format!("{name}.npy")).map_err(bad)?;
    let length = file.size();
    // Nothing is set aside for more than the archive can become.
    if length > size.saturating_mul(INFLATION) {
        return Err(Problem::Truncated {
            expected: length,
            found: size,
        });
    }
    read(&mut file, length)
}

/// Writes a volume as the array `name` of an archive, not compressed, in the order of [`npy::write`].
///
/// # Errors
///
/// Everything that [`atomic::write()`](crate::atomic::write()) reports.
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>, name: &str) -> Result<(), FileError> {
    let bytes = volume.data().len() * volume.element().size();
    npz::write(path, |archive| {
        npy::write_to(archive.member(name, bytes)?, volume)
    })
}

fn bad(error: zip::result::ZipError) -> Problem {
    Problem::WrongFormat {
        format: "NPZ",
        reason: error.to_string(),
    }
}
