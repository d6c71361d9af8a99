//! Grids of values in space.

pub mod hdf5;
pub mod jnifti;
pub mod mat;
pub mod nifti;
pub mod npy;
pub mod npz;
pub mod nrrd;
pub mod series;
pub mod vdb;
pub mod vol;
pub mod vti;
pub mod vtk;

mod format;
mod frame;
mod grid_data;
mod layout;
mod metered;
mod options;
mod resample;
mod write;

use std::path::Path;

use glam::DVec3;

use crate::element::Element;
use crate::error::{FileError, Problem};
use crate::tensor::{Numbers, Tensor};
use layout::Layout;
use series::{Plan, Series};

pub use format::Format;
pub use frame::VolumeFrame;
pub use grid_data::{GridArray, GridAxis, GridData, GridField, strided};
pub use layout::AxisOrder;
pub use metered::place as metered_place;
pub use options::Options;
use options::choose;
pub use write::{Stored, write};

/// Largest compression ratio of DEFLATE, 1032, rounded up. It bounds the inflated size of a file.
pub const INFLATION: u64 = 1100;

/// Number type of volumes: `f32`, or `f64` for small contrasts.
pub trait Sample: Copy + 'static {
    /// Type of the number in files.
    const ELEMENT: Element;
    /// Converts the number to double precision.
    fn wide(self) -> f64;
    /// Rounds to the nearest number of this type.
    fn nearest(v: f64) -> Self;
}

impl Sample for f32 {
    const ELEMENT: Element = Element::F32;

    fn wide(self) -> f64 {
        f64::from(self)
    }

    fn nearest(v: f64) -> Self {
        v as f32
    }
}

impl Sample for f64 {
    const ELEMENT: Element = Element::F64;

    fn wide(self) -> f64 {
        self
    }

    fn nearest(v: f64) -> Self {
        v
    }
}

/// Values on a grid; always finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume<T = f32> {
    size: [usize; 3],
    channels: usize,
    data: Vec<T>,
    element: Element,
    bbox: Option<[DVec3; 2]>,
    bbox_of_cells: bool,
    frame: Option<VolumeFrame>,
    mentioned: Option<VolumeFrame>,
    unit: Option<String>,
}

impl<T: Sample> Volume<T> {
    /// Makes a volume of `size` = (nx, ny, nz) voxels. In `data`, channels of a voxel are adjacent;
    /// x is the fastest axis and z the slowest.
    ///
    /// # Errors
    ///
    /// A size of zero, a size that does not match the data, NaN or infinite values.
    pub fn new(size: [usize; 3], channels: usize, data: Vec<T>) -> Result<Self, Problem> {
        if layout::check(size, channels)? != data.len() {
            let [x, y, z] = size;
            return Err(Problem::Mismatch {
                expected: format!("{x} x {y} x {z} voxels with {channels} channels"),
                found: format!("{} values", data.len()),
            });
        }
        if let Some(index) = not_finite(&data) {
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
            element: T::ELEMENT,
            bbox: None,
            bbox_of_cells: false,
            frame: None,
            mentioned: None,
            unit: None,
        })
    }

    /// Returns the volume with another type of numbers of its file.
    #[must_use]
    pub fn with_element(self, element: Element) -> Self {
        Volume { element, ..self }
    }

    /// Returns the volume with a binding position of its samples.
    #[must_use]
    pub fn with_frame(self, frame: VolumeFrame) -> Self {
        let frame = Some(frame);
        Volume { frame, ..self }
    }

    /// Returns the volume with the lower and the upper corner of a box.
    #[must_use]
    pub fn with_bbox(self, bbox: [DVec3; 2]) -> Self {
        let bbox = Some(bbox);
        Volume { bbox, ..self }
    }

    /// Returns the volume with the position that its file mentions, if there is one.
    #[must_use]
    pub(crate) fn with_mentioned(self, mentioned: Option<VolumeFrame>) -> Self {
        Volume { mentioned, ..self }
    }

    /// Returns the volume with the lower and the upper corner of the cells around its samples.
    #[must_use]
    pub(crate) fn with_box_of_cells(self, bbox: [DVec3; 2]) -> Self {
        let bbox_of_cells = true;
        Volume {
            bbox_of_cells,
            ..self.with_bbox(bbox)
        }
    }

    /// Returns the volume with a unit of length.
    #[must_use]
    pub fn with_unit(self, unit: Option<String>) -> Self {
        Volume { unit, ..self }
    }

    /// Returns the volume with the position, unit and type of numbers of another volume's file.
    fn recorded_as(self, other: &Self) -> Self {
        Volume {
            element: other.element,
            bbox: other.bbox,
            bbox_of_cells: other.bbox_of_cells,
            frame: other.frame,
            mentioned: other.mentioned,
            unit: other.unit.clone(),
            ..self
        }
    }

    /// Returns the numbers of voxels along x, y, z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the number of values per voxel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Returns all values. Channels of a voxel are adjacent; x is the fastest axis and z the
    /// slowest.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// Returns all values; see [`Volume::data`].
    pub fn into_data(self) -> Vec<T> {
        self.data
    }

    /// Returns the type of numbers in the file.
    pub fn element(&self) -> Element {
        self.element
    }

    /// Returns the binding position of the samples in the file, if there is one. Scenes use it.
    pub fn frame(&self) -> Option<VolumeFrame> {
        self.frame
    }

    /// Returns the lower and the upper corner of a box that the file mentions. Scenes do not use
    /// it.
    pub fn bbox(&self) -> Option<[DVec3; 2]> {
        self.bbox
    }

    /// Returns true if the samples are at the centres of the cells that fill the box, rather than
    /// where a scene places them.
    pub fn has_box_of_cells(&self) -> bool {
        self.bbox_of_cells
    }

    /// Returns the unit of length of the file's coordinates, if the file states it.
    pub fn unit(&self) -> Option<&str> {
        self.unit.as_deref()
    }

    /// Returns the position of the samples: the file's binding position, else the position that the
    /// file mentions, else the centres of the cells of its box, or of the unit cube.
    pub fn place(&self) -> VolumeFrame {
        let bbox = self.bbox.unwrap_or([DVec3::ZERO, DVec3::ONE]);
        self.frame
            .or(self.mentioned)
            .unwrap_or_else(|| VolumeFrame::of_box(bbox, self.size))
    }

    /// Returns true if the file states the position of the samples, binding for scenes or not.
    pub fn has_place(&self) -> bool {
        self.frame.is_some() || self.mentioned.is_some() || self.bbox.is_some()
    }

    /// Maps every value v to `scale` v + `offset`. The result has floating-point numbers.
    ///
    /// # Errors
    ///
    /// A result that is too large.
    pub fn scaled(mut self, scale: f64, offset: f64) -> Result<Self, Problem> {
        if (scale, offset) == (1.0, 0.0) {
            return Ok(self);
        }
        for v in &mut self.data {
            *v = T::nearest(scale * v.wide() + offset);
        }
        let data = std::mem::take(&mut self.data);
        Ok(Volume {
            data: Self::new(self.size, self.channels, data)?.data,
            element: self.element.float(),
            ..self
        })
    }

    /// Makes a volume from an array of 3 axes, or 4 with channels.
    ///
    /// # Errors
    ///
    /// Another number of axes, a size of zero, NaN or infinite values, and values beyond single
    /// precision for `f32`.
    pub fn of_tensor(tensor: &Tensor, axes: AxisOrder) -> Result<Self, Problem> {
        let layout = Layout::new(tensor.shape(), false, axes)?;
        let mut data = vec![T::nearest(0.0); layout.count()];
        for (target, v) in layout.targets().zip(tensor.iter()) {
            data[target] = T::nearest(v);
        }
        Ok(Volume::new(layout.size, layout.channels, data)?.with_element(element_of(tensor)))
    }

    /// Reads a file in the format of its extension ([`Format`]).
    ///
    /// # Errors
    ///
    /// An unknown extension, and the errors of the format's own function.
    pub fn read(path: &Path, options: Options) -> Result<Self, FileError> {
        match Format::of(path) {
            Some(Format::Vol) => vol::read(path),
            Some(Format::Npy) => npy::read(path, options),
            Some(Format::Npz) => npz::read(path, options),
            Some(Format::Hdf5) => hdf5::read(path, options),
            Some(Format::Mat) => mat::read(path, options),
            Some(Format::Nrrd) => nrrd::read(path, options),
            Some(Format::Vti) => vti::read(path, options),
            Some(Format::Vtk) => vtk::read(path, options),
            Some(Format::Vdb) => vdb::read(path, options),
            Some(Format::Nifti) => nifti::read(path, options),
            Some(Format::Jnifti | Format::Jdata) => jnifti::read(path, options),
            None => Err(Format::unknown().at(path)),
        }
    }
}

/// Returns the names of the volumes in a VTK, OpenVDB or JData file; empty for other formats, whose arrays
/// need not be volumes.
///
/// # Errors
/// The file cannot be read.
pub fn names(path: &Path) -> Result<Vec<String>, FileError> {
    match Format::of(path) {
        Some(Format::Vti) => vti::names(path),
        Some(Format::Vtk) => vtk::names(path),
        Some(Format::Vdb) => vdb::names(path),
        Some(Format::Jdata) => jnifti::names(path),
        _ => Ok(Vec::new()),
    }
}

impl Series {
    /// Sums the frames of the array in a file. NumPy and HDF5 arrays are read in parts. In addition
    /// to the sums, 8 bytes each, they take memory for a block of [`hdf5::BLOCK`] numbers or a
    /// chunk of the file. Arrays of other formats are read as a whole.
    ///
    /// # Errors
    ///
    /// The errors of [`Volume::read`] and of the plan.
    pub fn read(path: &Path, options: Options, plan: &mut Plan) -> Result<Self, FileError> {
        match Format::of(path) {
            Some(Format::Npy) => npy::read_series(path, options, plan),
            Some(Format::Npz) => npz::read_series(path, options, plan),
            Some(Format::Hdf5) => hdf5::read_series(path, options, plan),
            _ => {
                let volume = Volume::read(path, options)?;
                Self::of_volume(volume, plan).map_err(|problem| problem.at(path))
            }
        }
    }
}

/// Returns the index of the first number that is not finite.
fn not_finite<T: Sample>(data: &[T]) -> Option<usize> {
    // Check a block at a time, without a branch for each number.
    const BLOCK: usize = 1 << 12;
    let are_finite = |some: &[T]| some.iter().fold(true, |all, v| all & v.wide().is_finite());
    let mut blocks = data.chunks(BLOCK);
    let block = blocks.position(|some| !are_finite(some))?;
    (block * BLOCK..data.len()).find(|at| !data[*at].wide().is_finite())
}

/// Returns the type of the numbers of an array.
fn element_of(tensor: &Tensor) -> Element {
    match tensor.numbers() {
        Numbers::Single(_) => Element::F32,
        Numbers::Double(_) => Element::F64,
    }
}

/// Describes a sample in messages.
pub fn place([nx, ny, _]: [usize; 3], channels: usize, index: usize) -> String {
    let voxel = index / channels;
    let (x, y, z) = (voxel % nx, voxel / nx % ny, voxel / nx / ny);
    match channels {
        1 => format!("voxel ({x}, {y}, {z})"),
        _ => format!("voxel ({x}, {y}, {z}), channel {}", index % channels),
    }
}
