//! Grids of values in space.

pub mod npy;
pub mod vol;

use std::path::Path;

use crate::binary;
use crate::error::{FileError, Problem};

pub use npy::AxisOrder;

/// Values at the centres of the voxels of a grid, in single precision; always finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    size: [usize; 3],
    channels: usize,
    data: Vec<f32>,
    bbox: Option<[[f32; 3]; 2]>,
}

impl Volume {
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
        data: Vec<f32>,
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
        if let Some(index) = data.iter().position(|v| !v.is_finite()) {
            let place = place(size, channels, index);
            return Err(Problem::NotFinite {
                place,
                value: f64::from(data[index]),
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
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All values; see [`Volume::data`].
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// Least and greatest corner as the file gives them, if it does.
    pub fn bbox(&self) -> Option<[[f32; 3]; 2]> {
        self.bbox
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
            Some("vol") => vol::read(path),
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
