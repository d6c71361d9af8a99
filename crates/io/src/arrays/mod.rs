//! Files of named arrays with units and axes: readings of meters.
//!
//! NPZ, HDF5 and MATLAB's files hold all arrays of a measurement, VTI all arrays over the grid of a
//! meter, NRRD, NIfTI and JNIfTI one of them, with its errors in a second file, and NPY a single array. The
//! last axis runs fastest.

mod grid;
mod hdf5;
mod jdata;
mod mat;
mod npy_file;
mod npz;
mod nrrd;
mod quality;
mod readings;
mod records;
mod volume;

pub use quality::Quality;
pub use readings::{Context, FREQUENCIES, NUMBERED, arrays, attributes, is_phase, list};

use crate::element::Element;
use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::volume::{Format, jnifti, nifti, vti};
use crate::{atomic, npy};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A named array.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Name, a word. If there are several meters, the meter's name and a dot precede it.
    pub name: String,
    /// Names of the axes, the slowest first.
    pub axes: Vec<String>,
    /// Number of elements along each axis.
    pub shape: Vec<usize>,
    /// Unit of the elements; empty if they have none.
    pub unit: String,
    /// Elements; the last axis runs fastest.
    pub data: Vec<f64>,
}

/// All results of a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrays {
    /// Arrays.
    pub list: Vec<Array>,
    /// Index in `list` of the array for formats with a single array; `None` if there are several
    /// meters.
    pub main: Option<usize>,
    /// Further attributes: texts, numbers, and the energy balance as an object.
    pub attributes: Vec<(String, Value)>,
    /// Arrays of the file that could not be read, each with the reason.
    pub left_out: Vec<(String, String)>,
}

/// Converts an attribute to text. Texts do not change; other values become JSON.
fn plain(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

/// Arrays and attributes read from a file.
#[derive(Debug, Default)]
struct Read {
    arrays: Vec<Array>,
    /// Edges of the cells of all arrays.
    edges: Vec<Array>,
    attributes: Vec<(String, Value)>,
    left_out: Vec<(String, Problem)>,
}

impl Read {
    /// Adds an array that was read, or records why it was left out.
    fn add(&mut self, name: &str, read: Result<Array, Problem>) {
        match read {
            Ok(array) => self.arrays.push(array),
            Err(problem) => self.left_out.push((name.to_owned(), problem)),
        }
    }

    /// Returns the arrays, or an error if no array could be read.
    fn of_file(self) -> Result<Arrays, Problem> {
        if self.arrays.is_empty() {
            let none = || Problem::Unsupported("files without arrays of numbers".into());
            let first = self.left_out.into_iter().next();
            return Err(first.map_or_else(none, |(_, problem)| problem));
        }
        let left_out = self.left_out.into_iter();
        Ok(Arrays {
            main: (self.arrays.len() == 1).then_some(0),
            list: [self.arrays, self.edges].concat(),
            attributes: self.attributes,
            left_out: left_out
                .map(|(name, problem)| (name, problem.to_string()))
                .collect(),
        })
    }
}

/// Reorders an array whose first index runs fastest so that the last index runs fastest.
fn last_fastest(shape: &[usize], data: Vec<f64>) -> Vec<f64> {
    if shape.iter().filter(|n| **n > 1).count() < 2 {
        return data;
    }
    let mut sorted = Vec::with_capacity(data.len());
    append(shape, &data, [0, 1], &mut sorted);
    sorted
}

/// Appends the elements that follow element `first`. Neighbours along the axes of `shape` lie
/// multiples of `step` apart.
fn append(shape: &[usize], data: &[f64], [first, step]: [usize; 2], sorted: &mut Vec<f64>) {
    match shape {
        [] => sorted.push(data[first]),
        [n, rest @ ..] => {
            for i in 0..*n {
                // Planted error "arrays of MATLAB with their first index slowest", found by morgana-io/io::volumes_of_others::all_arrays_of_a_file:
                // append(rest, data, [first * n + i, step], sorted);
                append(rest, data, [first + i * step, step * n], sorted);
            }
        }
    }
}

/// Returns numbered names for axes that a file does not name.
fn numbered(axes: usize) -> Vec<String> {
    (0..axes).map(|i| format!("axis {i}")).collect()
}

/// File format of arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArrayFormat {
    /// NumPy archive: all arrays, and a text `metadata` in JSON.
    Npz,
    /// NumPy file: a single array.
    Npy,
    /// Nearly raw raster data: a single array, with its position in space.
    Nrrd,
    /// XML image data of VTK: all arrays over one grid in space.
    Vti,
    /// NIfTI file: a single array over a grid in space.
    Nifti,
    /// JNIfTI file, as text or binary: a single array over a grid in space.
    Jnifti,
    /// MATLAB file, version 5: all arrays, and a text `metadata` in JSON.
    Mat,
    /// Hierarchical data format 5: all arrays, with attributes.
    Hdf5,
}

impl ArrayFormat {
    /// File extensions and their formats.
    pub const EXTENSIONS: [(&'static str, ArrayFormat); 11] = [
        ("npz", ArrayFormat::Npz),
        ("h5", ArrayFormat::Hdf5),
        ("hdf5", ArrayFormat::Hdf5),
        ("mat", ArrayFormat::Mat),
        ("vti", ArrayFormat::Vti),
        ("nii.gz", ArrayFormat::Nifti),
        ("nii", ArrayFormat::Nifti),
        ("jnii", ArrayFormat::Jnifti),
        ("bnii", ArrayFormat::Jnifti),
        ("nrrd", ArrayFormat::Nrrd),
        ("npy", ArrayFormat::Npy),
    ];

    /// Returns the format for a file's extension.
    ///
    /// # Errors
    ///
    /// Returns an error for another extension.
    pub fn of(path: &Path) -> Result<Self, FileError> {
        let found = split(path).map(|(_, _, format)| format);
        found.ok_or_else(|| {
            let names = Self::EXTENSIONS.map(|(name, _)| format!(".{name}"));
            let message = format!("arrays are written to {}", names.join(", "));
            Problem::Unsupported(message).at(path)
        })
    }

    /// Returns true if the format holds arrays of a single meter.
    pub fn is_single(self) -> bool {
        matches!(self, ArrayFormat::Npy | ArrayFormat::Nrrd) || self.needs_grid()
    }

    /// Returns true if the format holds only arrays over x, y and z.
    pub fn needs_grid(self) -> bool {
        matches!(
            self,
            ArrayFormat::Vti | ArrayFormat::Nifti | ArrayFormat::Jnifti
        )
    }

    /// Returns the path of a second file, with standard errors, for formats of one array with its
    /// place: `NAME_error` with the extension of the first file.
    pub fn errors_beside(self, path: &Path) -> Option<PathBuf> {
        if matches!(self, ArrayFormat::Vti | ArrayFormat::Npy) || !self.is_single() {
            return None;
        }
        let (stem, extension, _) = split(path)?;
        Some(path.with_file_name(format!("{stem}{}{extension}", readings::ERROR)))
    }
}

/// Splits the name of a file before its extension. Also returns the format of the extension.
fn split(path: &Path) -> Option<(&str, &str, ArrayFormat)> {
    let name = path.file_name()?.to_str()?;
    ArrayFormat::EXTENSIONS
        .iter()
        .find_map(|(extension, format)| {
            let start = name.len().checked_sub(extension.len() + 1)?;
            let (stem, end) = (name.get(..start)?, name.get(start..)?);
            let is_this = end.starts_with('.') && end[1..].eq_ignore_ascii_case(extension);
            (is_this && !stem.is_empty()).then_some((stem, end, *format))
        })
}

impl Arrays {
    /// Writes the arrays, completely or not at all. Readings and their statistics have numbers of
    /// the type `element`: double or single precision. All other arrays keep double precision.
    ///
    /// # Errors
    ///
    /// Returns an error for a format of one meter and several meters, for a format of grids and an
    /// array that lies on none, for numbers beyond single precision, and the errors of
    /// [`atomic::write()`].
    pub fn write(
        &self,
        path: &Path,
        format: ArrayFormat,
        element: Element,
    ) -> Result<(), FileError> {
        self.check_range(element)
            .map_err(|problem| problem.at(path))?;
        match format {
            ArrayFormat::Npz => return npz::write(path, self, element),
            ArrayFormat::Hdf5 => return hdf5::write(path, self, element),
            ArrayFormat::Mat => return mat::write(path, self, element),
            _ => {}
        }
        let main = self.single().map_err(|problem| problem.at(path))?;
        self.write_one(path, format, main, element)?;
        let errors = format.errors_beside(path).zip(self.errors(main));
        errors.map_or(Ok(()), |(path, errors)| {
            self.write_one(&path, format, errors, element)
        })
    }

    /// Writes an array in a format of one meter. In VTI all arrays over its grid follow.
    fn write_one(
        &self,
        path: &Path,
        format: ArrayFormat,
        array: &Array,
        element: Element,
    ) -> Result<(), FileError> {
        let grid = || {
            self.grid(array, element)
                .map_err(|problem| problem.at(path))
        };
        match format {
            ArrayFormat::Vti => vti::write(path, &grid()?),
            ArrayFormat::Nifti => nifti::write(path, &grid()?),
            ArrayFormat::Jnifti => jnifti::write(path, &grid()?),
            ArrayFormat::Nrrd => nrrd::write(path, self, array, element),
            _ => atomic::write(path, |file| {
                npy::write_elements(file, element, &array.shape, array.data.iter().copied())
            }),
        }
    }

    /// Returns the standard errors of an array.
    fn errors(&self, of: &Array) -> Option<&Array> {
        let name = readings::error_of(&of.name);
        self.list.iter().find(|array| array.name == name)
    }

    /// Refuses finite numbers that a type cannot hold.
    fn check_range(&self, element: Element) -> Result<(), Problem> {
        for array in &self.list {
            let element = self.element(array, element);
            let too_large = |v: &&f64| v.is_finite() && !element.nearest(**v).is_finite();
            if let Some(value) = array.data.iter().find(too_large) {
                return Err(Problem::TooLarge(format!(
                    "{value} of '{}' as a number of type {element}: write float64",
                    array.name
                )));
            }
        }
        Ok(())
    }

    /// Reads all arrays of a file. In `.npy`, `.npz`, HDF5 (all groups, with paths as names) and
    /// MATLAB's `.mat`, and JData files, units and axes come from [`Arrays::write`]; without them, axes are
    /// numbered. Files with other extensions give volumes with axes z, y, x and their channels.
    /// Complex numbers have a last axis of length 2. Positions of arrays are not read.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be read, or none of its arrays of numbers can: for
    /// example, because it needs more memory than `limits` allow. If others can be read, the array
    /// is [left out](Arrays::left_out).
    pub fn read(path: &Path, limits: Limits) -> Result<Self, FileError> {
        let read = match Format::of(path) {
            Some(Format::Npz) | None => npz::read(path, limits),
            Some(Format::Hdf5) => hdf5::read(path, limits),
            Some(Format::Mat) => mat::read(path, limits),
            Some(Format::Npy) => npy_file::read(path, limits),
            Some(Format::Jdata) => jdata::read(path, limits),
            Some(_) => volume::read(path, limits),
        };
        read.and_then(|read| read.of_file())
            .map_err(|problem| problem.at(path))
    }

    /// Reads all results of a measurement from an NPZ or HDF5 file that [`Arrays::write`] has
    /// written.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`Arrays::read`]. Also returns an error if an array cannot be read, or
    /// if statistics differ in shape from their values. Also returns an error if the file is not a
    /// measurement.
    pub fn read_measurement(path: &Path, limits: Limits) -> Result<Self, FileError> {
        let mut read = Self::read(path, limits)?;
        if let Some((name, why)) = read.left_out.pop() {
            return Err(Problem::Malformed(format!("the array '{name}': {why}")).at(path));
        }
        if read
            .list
            .iter()
            .all(|array| array.name != readings::EMITTED)
        {
            let reason = "read all readings of one render, which morgana render wrote to an .npz or .h5 file".into();
            let format = "readings";
            return Err(Problem::WrongFormat { format, reason }.at(path));
        }
        read.check_statistics()
            .map_err(|problem| problem.at(path))?;
        Ok(read)
    }

    /// Refuses errors and other statistics whose shape differs from the shape of their values.
    fn check_statistics(&self) -> Result<(), Problem> {
        for array in &self.list {
            let ends = readings::STATISTICS.iter();
            let about = ends.filter_map(|end| array.name.strip_suffix(end)).next();
            let values = self.list.iter().find(|a| Some(a.name.as_str()) == about);
            if let Some(values) = values.filter(|values| values.shape != array.shape) {
                return Err(Problem::Malformed(format!(
                    "the array '{}' has the shape {:?}, but '{}' has {:?}",
                    array.name, array.shape, values.name, values.shape
                )));
            }
        }
        Ok(())
    }

    /// Returns the array for formats with a single array.
    fn single(&self) -> Result<&Array, Problem> {
        let array = self.main.and_then(|i| self.list.get(i));
        array.ok_or_else(|| {
            let message = "a file of one meter for the readings of several meters: choose a meter, or use .npz, .h5 or .mat";
            Problem::Unsupported(message.into())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::last_fastest;

    #[test]
    fn arrays_of_matlab_are_sorted() {
        // Elements are m(i, j, k) = 100 i + 10 j + k.
        let shape = [2, 3, 4];
        let fastest_first = (0..4).flat_map(|k| {
            (0..3).flat_map(move |j| (0..2).map(move |i| f64::from(100 * i + 10 * j + k)))
        });
        let sorted = last_fastest(&shape, fastest_first.collect());
        let expected = (0..2).flat_map(|i| {
            (0..3).flat_map(move |j| (0..4).map(move |k| f64::from(100 * i + 10 * j + k)))
        });
        assert_eq!(sorted, expected.collect::<Vec<_>>());
    }
}
