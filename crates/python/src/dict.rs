//! Dictionaries of Python as descriptions of scenes.

use io::json::Item;
use io::scene::{Numbers, Tensor};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyRecursionError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use std::sync::Arc;

/// Deepest nesting: scenes have a few levels, and cycles have no end.
const DEEPEST: usize = 200;

/// What a Python object says. `place` is how one gets it from the scene, for messages.
pub fn item(object: &Bound<'_, PyAny>, place: &str, depth: usize) -> PyResult<Item> {
    if depth > DEEPEST {
        let message = format!("{place} is nested too deeply: does a dictionary contain itself?");
        return Err(PyRecursionError::new_err(message));
    }
    if object.is_none() {
        Ok(Item::Null)
    } else if let Ok(dict) = object.cast::<PyDict>() {
        entries(dict, place, depth)
    } else if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        let mut items = Vec::new();
        for (i, value) in object.try_iter()?.enumerate() {
            items.push(item(&value?, &format!("{place}[{i}]"), depth + 1)?);
        }
        Ok(Item::Array(items))
    } else if object.is_instance_of::<PyBool>() {
        Ok(Item::Boolean(object.extract()?))
    } else if object.is_instance_of::<PyInt>() {
        let big = |_| object.extract().map(Item::Float);
        object.extract().map(Item::Integer).or_else(big)
    } else if object.is_instance_of::<PyFloat>() {
        Ok(Item::Float(object.extract()?))
    } else if object.is_instance_of::<PyString>() {
        Ok(Item::String(object.extract()?))
    } else if object.hasattr("__fspath__")? {
        let path = object.call_method0("__fspath__")?;
        Ok(Item::String(path.extract()?))
    } else {
        array(object, place)
    }
}

fn entries(dict: &Bound<'_, PyDict>, place: &str, depth: usize) -> PyResult<Item> {
    let mut entries = Vec::with_capacity(dict.len());
    for (key, value) in dict {
        let key: String = key.extract().map_err(|_| {
            PyTypeError::new_err(format!(
                "{place} has the key {key}: keys of scenes are texts"
            ))
        })?;
        let place = format!("{place}[{key:?}]");
        let value = item(&value, &place, depth + 1)?;
        entries.push((key, value));
    }
    Ok(Item::Object(entries))
}

/// An array, a number of NumPy, or an object that has an array or, as transforms of Mitsuba do, a matrix. Arrays in
/// single precision stay so; all others become double.
fn array(object: &Bound<'_, PyAny>, place: &str) -> PyResult<Item> {
    let py = object.py();
    let source = match object.hasattr("matrix")? {
        true => object.getattr("matrix")?,
        false => object.clone(),
    };
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (source,))?;
    let array = array.cast_into::<PyUntypedArray>()?;
    let kind: char = array.dtype().getattr("kind")?.extract()?;
    if !"buif".contains(kind) {
        let name = object.get_type().fully_qualified_name()?;
        let message = format!(
            "{place} is a {name}: expected a number, a text, a list, a dictionary or an array of \
                               numbers"
        );
        return Err(PyTypeError::new_err(message));
    }
    if kind == 'b' && array.ndim() == 0 {
        return Ok(Item::Boolean(array.call_method0("item")?.extract()?));
    }
    let shape = array.shape().to_vec();
    let numbers = match array.cast::<PyArrayDyn<f32>>() {
        Ok(single) => Numbers::Single(single.readonly().as_array().iter().copied().collect()),
        Err(_) => {
            let double = numpy.call_method1("asarray", (&array, "float64"))?;
            let double = double.cast_into::<PyArrayDyn<f64>>()?;
            Numbers::Double(double.readonly().as_array().iter().copied().collect())
        }
    };
    let tensor = Tensor::new(shape, numbers).map_err(|e| PyTypeError::new_err(e.to_string()))?;
    Ok(Item::Tensor(Arc::new(tensor)))
}
