//! Conversion of numbers from and to Python.

use glam::DVec3;
use numpy::{Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyList, PyTuple};

/// Makes a NumPy array that takes over the memory of `values`.
///
/// # Errors
/// A shape that does not match.
pub fn array<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Checks that the system has memory for `count` elements of `each` bytes: on failure, Rust would
/// abort the interpreter. `what` names the elements in the message.
///
/// # Errors
/// `MemoryError`.
pub fn ask_for_memory(count: usize, each: usize, what: &str) -> PyResult<()> {
    let needed = count.saturating_mul(each);
    Vec::<u8>::new().try_reserve_exact(needed).map_err(|_| {
        let bytes = io::input::bytes(needed as u64);
        PyMemoryError::new_err(format!(
            "{what}: {count} elements need {bytes} of memory, which this system does not have"
        ))
    })
}

/// Rejects masked arrays with hidden elements, also in lists, because the hidden data would be
/// used. `what` names the numbers in the message.
///
/// # Errors
/// Hidden elements.
#[pyfunction]
pub fn refuse_masked(values: &Bound<'_, PyAny>, what: &str) -> PyResult<()> {
    if values.is_instance_of::<PyFloat>() || values.is_instance_of::<PyInt>() {
        return Ok(());
    }
    if values.is_instance_of::<PyList>() || values.is_instance_of::<PyTuple>() {
        for value in values.try_iter()? {
            refuse_masked(&value?, what)?;
        }
        return Ok(());
    }
    let masked = values.py().import("numpy.ma")?;
    if masked.call_method1("is_masked", (values,))?.is_truthy()? {
        let message = format!(
            "{what} is a masked array: fill its masked elements first, as in \
             numpy.ma.filled(array, 0.0)"
        );
        return Err(PyValueError::new_err(message));
    }
    Ok(())
}

/// Positions or directions in an array of shape (..., 3).
#[derive(Debug)]
pub struct Rows {
    /// Shape without the last axis.
    pub outer: Vec<usize>,
    /// Points; the last axis of `outer` varies fastest.
    pub rows: Vec<DVec3>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Rows {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let checks = object.py().import("morgana._numbers")?;
        let vectors = checks.call_method1("vectors", (object, "points"))?;
        let numbers: PyReadonlyArrayDyn<'py, f64> = vectors.extract()?;
        let view = numbers.as_array();
        let outer = &view.shape()[..view.ndim() - 1];
        let rows = view.rows().into_iter();
        ask_for_memory(rows.len(), size_of::<DVec3>(), "points")?;
        let rows = rows.map(|x| DVec3::new(x[0], x[1], x[2])).collect();
        Ok(Rows {
            outer: outer.to_vec(),
            rows,
        })
    }
}
