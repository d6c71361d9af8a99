//! Volumes as datasets of HDF5 files, such as those of k-Wave.

use std::path::Path;

use hdf5_reader::{Dataset, Datatype, Hdf5File, OpenOptions};

use super::npy::{AxisOrder, from_array};
use super::{INFLATION, Sample, Volume};
use crate::error::{FileError, Problem};
use crate::npy::{NpyArray, NpyData};

/// Reads a volume from the dataset at the given path in the file: an array of three axes, or four with
/// the channels last.
///
/// # Errors
///
/// A file that cannot be read, or is no HDF5 file; a dataset that it does not have, or that has another
/// number of axes or other elements than floating-point numbers of 32 or 64 bits; NaN or infinite values.
pub fn read<T: Sample>(
    path: &Path,
    dataset: &str,
    axes: AxisOrder,
) -> Result<Volume<T>, FileError> {
    let size = std::fs::metadata(path)
        .map_err(|e| Problem::Read(e).at(path))?
        .len();
    let file = Hdf5File::open_with_options(path, limits(size)).map_err(describe);
    file.and_then(|file| volume(&file, dataset, axes))
        .map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(
    bytes: &[u8],
    dataset: &str,
    axes: AxisOrder,
) -> Result<Volume<T>, Problem> {
    let options = limits(bytes.len() as u64);
    let file = Hdf5File::from_bytes_with_options(bytes, options).map_err(describe)?;
    volume(&file, dataset, axes)
}

/// No more memory than compressed data in a file of `size` bytes can need.
fn limits(size: u64) -> OpenOptions {
    let most = usize::try_from(size.saturating_mul(INFLATION)).unwrap_or(usize::MAX);
    OpenOptions::default()
        .with_max_chunk_bytes(most)
        .with_max_read_bytes(most)
}

fn volume<T: Sample>(
    file: &Hdf5File,
    dataset: &str,
    axes: AxisOrder,
) -> Result<Volume<T>, Problem> {
    let data = file
        .dataset(dataset)
        .map_err(|e| missing(file, dataset, e))?;
    let shape: Option<Vec<usize>> = data.shape().iter().map(|n| (*n).try_into().ok()).collect();
    let too_large = || Problem::TooLarge(format!("an array of {:?}", data.shape()));
    let array = NpyArray {
        shape: shape.ok_or_else(too_large)?,
        fortran_order: false,
        data: elements(&data)?,
    };
    from_array(array, axes)
}

fn elements(data: &Dataset) -> Result<NpyData, Problem> {
    match data.dtype() {
        Datatype::FloatingPoint { size: 4, .. } => {
            let array = data.read_array::<f32>().map_err(describe)?;
            Ok(NpyData::F32(array.into_iter().collect()))
        }
        Datatype::FloatingPoint { size: 8, .. } => {
            let array = data.read_array::<f64>().map_err(describe)?;
            Ok(NpyData::F64(array.into_iter().collect()))
        }
        _ => Err(Problem::Mismatch {
            expected: "a dataset of floating-point numbers of 32 or 64 bits".into(),
            found: "other elements".into(),
        }),
    }
}

/// Says which datasets there are beside the one that is not.
fn missing(file: &Hdf5File, dataset: &str, error: hdf5_reader::error::Error) -> Problem {
    let folder = dataset
        .trim_matches('/')
        .rsplit_once('/')
        .map_or("", |p| p.0);
    let group = match folder {
        "" => file.root_group(),
        path => file.group(path),
    };
    match group.and_then(|group| group.member_names()) {
        Ok((_, names)) if !names.is_empty() => Problem::Malformed(format!(
            "no dataset '{dataset}' ({error}); datasets of '/{folder}': {}",
            names.join(", ")
        )),
        _ => Problem::Malformed(format!("no dataset '{dataset}' ({error})")),
    }
}

fn describe(error: hdf5_reader::error::Error) -> Problem {
    Problem::WrongFormat {
        format: "HDF5",
        reason: error.to_string(),
    }
}
