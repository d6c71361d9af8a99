//! Arrays in MATLAB files of version 5, and of version 7.3, which is HDF5.

use super::{Array, Read, hdf5, last_fastest};
use crate::error::Problem;
use crate::input::Limits;
use crate::volume::mat::{self, StoredArray};
use std::path::Path;

/// Reads all arrays of numbers.
pub(super) fn read(path: &Path, limits: Limits) -> Result<Read, Problem> {
    if mat::is_hdf5(path)? {
        let read = hdf5::read(path, limits)?;
        let arrays = read.arrays.into_iter().map(reversed).collect();
        return Ok(Read { arrays, ..read });
    }
    let mut read = Read::default();
    for (name, stored) in mat::numbers(path, limits)? {
        read.add(&name, stored.map(|stored| array(&name, stored)));
    }
    Ok(read)
}

fn array(name: &str, StoredArray { shape, data }: StoredArray) -> Array {
    Array {
        name: name.to_owned(),
        axes: dimensions(shape.len()),
        data: last_fastest(&shape, data),
        unit: String::new(),
        shape,
    }
}

/// Returns names of dimensions, counted from 1 as in MATLAB.
fn dimensions(count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("dimension {i}")).collect()
}

/// Reverses the axes of an array. HDF5 lists them in reverse order, because MATLAB's first index
/// runs fastest.
fn reversed(stored: Array) -> Array {
    // Planted error "arrays of MATLAB 7.3 with the axes of HDF5", found by morgana-io/io::volumes_of_others::all_arrays_of_a_file:
    // let shape = stored.shape.into_iter().collect();
    let shape = stored.shape.into_iter().rev().collect();
    let data = stored.data;
    array(&stored.name, StoredArray { shape, data })
}
