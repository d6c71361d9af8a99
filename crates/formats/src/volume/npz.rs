//! Volumes in NPZ archives of NumPy arrays.
//! <https://numpy.org/doc/stable/reference/generated/numpy.savez.html>

use std::io::{Cursor, Read, Seek};
use std::path::Path;

use zip::ZipArchive;
use zip::read::ZipFile;

use super::series::{Plan, Series};
use super::{INFLATION, Options, Sample, Volume, choose, metered, npy};
use crate::error::{FileError, Problem};
use crate::{input, npz};

/// Reads a volume from the array with the given name, stored or compressed, or from the only array
/// if none is given.
///
/// # Errors
///
/// A file that cannot be read or is not an `.npz` archive. A missing array. All errors of
/// [`npy::read`].
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
    let mut archive = ZipArchive::new(reader).map_err(bad)?;
    let name = chosen(&archive, options)?;
    let volume = with_array(&mut archive, &name, size, |file, length| {
        npy::read_from::<T>(file, [length, size], options)
    })?;
    let numbers = |name: &str, count| numbers(&mut archive, name, count);
    let place = metered::place(&name, volume.size(), numbers);
    Ok(volume.with_mentioned(place))
}

/// Returns the numbers of an array if there are `count` of them, all finite.
fn numbers<R: Read + Seek>(
    archive: &mut ZipArchive<R>,
    name: &str,
    count: usize,
) -> Option<Vec<f64>> {
    let file = archive.by_name(&format!("{name}.npy")).ok()?;
    let size = file.size();
    npz::checked(file, |file| Ok(numbers_of(file, size, count))).ok()?
}

fn numbers_of(file: &mut impl Read, size: u64, count: usize) -> Option<Vec<f64>> {
    let header = crate::npy::NpyHeader::read(file, size).ok()?;
    if header.fortran_order
        || header
            .shape
            .iter()
            .try_fold(1, |n: usize, m| n.checked_mul(*m))?
            != count
    {
        return None;
    }
    let mut numbers = Vec::new();
    let read = header.encoding.read(file, count, |v| numbers.push(v));
    read.ok()?;
    numbers.iter().all(|v| v.is_finite()).then_some(numbers)
}

/// Sums the frames of a file's array.
pub(super) fn read_series(
    path: &Path,
    options: Options,
    plan: &mut Plan,
) -> Result<Series, FileError> {
    let (reader, stored) = input::open(path)?;
    let read = || {
        let mut archive = ZipArchive::new(reader).map_err(bad)?;
        let name = chosen(&archive, options)?;
        with_array(&mut archive, &name, stored, |reader, size| {
            let file = npy::ArrayFile {
                reader,
                size,
                stored,
                skip: npy::skip_by_reading,
            };
            npy::series_from(file, options, plan)
        })
    };
    read().map_err(|problem| problem.at(path))
}

/// Returns the name of the requested array.
fn chosen<R: Read + Seek>(archive: &ZipArchive<R>, options: Options) -> Result<String, Problem> {
    // Skip members that are not arrays.
    let arrays = archive.file_names().filter_map(Result::ok);
    let arrays = arrays.filter_map(|n| n.strip_suffix(".npy").map(str::to_owned));
    let arrays: Vec<String> = arrays.collect();
    let names: Vec<&str> = arrays.iter().map(String::as_str).collect();
    Ok(names[choose(&names, options.dataset)?].to_owned())
}

/// Reads an array from an archive in a file of `size` bytes.
fn with_array<T, R: Read + Seek>(
    archive: &mut ZipArchive<R>,
    name: &str,
    size: u64,
    read: impl FnOnce(&mut ZipFile<'_, R>, u64) -> Result<T, Problem>,
) -> Result<T, Problem> {
    let file = archive.by_name(&format!("{name}.npy")).map_err(bad)?;
    let length = file.size();
    // Check the size before allocation: the archive cannot become larger than this.
    if length > size.saturating_mul(INFLATION) {
        return Err(Problem::Truncated {
            expected: length,
            found: size,
        });
    }
    npz::checked(file, |file| read(file, length))
}

/// Writes a volume as the array `name` of an uncompressed archive, in the order of [`npy::write`].
///
/// # Errors
///
/// All errors of [`atomic::write()`](crate::atomic::write()).
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
