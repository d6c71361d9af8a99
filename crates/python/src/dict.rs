//! Conversion of Python dictionaries to descriptions of scenes.

use crate::numbers::{ask_for_memory, refuse_masked};
use io::json::Item;
use io::scene::{Numbers, Tensor};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyRecursionError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use std::collections::HashSet;
use std::sync::Arc;

/// Parameter that holds an array instead of a file.
const DATA: &str = "data";
/// Mitsuba's parameter for an image.
const BITMAP: &str = "bitmap";
/// Mitsuba's parameter for the samples of a volume.
const GRID: &str = "grid";

/// Maximum nesting depth: scenes have a few levels, and cycles are infinite.
const MAX_DEPTH: usize = 200;

/// Maximum number of repeated dictionaries and lists in one entry of a scene. Each repetition
/// becomes a copy; objects that contain one another twice at each level would multiply
/// exponentially.
const MAX_REPETITIONS: usize = 1 << 16;

/// Memory for each number of an array while a scene is made, in bytes: for the array as read, and
/// for samples, coordinates or coefficients in double precision before and after reordering.
const BYTES_PER_NUMBER: usize = 4 * size_of::<f64>();

/// Converts a scene.
pub fn scene(scene: &Bound<'_, PyDict>) -> PyResult<Item> {
    let apart = |value: &Bound<'_, PyAny>, place: &str| Reader::default().item(value, place, 1);
    entries(scene, "scene", apart)
}

/// Converts an object within a scene. `place` is the expression that selects the object in the
/// scene, for messages.
pub fn item(object: &Bound<'_, PyAny>, place: &str) -> PyResult<Item> {
    Reader::default().item(object, place, 1)
}

/// Converter of Python objects to items.
#[derive(Default)]
struct Reader {
    /// Addresses of the dictionaries and lists so far.
    seen: HashSet<usize>,
    repeated: usize,
}

impl Reader {
    fn item(&mut self, object: &Bound<'_, PyAny>, place: &str, depth: usize) -> PyResult<Item> {
        if let Ok(dict) = object.cast::<PyDict>() {
            self.enter(object, place, depth)?;
            entries(dict, place, |value, place| {
                self.item(value, place, depth + 1)
            })
        } else if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
            self.enter(object, place, depth)?;
            let mut items = Vec::new();
            for (i, value) in object.try_iter()?.enumerate() {
                items.push(self.item(&value?, &format!("{place}[{i}]"), depth + 1)?);
            }
            Ok(Item::Array(items))
        } else {
            plain(object, place)
        }
    }

    /// Registers a dictionary or a list.
    fn enter(&mut self, object: &Bound<'_, PyAny>, place: &str, depth: usize) -> PyResult<()> {
        if depth > MAX_DEPTH {
            let message =
                format!("{place} is nested too deeply: does a dictionary contain itself?");
            return Err(PyRecursionError::new_err(message));
        }
        if !self.seen.insert(object.as_ptr() as usize) {
            self.repeated += 1;
        }
        if self.repeated > MAX_REPETITIONS {
            let message = format!(
                "{place} is one of more than {MAX_REPETITIONS} copies: dictionaries or lists contain each other repeatedly, at many levels"
            );
            return Err(PyValueError::new_err(message));
        }
        Ok(())
    }
}

/// Converts a value that contains no other values.
fn plain(object: &Bound<'_, PyAny>, place: &str) -> PyResult<Item> {
    if object.is_none() {
        Ok(Item::Null)
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

fn entries<'py>(
    dict: &Bound<'py, PyDict>,
    place: &str,
    mut item: impl FnMut(&Bound<'py, PyAny>, &str) -> PyResult<Item>,
) -> PyResult<Item> {
    let mut entries = Vec::with_capacity(dict.len());
    for (key, value) in dict {
        let key: String = key.extract().map_err(|_| {
            PyTypeError::new_err(format!(
                "{place} has the key {key}: keys of scenes must be strings"
            ))
        })?;
        let place = format!("{place}[{key:?}]");
        let (key, value) = match held(dict, &key)? {
            Some(Held::Pixels) => (DATA.to_owned(), pixels(dict, value, &place)?),
            Some(Held::Samples) => (DATA.to_owned(), in_order(dict, value, &place)?),
            None => (key, value),
        };
        let value = item(&value, &place)?;
        entries.push((key, value));
    }
    Ok(Item::Object(entries))
}

/// Kind of array that a plugin holds instead of a file.
enum Held {
    /// Image that may be encoded as in sRGB.
    Pixels,
    /// Numbers.
    Samples,
}

/// Returns the kind of array that a parameter holds. As in Mitsuba, images have `bitmap` and
/// volumes have `grid` in place of `data`.
fn held(plugin: &Bound<'_, PyDict>, key: &str) -> PyResult<Option<Held>> {
    let kind = text(plugin, "type")?;
    let held = match (kind.as_deref(), key) {
        (Some("bitmap" | "envmap"), BITMAP) => Held::Pixels,
        (Some("gridvolume"), GRID) => Held::Samples,
        (_, DATA) => return Ok(Some(Held::Samples)),
        _ => return Ok(None),
    };
    if plugin.contains(DATA)? {
        let message = format!("give '{key}' or 'data', not both");
        return Err(PyValueError::new_err(message));
    }
    Ok(Some(held))
}

/// Returns the linear pixels of an image, such as Mitsuba's `Bitmap`.
fn pixels<'py>(
    plugin: &Bound<'py, PyDict>,
    image: Bound<'py, PyAny>,
    place: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let raw = plugin.get_item("raw")?;
    let raw = raw.map_or(Ok(false), |raw| raw.is_truthy())?;
    let numbers = image.py().import("morgana._numbers")?;
    numbers.call_method1("pixels", (image, place, raw))
}

/// Returns a text of a dictionary, if it has one of this key.
fn text(plugin: &Bound<'_, PyDict>, key: &str) -> PyResult<Option<String>> {
    let value = plugin.get_item(key)?;
    Ok(value.and_then(|value| value.extract().ok()))
}

/// Puts the axes of a volume's or bitmap's array into the order that its plugin expects, if the
/// axes have names as in xarray.
fn in_order<'py>(
    plugin: &Bound<'py, PyDict>,
    array: Bound<'py, PyAny>,
    place: &str,
) -> PyResult<Bound<'py, PyAny>> {
    if !array.hasattr("dims")? {
        return Ok(array);
    }
    let order = match text(plugin, "type")?.as_deref() {
        Some("bitmap" | "envmap") => "yx".to_owned(),
        _ => text(plugin, "axis_order")?.unwrap_or_else(|| "zyx".to_owned()),
    };
    let axes = array.py().import("morgana._numbers")?;
    axes.call_method1("in_order", (array, place, order))
}

/// Converts an array, a NumPy number, or an object with an array or, as Mitsuba's transforms have,
/// a matrix. Arrays in single precision keep it; all others become double.
fn array(object: &Bound<'_, PyAny>, place: &str) -> PyResult<Item> {
    let py = object.py();
    // Check for an array first: points and colours of Dr.Jit are arrays, and have any attribute
    // whose name consists of letters of their components.
    let is_transform = !object.hasattr("__array__")? && object.hasattr("matrix")?;
    let source = if is_transform {
        object.getattr("matrix")?
    } else {
        object.clone()
    };
    refuse_masked(&source, place)?;
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (source,))?;
    let (array, is_complex) = real_and_imaginary(&numpy, array)?;
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
    ask_for_memory(array.len(), BYTES_PER_NUMBER, place)?;
    let numbers = match array.cast::<PyArrayDyn<f32>>() {
        Ok(single) => Numbers::Single(single.readonly().as_array().iter().copied().collect()),
        Err(_) => {
            let double = numpy.call_method1("asarray", (&array, "float64"))?;
            let double = double.cast_into::<PyArrayDyn<f64>>()?;
            Numbers::Double(double.readonly().as_array().iter().copied().collect())
        }
    };
    let tensor = Tensor::new(shape, numbers).map_err(|e| PyTypeError::new_err(e.to_string()))?;
    Ok(Item::Tensor(Arc::new(if is_complex {
        tensor.of_complex_numbers()
    } else {
        tensor
    })))
}

/// Converts arrays of complex numbers to pairs of numbers along a last axis, and leaves others
/// unchanged. Returns true for complex arrays.
fn real_and_imaginary<'py>(
    numpy: &Bound<'py, PyModule>,
    array: Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyAny>, bool)> {
    let kind: char = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let axes: usize = array.getattr("ndim")?.extract()?;
    if kind != 'c' || axes == 0 {
        return Ok((array, false));
    }
    let parts = (array.getattr("real")?, array.getattr("imag")?);
    Ok((numpy.call_method1("stack", (parts, -1))?, true))
}
