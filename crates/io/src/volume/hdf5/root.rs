//! All numbers of the root group, whatever their axes.

use super::elements::encoding;
use super::{describe, limits};
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};
use crate::volume::Options;
use hdf5_reader::{Attribute, Dataset, Hdf5File};
use serde_json::Value;
use std::path::Path;

/// What is in the root group of a file.
pub(crate) struct RootNumbers {
    pub datasets: Vec<StoredNumbers>,
    /// Attributes of the group that are texts or a number.
    pub attributes: Vec<(String, Value)>,
}

/// A dataset of numbers.
pub(crate) struct StoredNumbers {
    pub name: String,
    pub shape: Vec<usize>,
    pub data: Vec<f64>,
    /// Attributes that are texts or a number.
    pub attributes: Vec<(String, Value)>,
}

/// Reads all datasets of real numbers in the root group; others are left out.
pub(crate) fn numbers(path: &Path, memory: Limits) -> Result<RootNumbers, FileError> {
    let (_, size) = input::open(path)?;
    let read = || {
        let options = limits(size, Options::default().within(memory));
        let file = Hdf5File::open_with_options(path, options).map_err(describe)?;
        let root = file.root_group().map_err(describe)?;
        let attributes = root.attributes().map_err(describe)?;
        let mut count = 0_u64;
        let mut datasets = Vec::new();
        for dataset in root.datasets().map_err(describe)? {
            if matches!(encoding(&dataset), Ok((_, false))) {
                // All together are within the limit.
                count = count.saturating_add(dataset.num_elements().map_err(describe)?);
                memory.check(count, 2 * size_of::<f64>() as u64, size)?;
                datasets.push(stored(&dataset)?);
            }
        }
        Ok(RootNumbers {
            datasets,
            attributes: attributes.iter().filter_map(value).collect(),
        })
    };
    read().map_err(|problem: Problem| problem.at(path))
}

fn stored(dataset: &Dataset) -> Result<StoredNumbers, Problem> {
    let (encoding, _) = encoding(dataset)?;
    let shape: Option<Vec<usize>> = (dataset.shape().iter())
        .map(|n| (*n).try_into().ok())
        .collect();
    let too_large = || Problem::TooLarge(format!("an array of {:?}", dataset.shape()));
    let bytes = dataset.read_raw_bytes().map_err(describe)?;
    let mut data = Vec::with_capacity(bytes.len() / encoding.element.size());
    let count = data.capacity();
    let read = encoding.read(&mut &bytes[..], count, |v| data.push(v));
    read.map_err(Problem::Read)?;
    Ok(StoredNumbers {
        name: dataset.name().trim_start_matches('/').to_owned(),
        shape: shape.ok_or_else(too_large)?,
        data,
        attributes: dataset.attributes().iter().filter_map(value).collect(),
    })
}

/// A text or a number.
fn value(attribute: &Attribute) -> Option<(String, Value)> {
    let text = attribute.read_string().map(Value::from);
    let value = text.or_else(|_| attribute.read_as_f64().map(Value::from));
    Some((attribute.name.clone(), value.ok()?))
}
