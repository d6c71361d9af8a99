//! Arrays in JData files, also in objects of objects.

use super::{Array, Read, numbered};
use crate::error::Problem;
use crate::input::{self, Budget, Limits};
use crate::jdata::{AnnotatedArray, JdataValue};
use std::path::Path;

/// Reads all arrays of numbers. Names are paths with `/`.
pub(super) fn read(path: &Path, limits: Limits) -> Result<Read, Problem> {
    let bytes = input::read(path).map_err(|error| error.problem)?;
    let mut budget = Budget::new(limits, bytes.len() as u64);
    let root = JdataValue::parse(&bytes)?;
    drop(bytes);
    let mut read = Read::default();
    for (name, value) in root.arrays() {
        read.add(&name, array(&name, value, &mut budget));
    }
    Ok(read)
}

fn array(name: &str, value: &JdataValue, budget: &mut Budget) -> Result<Array, Problem> {
    let stored = AnnotatedArray::of(value)?;
    budget.take(stored.count() as u64, size_of::<f64>() as u64)?;
    let tensor = stored.tensor()?;
    Ok(Array {
        name: name.to_owned(),
        axes: numbered(tensor.shape().len()),
        shape: tensor.shape().to_vec(),
        unit: String::new(),
        data: tensor.iter().collect(),
    })
}
