//! HDF5: a dataset for each array, with attributes `unit` and `axes`. The root group has all other
//! attributes.

use super::{Array, Arrays, Read, numbered, plain};
use crate::atomic;
use crate::element::Element;
use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::volume::hdf5::{self, StoredNumbers};

use hdf5_writer::{AttributeBuilder, DatasetBuilder, Error, Hdf5Builder, Hdf5Writer, WriteOptions};
use serde_json::Value;
use std::io;
use std::path::Path;

/// Writes all arrays.
pub(super) fn write(path: &Path, arrays: &Arrays, element: Element) -> Result<(), FileError> {
    atomic::write(path, |file| {
        let text =
            |(name, value): &(String, Value)| AttributeBuilder::fixed_string(name, plain(value));
        let attributes = arrays.attributes.iter().map(text);
        let root = attributes.fold(Hdf5Builder::new(), Hdf5Builder::attribute);
        let datasets = arrays.list.iter();
        let datasets = datasets.map(|array| dataset(array, arrays.element(array, element)));
        let all = datasets.collect::<Result<Vec<_>, Error>>();
        let plan = all.and_then(|all| all.into_iter().fold(root, Hdf5Builder::dataset).into_plan());
        let writer = Hdf5Writer::new(file, WriteOptions::default());
        plan.and_then(|plan| writer.finish(plan))
            .map_err(io::Error::other)?;
        Ok(())
    })
}

fn dataset(array: &Array, element: Element) -> Result<DatasetBuilder, Error> {
    let shape: Vec<u64> = array.shape.iter().map(|&n| n as u64).collect();
    let dataset = if element == Element::F32 {
        let data: Vec<f32> = array.data.iter().map(|v| *v as f32).collect();
        DatasetBuilder::typed_data(&array.name, shape, &data)?
    } else {
        DatasetBuilder::typed_data(&array.name, shape, &array.data)?
    };
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

/// Reads the numbers of all groups. Units and axes come from [`write`]; in other files, axes are
/// numbered.
pub(super) fn read(path: &Path, limits: Limits) -> Result<Read, Problem> {
    let found = hdf5::numbers(path, limits)?;
    let mut read = Read {
        attributes: found.attributes.into_iter().map(structured).collect(),
        ..Read::default()
    };
    for (name, stored) in found.datasets {
        read.add(&name, stored.map(|stored| array(&name, stored)));
    }
    Ok(read)
}

/// Parses an attribute that [`write`] has stored as a JSON array or object. Other texts do not
/// change.
fn structured((name, value): (String, Value)) -> (String, Value) {
    let json = value.as_str().filter(|text| text.starts_with(['[', '{']));
    let parsed = json.and_then(|json| serde_json::from_str(json).ok());
    (name, parsed.unwrap_or(value))
}

fn array(name: &str, stored: StoredNumbers) -> Array {
    let text = |name| stored.attributes.iter().find(|(n, _)| n == name);
    let axes = text("axes").and_then(|(_, axes)| axes.as_str());
    let axes: Option<Vec<String>> = axes.map(|a| a.split_whitespace().map(str::to_owned).collect());
    let axes = axes.filter(|axes| axes.len() == stored.shape.len());
    let unit = text("unit").and_then(|(_, unit)| unit.as_str());
    Array {
        axes: axes.unwrap_or_else(|| numbered(stored.shape.len())),
        unit: unit.filter(|unit| *unit != "1").unwrap_or_default().into(),
        name: name.to_owned(),
        shape: stored.shape,
        data: stored.data,
    }
}
