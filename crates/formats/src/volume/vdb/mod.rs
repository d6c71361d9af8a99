//! OpenVDB: sparse grids of floating-point numbers, converted to dense grids within the box of
//! active voxels.
//!
//! The reader supports grids of the standard tree (root, 32³, 16³, leaves of 8³) in files of
//! version 222 (OpenVDB 3) and later, with zlib and Blosc compression. It follows OpenVDB's own
//! code: `io/Archive.cc`, `io/Compression.h`, `tree/`, openvdb.org.

mod blosc;
mod bytes;
mod grid;
mod tree;
mod values;

use std::path::Path;

use glam::DVec3;

use super::{Options, Sample, Volume, VolumeFrame, choose, layout};
use crate::error::{FileError, Problem};
use crate::input;
use bytes::Bytes;
use grid::Descriptor;
use tree::Tree;

/// First bytes of a file.
const MAGIC: [u8; 8] = *b" BDV\0\0\0\0";
/// Oldest supported version: the first with compressed nodes.
const MIN_VERSION: u32 = 222;
/// Number of characters of the identifier of a file.
const UUID: usize = 36;

/// Reads the grid with the dataset's name, or the only grid of floating-point numbers if none is
/// given.
///
/// # Errors
///
/// A file that cannot be read, is not an OpenVDB file, or is too old. A missing grid, or a grid
/// without active voxels. Other compression than zlib, and Blosc with LZ4 or zlib. A dense grid
/// beyond the limits of memory. NaN or infinite values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes, options).map_err(|problem| problem.at(path))
}

/// Returns the names of the grids of floating-point numbers.
pub(super) fn names(path: &Path) -> Result<Vec<String>, FileError> {
    let bytes = input::read(path)?;
    let grids = descriptors(&bytes).map_err(|problem| problem.at(path))?;
    Ok(grids.into_iter().map(|grid| grid.name).collect())
}

/// Reads a grid from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    let grids = descriptors(bytes)?;
    let names: Vec<&str> = grids.iter().map(|g| g.name.as_str()).collect();
    let grid = &grids[choose(&names, options.dataset)?];
    let mut cursor = Bytes::new(bytes.get(grid.at..).unwrap_or_default());
    let compression = cursor.u32()?;
    grid::skip_metadata(&mut cursor)?;
    let map = grid::transform(&mut cursor)?;
    let tree = Tree::read(&mut cursor, values::Coding::new(grid, compression)?)?;
    let (first, size) = tree
        .active_box()
        .ok_or_else(|| Problem::Empty("a grid without active voxels".into()))?;
    let count = layout::check(size, 1)?;
    let limits = options.limits;
    let fits = limits.check(count as u64, size_of::<T>() as u64, bytes.len() as u64);
    fits.map_err(|problem| {
        let [x, y, z] = size;
        let message = format!("the active voxels spread over {x} x {y} x {z} ({problem}); crop the grid or resample it");
        Problem::Malformed(message)
    })?;
    let data = tree.dense(&mut cursor, first, size)?;
    let frame = VolumeFrame {
        first: map.transform_point3(DVec3::from_array(first.map(|n| n as f64))),
        steps: map.matrix3,
        nodes: false,
    };
    if !frame.is_sound() {
        return Err(Problem::Malformed("its transform is degenerate".into()));
    }
    let volume = Volume::new(size, 1, data)?;
    Ok(volume.with_element(grid.element).with_frame(frame))
}

/// Returns the grids of floating-point numbers.
fn descriptors(bytes: &[u8]) -> Result<Vec<Descriptor>, Problem> {
    let mut cursor = Bytes::new(bytes);
    if cursor.array() != Ok(MAGIC) {
        return Err(Problem::WrongFormat {
            format: "VDB",
            reason: "it does not begin with OpenVDB's magic number".into(),
        });
    }
    let version = cursor.u32()?;
    if version < MIN_VERSION {
        let message =
            format!("OpenVDB files of version {version}; save it again with OpenVDB 3 or later");
        return Err(Problem::Unsupported(message));
    }
    cursor.take(8)?; // Skip the version of the library.
    let [has_offsets] = cursor.array()?;
    if has_offsets == 0 {
        let message = "OpenVDB streams; save the grid as a file";
        return Err(Problem::Unsupported(message.into()));
    }
    cursor.take(UUID)?;
    grid::skip_metadata(&mut cursor)?;
    Descriptor::all(&mut cursor, bytes)
}
