//! Numbers on their way from and to Python.

use glam::DVec3;
use numpy::{AllowTypeChange, Element, PyArray1, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A NumPy array that takes over the memory of `values`.
///
/// # Errors
/// A shape that does not fit.
pub fn array<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Positions or directions in an array of shape (..., 3).
#[derive(Debug)]
pub struct Rows {
    /// The shape without the last axis.
    pub outer: Vec<usize>,
    /// The points, the last axis of `outer` running fastest.
    pub rows: Vec<DVec3>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Rows {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let numbers: PyArrayLikeDyn<'py, f64, AllowTypeChange> = object.extract()?;
        let view = numbers.as_array();
        let [outer @ .., 3] = view.shape() else {
            let message = format!(
                "expected an array of shape (..., 3), found {:?}",
                view.shape()
            );
            return Err(PyValueError::new_err(message));
        };
        let rows = view.rows().into_iter();
        let rows = rows.map(|x| DVec3::new(x[0], x[1], x[2])).collect();
        Ok(Rows {
            outer: outer.to_vec(),
            rows,
        })
    }
}
