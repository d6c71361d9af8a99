//! VTK's structured points: `.vtk`, the older format of image data, as text or binary.
//! "VTK Legacy File Formats", docs.vtk.org.

mod scan;
mod write;

use std::io::{BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use glam::{DMat3, DVec3};

use super::layout::Layout;
use super::{Options, Sample, Volume, VolumeFrame, choose};
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::input;
use scan::{Array, File};

pub use write::write;

/// Reads the volume from the array with the dataset's name, or from the only array if none is
/// given.
///
/// # Errors
///
/// A file that cannot be read or contains no structured points. A missing array. Numbers of a type
/// with a size that differs between systems (`long`). NaN or infinite values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let (mut reader, size) = input::open(path)?;
    read_from(&mut reader, size, options).map_err(|problem| problem.at(path))
}

/// Returns the names of the arrays.
pub(super) fn names(path: &Path) -> Result<Vec<String>, FileError> {
    let (mut reader, size) = input::open(path)?;
    let file = File::scan(&mut reader, size).map_err(|problem| problem.at(path))?;
    Ok(file.arrays.into_iter().map(|array| array.name).collect())
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    let mut reader = BufReader::new(Cursor::new(bytes));
    read_from(&mut reader, bytes.len() as u64, options)
}

fn read_from<T: Sample>(
    reader: &mut (impl BufRead + Seek),
    size: u64,
    options: Options,
) -> Result<Volume<T>, Problem> {
    let file = File::scan(reader, size)?;
    let names: Vec<&str> = file.arrays.iter().map(|a| a.name.as_str()).collect();
    let array = &file.arrays[choose(&names, options.dataset)?];
    let (sizes, frame) = grid(&file, array)?;
    let layout = Layout::plain(sizes, array.components)?;
    if layout.count() != array.count {
        return Err(Problem::Mismatch {
            expected: format!("{} values, as DIMENSIONS say", layout.count()),
            found: array.count.to_string(),
        });
    }
    reader
        .seek(SeekFrom::Start(array.at))
        .map_err(Problem::Read)?;
    let data = if file.binary {
        layout.read(reader, Encoding::big(array.element))?
    } else {
        let mut text = String::new();
        let ends = reader.take(array.bytes).read_to_string(&mut text);
        ends.map_err(Problem::Read)?;
        layout.parse(&text)?
    };
    let volume = Volume::new(sizes, array.components, data)?;
    Ok(volume.with_frame(frame).with_element(array.element))
}

/// Returns the number of samples along each axis, and their position.
fn grid(file: &File, array: &Array) -> Result<([usize; 3], VolumeFrame), Problem> {
    let axis = |points: usize| match (array.on_points, points) {
        (true, _) | (_, 0 | 1) => (points, 0.0),
        (false, points) => (points - 1, 0.5),
    };
    let axes = file.dimensions.map(axis);
    let offset = DVec3::from_array(axes.map(|(_, offset)| offset));
    let frame = VolumeFrame {
        first: file.origin + file.spacing * offset,
        steps: DMat3::from_diagonal(file.spacing),
        nodes: array.on_points,
    };
    if frame.is_sound() && file.spacing.min_element() > 0.0 {
        Ok((axes.map(|(size, _)| size), frame))
    } else {
        Err(bad("its ORIGIN or SPACING is degenerate"))
    }
}

/// Returns VTK's name of a number type.
fn word(element: Element) -> &'static str {
    match element {
        Element::F16 | Element::F32 => "float",
        Element::F64 => "double",
        Element::I8 => "signed_char",
        Element::I16 => "short",
        Element::I32 => "int",
        Element::I64 => "vtktypeint64",
        Element::U8 => "unsigned_char",
        Element::U16 => "unsigned_short",
        Element::U32 => "unsigned_int",
        Element::U64 => "vtktypeuint64",
    }
}

fn bad(reason: &str) -> Problem {
    Problem::WrongFormat {
        format: "VTK",
        reason: reason.into(),
    }
}
