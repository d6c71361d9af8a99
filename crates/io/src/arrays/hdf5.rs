//! HDF5: a dataset for each array, with attributes `unit` and `axes`; all others belong to the root group.

use super::{Array, Arrays, plain};
use crate::atomic;
use crate::error::FileError;
use hdf5_writer::{AttributeBuilder, DatasetBuilder, Error, Hdf5Builder, Hdf5Writer, WriteOptions};
use serde_json::Value;
use std::io;
use std::path::Path;

/// Writes all arrays.
pub(super) fn write(path: &Path, arrays: &Arrays) -> Result<(), FileError> {
    atomic::write(path, |file| {
        let text =
            |(name, value): &(String, Value)| AttributeBuilder::fixed_string(name, plain(value));
        let attributes = arrays.attributes.iter().map(text);
        let root = attributes.fold(Hdf5Builder::new(), Hdf5Builder::attribute);
        let datasets = arrays.list.iter().map(dataset);
        let all = datasets.collect::<Result<Vec<_>, Error>>();
        let plan = all.and_then(|all| all.into_iter().fold(root, Hdf5Builder::dataset).into_plan());
        let writer = Hdf5Writer::new(file, WriteOptions::default());
        plan.and_then(|plan| writer.finish(plan))
            .map_err(io::Error::other)?;
        Ok(())
    })
}

fn dataset(array: &Array) -> Result<DatasetBuilder, Error> {
    let shape: Vec<u64> = array.shape.iter().map(|&n| n as u64).collect();
    let dataset = DatasetBuilder::typed_data(&array.name, shape, &array.data)?;
    let axes = AttributeBuilder::fixed_string("axes", array.axes.join(" "));
    let unit = if array.unit.is_empty() {
        "1"
    } else {
        &array.unit
    };
    Ok(dataset
        .attribute(AttributeBuilder::fixed_string("unit", unit))
        .attribute(axes))
}
