//! Writing of NIfTI-1 files, plain or compressed.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{DMat3, DQuat, DVec3};

use super::{CODES, NIFTI_1_HEADER};
use crate::atomic;
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::volume::{Format, GridArray, GridAxis, GridData, GridField, Sample, VolumeFrame};

/// Largest number of items along an axis.
const MAX_LENGTH: usize = i16::MAX as usize;
/// Largest number of axes.
const MAX_AXES: usize = 7;
/// Largest cosine between axes that rounding explains; a larger cosine is a shear.
const MAX_SHEAR: f64 = 1e-6;
/// Code of an extension that is a comment.
const COMMENT: i32 = 6;
/// Code of coordinates that belong to the scene, as to a scanner.
const SCANNER: i16 = 1;
/// Code of seconds.
const SECONDS: u8 = 8;
/// Name of the axis that is NIfTI's time.
const TIME: &str = "time";

/// Writes the first array of a grid. The position is in `sform`, and in `qform` if the axes are
/// perpendicular. The axis `time`, in seconds, or else `opl` is the fourth axis. All others follow
/// from the fifth on. Texts among the fields become comments before the numbers.
///
/// Lengths are in m, mm or µm if these are the units of the grid. Grids in other known units are
/// converted to mm.
///
/// # Errors
///
/// An axis of more than 32767 items, more than seven axes, and all errors of [`atomic::write()`].
pub fn write<T: Sample>(path: &Path, grid: &GridData<T>) -> Result<(), FileError> {
    let Some(array) = grid.arrays.first() else {
        return Err(Problem::Empty("a file without an array".into()).at(path));
    };
    let placed = Placed::new(grid, array).map_err(|problem| problem.at(path))?;
    let zipped = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let element = Format::Nifti.element(grid.element);
    let content = |file: &mut dyn Write| {
        file.write_all(&placed.bytes(element, grid))?;
        Encoding::little(element).write(&mut &mut *file, placed.array.by_axis(grid.size))
    };
    atomic::write(path, |file| {
        if !zipped {
            return content(file);
        }
        let mut encoder = GzEncoder::new(file, Compression::default());
        content(&mut encoder)?;
        encoder.finish().map(|_| ())
    })
}

/// Array with its axes, position and units as NIfTI and JNIfTI hold them.
pub(in crate::volume) struct Placed<'a, T> {
    /// Array with its axes in the order of the file: the time first, if it has one.
    pub(in crate::volume) array: GridArray<'a, T>,
    /// Number of items along each axis.
    pub(in crate::volume) shape: Vec<usize>,
    /// Code of the unit of length.
    unit: u8,
    /// Position of the samples, in this unit.
    pub(in crate::volume) frame: VolumeFrame,
}

impl<'a, T: Sample> Placed<'a, T> {
    /// Arranges an array of a grid.
    ///
    /// # Errors
    ///
    /// An axis of more than 32767 items, and more than seven axes.
    pub(in crate::volume) fn new(
        grid: &GridData<T>,
        array: &GridArray<'a, T>,
    ) -> Result<Self, Problem> {
        let mut array = array.clone();
        let time = array.axes.iter().position(is_time);
        if let Some(time) = time {
            array.axes[..=time].rotate_right(1);
        }
        let mut shape = grid.size.to_vec();
        // Keep the fourth axis for the time: vectors begin with the fifth.
        if time.is_none() && !array.axes.is_empty() {
            shape.push(1);
        }
        shape.extend(array.axes.iter().map(|axis| axis.len));
        if shape.len() > MAX_AXES || shape.iter().any(|n| *n > MAX_LENGTH) {
            return Err(Problem::TooLarge(format!(
                "NIfTI-1 holds up to {MAX_AXES} axes of up to {MAX_LENGTH} items, but the array has {shape:?}: write .h5"
            )));
        }
        let (unit, factor) = length_unit(grid.metres_per_unit);
        Ok(Placed {
            array,
            shape,
            unit,
            frame: VolumeFrame {
                first: factor * grid.frame.first,
                steps: grid.frame.steps * factor,
                nodes: grid.frame.nodes,
            },
        })
    }

    /// Returns the name of the unit of length, if it is known.
    pub(in crate::volume) fn unit(&self) -> Option<&'static str> {
        [None, Some("m"), Some("mm"), Some("um")][usize::from(self.unit)]
    }

    /// Returns the centre of the first gate and the width of the gates, if the array has gates.
    pub(in crate::volume) fn gates(&self) -> Option<(f64, f64)> {
        self.time().and_then(bins)
    }

    /// Returns a description of the array: its name and the unit of its numbers.
    pub(in crate::volume) fn description(&self) -> String {
        let unit = match self.array.unit {
            "" => "1",
            unit => unit,
        };
        format!("{} ({unit})", self.array.name)
    }

    fn time(&self) -> Option<&GridAxis> {
        self.array.axes.first().filter(|axis| is_time(axis))
    }

    /// Makes the header, and the comments after it.
    fn bytes(&self, element: Element, grid: &GridData<T>) -> Vec<u8> {
        let comments = comments(&grid.fields);
        let mut bytes = Bytes(vec![0; NIFTI_1_HEADER]);
        bytes.put(0, &(NIFTI_1_HEADER as i32).to_le_bytes());
        bytes.put(38, b"r");
        bytes.shorts(70, [code(element), 8 * element.size() as i16]);
        bytes.reals(108, [(NIFTI_1_HEADER + 4 + comments.len()) as f64, 1.0]);
        bytes.put(148, text(&self.description(), 79).as_bytes());
        bytes.put(328, text(self.array.name, 15).as_bytes());
        bytes.put(344, b"n+1\0");
        self.put_axes(&mut bytes);
        self.put_place(&mut bytes);
        let Bytes(mut bytes) = bytes;
        bytes.extend([u8::from(!comments.is_empty()), 0, 0, 0]);
        bytes.extend(comments);
        bytes
    }

    /// Fills in the numbers of items, the units, and the time.
    fn put_axes(&self, bytes: &mut Bytes) {
        let lengths = self.shape.iter().chain(&[1; MAX_AXES]).take(MAX_AXES);
        bytes.shorts(40, [self.shape.len() as i16]);
        bytes.shorts(42, lengths.map(|n| *n as i16));
        let is_in_seconds = self.time().is_some_and(|axis| axis.name == TIME);
        let unit_of_time = if is_in_seconds { SECONDS } else { 0 };
        bytes.put(123, &[self.unit | unit_of_time]);
        let (first, width) = self.gates().unwrap_or((0.0, 1.0));
        bytes.reals(92, [width, 1.0, 1.0, 1.0]);
        bytes.reals(136, [first]);
    }

    /// Fills in the position of the samples.
    fn put_place(&self, bytes: &mut Bytes) {
        let VolumeFrame { first, steps, .. } = self.frame;
        let (turn, sign) = self.turn();
        bytes.reals(76, [sign]);
        bytes.reals(80, self.frame.spacing().to_array());
        if let Some(turn) = turn {
            bytes.shorts(252, [SCANNER]);
            bytes.reals(256, [turn.x, turn.y, turn.z]);
            bytes.reals(268, first.to_array());
        }
        bytes.shorts(254, [SCANNER]);
        let rows = (0..3).flat_map(|row| steps.row(row).extend(first[row]).to_array());
        bytes.reals(280, rows);
    }

    /// Returns the rotation of the axes as a unit quaternion, and −1 for mirrored axes, else 1.
    /// There is no rotation if the axes are not perpendicular.
    fn turn(&self) -> (Option<DQuat>, f64) {
        let sign = self.frame.steps.determinant().signum();
        let spacing = self.frame.spacing() * DVec3::new(1.0, 1.0, sign);
        let turn = self.frame.steps * DMat3::from_diagonal(spacing.recip());
        let [x, y, z] = [turn.x_axis, turn.y_axis, turn.z_axis];
        let sheared = [x.dot(y), y.dot(z), z.dot(x)];
        if sheared.iter().any(|cosine| cosine.abs() > MAX_SHEAR) {
            return (None, sign);
        }
        let turn = DQuat::from_mat3(&turn);
        // NIfTI keeps x, y and z only: w must not be negative.
        (Some(if turn.w < 0.0 { -turn } else { turn }), sign)
    }
}

/// Bytes of a header, in which fields have fixed places.
struct Bytes(Vec<u8>);

impl Bytes {
    fn put(&mut self, at: usize, value: &[u8]) {
        self.0[at..at + value.len()].copy_from_slice(value);
    }

    fn shorts(&mut self, at: usize, values: impl IntoIterator<Item = i16>) {
        for (i, value) in values.into_iter().enumerate() {
            self.put(at + 2 * i, &value.to_le_bytes());
        }
    }

    fn reals(&mut self, at: usize, values: impl IntoIterator<Item = f64>) {
        for (i, value) in values.into_iter().enumerate() {
            self.put(at + 4 * i, &(value as f32).to_le_bytes());
        }
    }
}

fn is_time(axis: &GridAxis) -> bool {
    [TIME, "opl"].contains(&axis.name.as_str())
}

/// Returns the centre of the first bin of an axis, and the width of the bins.
fn bins(axis: &GridAxis) -> Option<(f64, f64)> {
    let [first, second] = axis.edges.first_chunk()?;
    Some((0.5 * (first + second), second - first))
}

/// Returns the code of the unit of length in the file, and the length of a unit of the grid in it.
fn length_unit(metres: Option<f64>) -> (u8, f64) {
    let Some(metres) = metres else {
        return (0, 1.0);
    };
    let known = [(1, 1.0), (2, 1e-3), (3, 1e-6)];
    let found = known.into_iter().find(|(_, length)| *length == metres);
    found.map_or((2, metres / 1e-3), |(code, _)| (code, 1.0))
}

/// Makes an extension of each text.
fn comments(fields: &[(String, GridField)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (_, field) in fields {
        let GridField::Text(words) = field else {
            continue;
        };
        let size = (8 + words.len()).next_multiple_of(16);
        bytes.extend((size as i32).to_le_bytes());
        bytes.extend(COMMENT.to_le_bytes());
        bytes.extend(words.as_bytes());
        bytes.resize(bytes.len() + size - 8 - words.len(), 0);
    }
    bytes
}

/// Returns the beginning of a text, up to a number of bytes.
fn text(words: &str, most: usize) -> &str {
    let end = (0..=most.min(words.len()))
        .rev()
        .find(|end| words.is_char_boundary(*end));
    &words[..end.unwrap_or(0)]
}

/// Returns the code of a number type.
fn code(element: Element) -> i16 {
    let found = CODES.iter().find(|(_, known)| *known == element);
    found.map_or(0, |(code, _)| *code)
}
