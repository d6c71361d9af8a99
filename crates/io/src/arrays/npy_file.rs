//! NumPy files: arrays with any number of axes.

use super::{Array, Read, last_fastest, numbered};
use crate::error::Problem;
use crate::input::{self, Budget, Limits};
use crate::{binary, npy};
use std::io;
use std::path::Path;

/// Reads a file as the array `array`.
pub(super) fn read(path: &Path, limits: Limits) -> Result<Read, Problem> {
    let (mut reader, size) = input::open(path).map_err(|error| error.problem)?;
    let mut budget = Budget::new(limits, size);
    let array = read_from("array", &mut reader, size, &mut budget)?;
    Ok(Read {
        arrays: vec![array],
        ..Read::default()
    })
}

/// Reads the array `name` of `size` bytes; its axes are numbered.
pub(super) fn read_from(
    name: &str,
    reader: &mut impl io::Read,
    size: u64,
    budget: &mut Budget,
) -> Result<Array, Problem> {
    let header = npy::NpyHeader::read(reader, size)?;
    let element = header.encoding.element;
    let count = binary::checked_count(&header.shape, element.size(), header.size, size)?;
    // An array in Fortran order is copied into another order.
    let copies = if header.fortran_order { 2 } else { 1 };
    budget.take(count as u64, copies * size_of::<f64>() as u64)?;
    let mut data = Vec::with_capacity(count);
    let read = header.encoding.read(reader, count, |v| data.push(v));
    read.map_err(Problem::Read)?;
    if header.fortran_order {
        data = last_fastest(&header.shape, data);
    }
    Ok(Array {
        name: name.to_owned(),
        axes: numbered(header.shape.len()),
        shape: header.shape,
        unit: String::new(),
        data,
    })
}
