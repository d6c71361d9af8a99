//! Arrays in MATLAB files of version 5, and of version 7.3, which is HDF5.

use super::{Array, Arrays, Read, hdf5, last_fastest, npz};
use crate::element::Element;
use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::volume::mat::{self, Content, StoredArray, Variable};
use crate::volume::strided;
use std::path::Path;

/// Axes of positions in MATLAB's order, in which the first index runs fastest.
const POSITIONS: [&str; 6] = ["x", "y", "u", "v", "r", "z"];

/// Writes each array as a variable, and the text `metadata`. Underscores replace other characters
/// of names. Axes of positions come first: `fluence(x, y, z)`.
pub(super) fn write(path: &Path, arrays: &Arrays, element: Element) -> Result<(), FileError> {
    let metadata = npz::metadata(arrays);
    let mut variables: Vec<Variable> = arrays
        .list
        .iter()
        .map(|array| variable(array, arrays.element(array, element)))
        .collect();
    variables.push(Variable {
        name: "metadata".into(),
        shape: vec![1, metadata.encode_utf16().count()],
        content: Content::Text(&metadata),
    });
    for (i, one) in variables.iter().enumerate() {
        if variables[..i].iter().any(|other| other.name == one.name) {
            let message = format!("two arrays '{}' in a MATLAB file: rename a meter", one.name);
            return Err(Problem::Unsupported(message).at(path));
        }
    }
    mat::write_variables(path, variables)
}

fn variable(array: &Array, element: Element) -> Variable<'_> {
    // Find the length and the step of each axis, the slowest first.
    let mut axes = Vec::with_capacity(array.axes.len());
    let mut step = 1;
    for (name, length) in array.axes.iter().zip(&array.shape).rev() {
        let position = POSITIONS.iter().position(|known| known == name);
        axes.insert(0, (position.unwrap_or(POSITIONS.len()), [*length, step]));
        step *= length;
    }
    // The sort is stable: other axes keep their order.
    axes.sort_by_key(|(position, _)| *position);
    let mut shape: Vec<usize> = axes.iter().map(|(_, [length, _])| *length).collect();
    if shape.len() < 2 {
        shape.insert(0, 1);
    }
    shape.resize(shape.len().max(2), 1);
    let slowest_first = axes.into_iter().rev().map(|(_, axis)| axis).collect();
    let values = strided(slowest_first).map(|i| array.data[i]);
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    Variable {
        name: array.name.chars().map(letter).collect(),
        shape,
        content: Content::Numbers(element, Box::new(values)),
    }
}

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
