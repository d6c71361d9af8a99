//! Grids of values in space.

pub mod npy;
pub mod vol;

use std::path::Path;

use crate::binary;
use crate::error::{FileError, Problem};

pub use npy::AxisOrder;

/// A number of which volumes are made: `f32`, or `f64` where contrasts are small.
pub trait Sample: Copy + 'static {
    /// The number in double precision.
    fn wide(self) -> f64;
    /// The nearest such number.
    fn nearest(v: f64) -> Self;
}

impl Sample for f32 {
    fn wide(self) -> f64 {
        f64::from(self)
    }

    fn nearest(v: f64) -> Self {
        v as f32
    }
}

impl Sample for f64 {
    fn wide(self) -> f64 {
        self
    }

    fn nearest(v: f64) -> Self {
        v
    }
}

/// Values at the centres of the voxels of a grid, in single precision; always finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume<T = f32> {
    size: [usize; 3],
    channels: usize,
    data: Vec<T>,
    bbox: Option<[[f32; 3]; 2]>,
}

impl<T: Sample> Volume<T> {
    /// A volume of `size` = (nx, ny, nz) voxels. In `data` the channels of a voxel are neighbours,
    /// then x is the fastest axis and z the slowest. `bbox` holds the least and the greatest corner
    /// if the file has them.
    ///
    /// # Errors
    ///
    /// A size of zero, a size that does not fit the data, NaN or infinite values.
    pub fn new(
        size: [usize; 3],
        channels: usize,
        data: Vec<T>,
        bbox: Option<[[f32; 3]; 2]>,
    ) -> Result<Self, Problem> {
        let [x, y, z] = size;
        let count = [x, y, z, channels]
            .iter()
            .try_fold(1usize, |n, &m| n.checked_mul(m));
        if count == Some(0) {
            let sizes = binary::product(&size);
            return Err(Problem::Empty(format!(
                "{sizes} voxels with {channels} channels"
            )));
        }
        if count != Some(data.len()) {
            let sizes = binary::product(&size);
            let expected = format!("{sizes} voxels with {channels} channels");
            return Err(Problem::Mismatch {
                expected,
                found: format!("{} values", data.len()),
            });
        }
        if let Some(index) = data.iter().position(|v| !v.wide().is_finite()) {
            let place = place(size, channels, index);
            return Err(Problem::NotFinite {
                place,
                value: data[index].wide(),
            });
        }
        Ok(Volume {
            size,
            channels,
            data,
            bbox,
        })
    }

    /// Number of voxels along x, y, z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Values per voxel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// All values: channels of a voxel are neighbours, then x is fastest, z slowest.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All values; see [`Volume::data`].
    pub fn into_data(self) -> Vec<T> {
        self.data
    }

    /// Least and greatest corner as the file gives them, if it does.
    pub fn bbox(&self) -> Option<[[f32; 3]; 2]> {
        self.bbox
    }

    /// The same volume with another kind of numbers.
    fn cast<U: Sample>(self) -> Volume<U> {
        Volume {
            size: self.size,
            channels: self.channels,
            data: self
                .data
                .into_iter()
                .map(|v| U::nearest(v.wide()))
                .collect(),
            bbox: self.bbox,
        }
    }

    /// Reads a `.vol` or `.npy` file, by its extension. The axes of an `.npy` array are in the
    /// given order.
    ///
    /// # Errors
    ///
    /// See [`vol::read`] and [`npy::read`].
    pub fn read(path: &Path, axes: AxisOrder) -> Result<Self, FileError> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("vol") => Ok(vol::read(path)?.cast()),
            Some("npy") => npy::read(path, axes),
            _ => Err(Problem::Unsupported("volumes are read from .vol and .npy".into()).at(path)),
        }
    }
}

fn place([nx, ny, _]: [usize; 3], channels: usize, index: usize) -> String {
    let voxel = index / channels;
    let (x, y, z) = (voxel % nx, voxel / nx % ny, voxel / nx / ny);
    match channels {
        1 => format!("voxel ({x}, {y}, {z})"),
        _ => format!("voxel ({x}, {y}, {z}), channel {}", index % channels),
    }
}
