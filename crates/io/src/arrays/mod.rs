//! Named arrays of numbers with units and axes, as files: readings of meters.
//!
//! NPZ and HDF5 hold all arrays of a measurement, NPY and NRRD one of them. Elements are float64, the last
//! axis runs fastest.

mod hdf5;
mod npz;
mod nrrd;
mod quality;
mod readings;
mod records;
mod volume;

pub use quality::Quality;
pub use readings::{Context, arrays};

use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::volume::Format;
use crate::{atomic, npy};
use serde_json::Value;
use std::path::Path;

/// An array with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Its name, a word; that of the meter comes first, with a dot, if there are several.
    pub name: String,
    /// Names of its axes, the slowest first.
    pub axes: Vec<String>,
    /// Number of elements along each axis.
    pub shape: Vec<usize>,
    /// Unit of the elements; empty if they have none.
    pub unit: String,
    /// Elements.
    pub data: Vec<f64>,
}

/// Where the array that a one-array format holds lies in space.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayPlacement {
    /// Names of axes that are directions in space, with the vector from each element to the next.
    pub steps: Vec<(String, [f64; 3])>,
    /// Position of the first element, the middle of its cell.
    pub origin: [f64; 3],
}

/// Everything that a measurement has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrays {
    /// The arrays.
    pub list: Vec<Array>,
    /// The one that formats with one array hold, as an index of `list`; none if there are several meters.
    pub main: Option<usize>,
    /// Where it lies, if it does so in space.
    pub placement: Option<ArrayPlacement>,
    /// What else there is to know: texts, numbers, and the energy balance as an object.
    pub attributes: Vec<(String, Value)>,
}

/// An attribute where only texts have a place: texts as they are, all else in JSON.
fn plain(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

/// Names of axes of which a file says nothing.
fn numbered(axes: usize) -> Vec<String> {
    (0..axes).map(|i| format!("axis {i}")).collect()
}

/// A format of arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArrayFormat {
    /// NumPy: all arrays, and a text `metadata` in JSON.
    Npz,
    /// NumPy: one array.
    Npy,
    /// Nearly raw raster data: one array, with its place in space.
    Nrrd,
    /// Hierarchical data format 5: all arrays, with attributes.
    Hdf5,
}

impl ArrayFormat {
    /// Their names, as extensions of files.
    pub const EXTENSIONS: [(&'static str, ArrayFormat); 5] = [
        ("npz", ArrayFormat::Npz),
        ("h5", ArrayFormat::Hdf5),
        ("hdf5", ArrayFormat::Hdf5),
        ("nrrd", ArrayFormat::Nrrd),
        ("npy", ArrayFormat::Npy),
    ];

    /// The format that the name of a file tells.
    ///
    /// # Errors
    ///
    /// Another extension.
    pub fn of(path: &Path) -> Result<Self, FileError> {
        let extension = path.extension().and_then(|e| e.to_str());
        let extension = extension.map(str::to_ascii_lowercase);
        let found = Self::EXTENSIONS
            .into_iter()
            .find(|(name, _)| Some(*name) == extension.as_deref());
        found.map(|(_, format)| format).ok_or_else(|| {
            let names = Self::EXTENSIONS.map(|(name, _)| format!(".{name}"));
            let message = format!("arrays are written to {}", names.join(", "));
            Problem::Unsupported(message).at(path)
        })
    }

    /// Whether it holds only one array.
    pub fn is_single(self) -> bool {
        matches!(self, ArrayFormat::Npy | ArrayFormat::Nrrd)
    }
}

impl Arrays {
    /// Writes them, completely or not at all.
    ///
    /// # Errors
    ///
    /// A format of one array for several meters, and everything that [`atomic::write()`] reports.
    pub fn write(&self, path: &Path, format: ArrayFormat) -> Result<(), FileError> {
        match format {
            ArrayFormat::Npz => npz::write(path, self),
            ArrayFormat::Hdf5 => hdf5::write(path, self),
            ArrayFormat::Nrrd => nrrd::write(path, self),
            ArrayFormat::Npy => {
                let array = self.single().map_err(|problem| problem.at(path))?;
                atomic::write(path, |file| npy::write_f64(file, &array.shape, &array.data))
            }
        }
    }

    /// Reads the arrays of a file: all of `.npz` and HDF5 (of its root group), with units and axes where [`Arrays::write`] has
    /// written them; of other extensions the volume, with axes z, y, x and its channels. Where arrays lie is left out.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, that takes more memory than its limits allow, or holds no arrays of numbers.
    pub fn read(path: &Path, limits: Limits) -> Result<Self, FileError> {
        match Format::of(path) {
            Some(Format::Npz) | None => npz::read(path),
            Some(Format::Hdf5) => hdf5::read(path, limits),
            Some(_) => volume::read(path, limits),
        }
    }

    /// The array of a format that holds one.
    fn single(&self) -> Result<&Array, Problem> {
        let array = self.main.and_then(|i| self.list.get(i));
        array.ok_or_else(|| {
            let message = "a file of one array for the readings of several meters; use .npz or .h5";
            Problem::Unsupported(message.into())
        })
    }
}
