//! Grids of values in space.

pub mod hdf5;
pub mod npy;
pub mod vol;
pub mod vti;

use std::path::Path;

use glam::DAffine3;

use crate::binary;
use crate::error::{FileError, Problem};

pub use npy::AxisOrder;

/// The most by which deflate compresses, 1032, rounded up: what a file may be trusted to become.
const INFLATION: u64 = 1100;

/// Where a file says that its samples are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// From the unit cube, which the samples fill, to the file's coordinates.
    pub to_file: DAffine3,
    /// Whether the outermost samples sit on the cube's faces, rather than half a spacing inside.
    pub nodes: bool,
}

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
    frame: Option<Frame>,
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
            frame: None,
        })
    }

    /// The same volume in a place of its own.
    fn placed(self, frame: Frame) -> Self {
        Volume {
            frame: Some(frame),
            ..self
        }
    }

    /// Where the file says that the samples are, if its format does.
    pub fn frame(&self) -> Option<Frame> {
        self.frame
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
            frame: self.frame,
        }
    }

    /// Reads a `.vol`, `.npy`, `.vti` or HDF5 (`.h5`, `.hdf5`) file, by its extension. The axes of an
    /// array of NumPy or HDF5 are in the given order; `dataset` chooses one of those of an HDF5 or `.vti`
    /// file.
    ///
    /// # Errors
    ///
    /// See [`vol::read`], [`npy::read`], [`vti::read`] and [`hdf5::read`].
    pub fn read(path: &Path, axes: AxisOrder, dataset: Option<&str>) -> Result<Self, FileError> {
        match Format::of(path) {
            Some(Format::Vol) => Ok(vol::read(path)?.cast()),
            Some(Format::Npy) => npy::read(path, axes),
            Some(Format::Vti) => vti::read(path, dataset),
            Some(Format::Hdf5) => hdf5::read(path, dataset.unwrap_or_default(), axes),
            None => {
                let message = "volumes are read from .vol, .npy, .vti, .h5 and .hdf5";
                Err(Problem::Unsupported(message.into()).at(path))
            }
        }
    }
}

/// A format of volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Mitsuba's grids.
    Vol,
    /// NumPy's arrays.
    Npy,
    /// VTK's image data.
    Vti,
    /// HDF5.
    Hdf5,
}

impl Format {
    /// By a file's extension.
    pub fn of(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "vol" => Format::Vol,
            "npy" => Format::Npy,
            "vti" => Format::Vti,
            "h5" | "hdf5" => Format::Hdf5,
            _ => return None,
        })
    }

    /// Whether the order of the axes is the user's to say.
    pub fn needs_axis_order(self) -> bool {
        matches!(self, Format::Npy | Format::Hdf5)
    }

    /// Whether a file may hold several volumes.
    pub fn has_datasets(self) -> bool {
        matches!(self, Format::Vti | Format::Hdf5)
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
