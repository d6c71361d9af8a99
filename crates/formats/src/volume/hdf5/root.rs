//! Reader of all numbers of a file, with any axes.

use super::elements::encoding;
use super::{describe, limits};
use crate::error::Problem;
use crate::input::{self, Budget, Limits};
use crate::volume::Options;
use hdf5_reader::{Attribute, Dataset, Hdf5File};
use serde_json::Value;
use std::collections::HashSet;
use std::path::Path;

/// Content of a file.
pub struct FileNumbers {
    /// Datasets with their paths, and the problems of datasets that cannot be read.
    pub datasets: Vec<(String, Result<StoredNumbers, Problem>)>,
    /// Attributes of the root group that are texts or a number.
    pub attributes: Vec<(String, Value)>,
}

/// Dataset of numbers.
pub struct StoredNumbers {
    /// Shape of the dataset, with a last axis of two for complex numbers.
    pub shape: Vec<usize>,
    /// Numbers; the last index varies fastest.
    pub data: Vec<f64>,
    /// Attributes that are texts or a number.
    pub attributes: Vec<(String, Value)>,
}

/// Reads all datasets of numbers in all groups. Other datasets, MATLAB's texts and MATLAB's own
/// groups are skipped.
///
/// # Errors
/// The file cannot be read, or takes more memory than the limits allow.
pub fn numbers(path: &Path, memory: Limits) -> Result<FileNumbers, Problem> {
    let (_, size) = input::open(path).map_err(|error| error.problem)?;
    let options = limits(size, Options::default().within(memory));
    let file = Hdf5File::open_with_options(path, options).map_err(describe)?;
    let root = file.root_group().map_err(describe)?;
    let attributes = root.attributes().map_err(describe)?;
    let mut budget = Budget::new(memory, size);
    let mut datasets = Vec::new();
    let mut seen = HashSet::new();
    let mut groups = vec![(String::new(), root)];
    while let Some((path, group)) = groups.pop() {
        // Visit each group once: links may form cycles.
        if !seen.insert(group.address()) {
            continue;
        }
        let (inner, found) = match group.members() {
            Ok(members) => members,
            Err(error) if path.is_empty() => return Err(describe(error)),
            Err(error) => {
                datasets.push((path, Err(describe(error))));
                continue;
            }
        };
        for dataset in found {
            let attributes: Vec<_> = dataset.attributes().iter().filter_map(value).collect();
            if encoding(&dataset).is_ok() && !is_text(&attributes) {
                let name = format!("{path}{}", last(dataset.name()));
                datasets.push((name, stored(&dataset, attributes, &mut budget)));
            }
        }
        let inner = inner.into_iter().rev();
        let inner = inner.map(|group| (format!("{path}{}/", last(group.name())), group));
        groups.extend(inner.filter(|(path, _)| !path.starts_with('#')));
    }
    Ok(FileNumbers {
        datasets,
        attributes: attributes.iter().filter_map(value).collect(),
    })
}

/// Returns true if numbers are the characters of a MATLAB text.
fn is_text(attributes: &[(String, Value)]) -> bool {
    (attributes.iter()).any(|(name, value)| name == "MATLAB_class" && value == "char")
}

/// Returns the last part of a path.
fn last(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn stored(
    dataset: &Dataset,
    attributes: Vec<(String, Value)>,
    budget: &mut Budget,
) -> Result<StoredNumbers, Problem> {
    let (encoding, is_complex) = encoding(dataset)?;
    let shape: Option<Vec<usize>> = (dataset.shape().iter())
        .map(|n| (*n).try_into().ok())
        .collect();
    let too_large = || Problem::TooLarge(format!("an array of {:?}", dataset.shape()));
    let mut shape = shape.ok_or_else(too_large)?;
    shape.extend(is_complex.then_some(2));
    let parts = if is_complex { 2 } else { 1 };
    let count = dataset.num_elements().map_err(describe)?;
    // Take memory for the values, and for the bytes from which they are made.
    budget.take(count.saturating_mul(parts), 2 * size_of::<f64>() as u64)?;
    let bytes = dataset.read_raw_bytes().map_err(describe)?;
    let mut data = Vec::with_capacity(bytes.len() / encoding.element.size());
    let count = data.capacity();
    let read = encoding.read(&mut &bytes[..], count, |v| data.push(v));
    read.map_err(Problem::Read)?;
    Ok(StoredNumbers {
        shape,
        data,
        attributes,
    })
}

/// Returns an attribute that is a text or a number.
fn value(attribute: &Attribute) -> Option<(String, Value)> {
    let text = attribute.read_string().map(Value::from);
    let value = text.or_else(|_| attribute.read_as_f64().map(Value::from));
    Some((attribute.name.clone(), value.ok()?))
}
