//! Volumes in NumPy arrays.

use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use super::layout::Layout;
use super::series::{self, Adder, Plan, Series};
use super::{Options, Sample, Volume};
use crate::error::{FileError, Problem};
use crate::{atomic, binary, input, npy};

/// Reads a volume from an array of three axes, or four with channels, with numbers of any type.
///
/// # Errors
///
/// A file that cannot be read or is not an `.npy` file. An axis order that is not given, or another
/// number of axes. Other elements, or a size of zero. NaN or infinite values, also beyond single
/// precision.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let (mut reader, size) = input::open(path)?;
    read_from(&mut reader, [size; 2], options).map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of an `.npy` file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    read_from(&mut BufReader::new(bytes), [bytes.len() as u64; 2], options)
}

/// Reads a volume from an array of `size` bytes, in a file of `stored` bytes.
pub(super) fn read_from<T: Sample>(
    reader: &mut impl Read,
    [size, stored]: [u64; 2],
    options: Options,
) -> Result<Volume<T>, Problem> {
    let header = npy::NpyHeader::read(reader, size)?;
    let layout = Layout::new(&header.shape, header.fortran_order, options.axes()?)?;
    let element = header.encoding.element;
    binary::check_size(layout.count(), element.size(), header.size, size)?;
    layout.check::<T>(options.limits, stored)?;
    let data = layout.read(reader, header.encoding)?;
    let volume = Volume::new(layout.size, layout.channels, data)?;
    Ok(volume.with_element(element))
}

/// Sums the frames of a file's array.
pub(super) fn read_series(
    path: &Path,
    options: Options,
    plan: &mut Plan,
) -> Result<Series, FileError> {
    let (mut reader, size) = input::open(path)?;
    let file = ArrayFile {
        reader: &mut reader,
        size,
        stored: size,
        skip: |reader, bytes| reader.seek(SeekFrom::Current(bytes as i64)).map(drop),
    };
    series_from(file, options, plan).map_err(|problem| problem.at(path))
}

/// Sums the frames of the array in the bytes of a file.
///
/// # Errors
///
/// As for [`Series::read`].
pub fn parse_series(bytes: &[u8], options: Options, plan: &mut Plan) -> Result<Series, Problem> {
    let size = bytes.len() as u64;
    let file = ArrayFile {
        reader: &mut BufReader::new(bytes),
        size,
        stored: size,
        skip: skip_by_reading,
    };
    series_from(file, options, plan)
}

/// Open file that contains an array.
pub(super) struct ArrayFile<'r, R> {
    pub reader: &'r mut R,
    /// Size of the array, in bytes.
    pub size: u64,
    /// Size of the file that contains the array, in bytes.
    pub stored: u64,
    /// Function that skips bytes.
    pub skip: fn(&mut R, u64) -> io::Result<()>,
}

/// Skips bytes of a reader that can only read.
pub(super) fn skip_by_reading(reader: &mut impl Read, bytes: u64) -> io::Result<()> {
    io::copy(&mut reader.take(bytes), &mut io::sink()).map(drop)
}

/// Sums the frames of an array.
pub(super) fn series_from<R: Read>(
    file: ArrayFile<R>,
    options: Options,
    plan: &mut Plan,
) -> Result<Series, Problem> {
    let header = npy::NpyHeader::read(file.reader, file.size)?;
    let layout = Layout::new(&header.shape, header.fortran_order, options.axes()?)?;
    let element = header.encoding.element;
    binary::check_size(layout.count(), element.size(), header.size, file.size)?;
    let permit = |count, each| options.limits.check(count, each, file.stored);
    let mut adder = Adder::new(layout.size, series::shape(&layout, None), plan, permit)?;
    let span = layout.span(adder.used());
    let mut targets = layout.targets_from(span.start);
    let before = (span.start * element.size()) as u64;
    (file.skip)(file.reader, before).map_err(Problem::Read)?;
    let read = header.encoding.read(file.reader, span.len(), |v| {
        if let Some(target) = targets.next() {
            adder.add(target, v);
        }
    });
    read.map_err(Problem::Read)?;
    Ok(adder.finish()?.of_element(element))
}

/// Writes a volume as an array `[z, y, x]`, or `[z, y, x, channel]` if it has several channels.
///
/// The array has the number type of the volume's file. The file is written completely or not at
/// all.
///
/// # Errors
///
/// All errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, volume: &Volume<T>) -> Result<(), FileError> {
    atomic::write(path, |file| write_to(file, volume))
}

/// Writes a volume to an open file.
pub(super) fn write_to<T: Sample>(
    file: &mut impl std::io::Write,
    volume: &Volume<T>,
) -> std::io::Result<()> {
    let values = volume.data().iter().map(|v| v.wide());
    npy::write_elements(file, volume.element(), &shape(volume), values)
}

/// Returns the axes of an array with x fastest, or the channels if there are several.
pub(super) fn shape<T: Sample>(volume: &Volume<T>) -> Vec<usize> {
    let [x, y, z] = volume.size();
    match volume.channels() {
        1 => vec![z, y, x],
        channels => vec![z, y, x, channels],
    }
}
