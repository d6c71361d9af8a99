//! Volumes as NumPy arrays.

use std::path::Path;

use super::{Sample, Volume};
use crate::binary;
use crate::error::{FileError, Problem};
use crate::npy::{self, NpyArray, NpyData};

/// The meaning of an array's first three axes. A file does not say: the user must.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisOrder {
    /// `array[z, y, x]`, as Mitsuba has it.
    Zyx,
    /// `array[x, y, z]`.
    Xyz,
}

/// Reads a volume from an array of three axes, or four with the channels last.
///
/// # Errors
///
/// Everything that [`npy::read`] reports, another number of axes, a size of zero, and NaN or
/// infinite values (also those beyond single precision).
pub fn read<T: Sample>(path: &Path, axes: AxisOrder) -> Result<Volume<T>, FileError> {
    let array = npy::read(path)?;
    from_array(array, axes).map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of an `.npy` file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], axes: AxisOrder) -> Result<Volume<T>, Problem> {
    from_array(npy::parse(bytes)?, axes)
}

/// Writes a volume as a float32 array `[z, y, x]`, or `[z, y, x, channel]` if it has several
/// channels; at once or not at all.
///
/// # Errors
///
/// Everything that [`npy::write()`] reports.
pub fn write(path: &Path, volume: &Volume) -> Result<(), FileError> {
    let [x, y, z] = volume.size();
    match volume.channels() {
        1 => npy::write(path, &[z, y, x], volume.data()),
        channels => npy::write(path, &[z, y, x, channels], volume.data()),
    }
}

pub(super) fn from_array<T: Sample>(
    array: NpyArray,
    axes: AxisOrder,
) -> Result<Volume<T>, Problem> {
    let (a, b, c, channels) = match array.shape[..] {
        [a, b, c] => (a, b, c, 1),
        [a, b, c, channels] => (a, b, c, channels),
        ref other => {
            let expected = "an array of 3 axes, or 4 with the channels last".to_owned();
            let found = format!("{} ({})", other.len(), binary::product(other));
            return Err(Problem::Mismatch { expected, found });
        }
    };
    // Distance in memory between neighbours along each axis.
    let strides = if array.fortran_order {
        [1, a, a * b, a * b * c]
    } else {
        [b * c * channels, c * channels, channels, 1]
    };
    let (size, strides) = match axes {
        AxisOrder::Xyz => ([a, b, c], strides),
        AxisOrder::Zyx => ([c, b, a], [strides[2], strides[1], strides[0], strides[3]]),
    };
    let data = match array.data {
        NpyData::F32(data) => arrange(&data, size, channels, strides),
        NpyData::F64(data) => arrange(&data, size, channels, strides),
    };
    Volume::new(size, channels, data, None)
}

/// Copies the values so that channels are neighbours, then x is fastest.
fn arrange<S: Sample, T: Sample>(
    data: &[S],
    [nx, ny, nz]: [usize; 3],
    channels: usize,
    [sx, sy, sz, sc]: [usize; 4],
) -> Vec<T> {
    let mut out = Vec::with_capacity(data.len());
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let voxel = x * sx + y * sy + z * sz;
                out.extend(
                    (0..channels).map(|channel| T::nearest(data[voxel + channel * sc].wide())),
                );
            }
        }
    }
    out
}
