//! Derivatives of pictures by the refractive index of media that scatter.

use crate::derivative::{Doubles, only, path};
use crate::errors;
use crate::limits::Limits;
use crate::numbers::array;
use crate::scene::Scene;
use crate::watch::watched;
use numpy::PyReadonlyArray1;
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use transport::attached::IndexDerivativeError;
use transport::render::{IndexDerivativeOptions, index_derivatives};

/// Derivatives of Σ weights × picture by the index of media, which are given by their names: by samples [z, y, x] of n, or by the parameters of
/// the field.
#[pyfunction]
pub fn differentiate_index<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    media: Vec<String>,
    weights: PyReadonlyArray1<'py, f64>,
    tick: Option<Py<PyAny>>,
) -> PyResult<Vec<Doubles<'py>>> {
    let loaded = &scene.get().loaded;
    if !loaded.instruments.is_empty() {
        let message = "readings of meters have no derivatives by an index: give the scene a camera";
        return Err(errors::render(message));
    }
    if loaded.is_dispersive() {
        let message = "where each wavelength has rays of its own, pictures have no derivatives by an index: render its channels one by one";
        return Err(errors::render(message));
    }
    let names = || loaded.scene().media().iter().map(|m| m.name.as_str());
    let media = media.iter().map(|name| only(names(), name, "medium"));
    let media: Vec<usize> = media.collect::<PyResult<_>>()?;
    let options = IndexDerivativeOptions {
        path: path(loaded)?,
        samples: limits.samples.unwrap_or(loaded.samples),
        seed: limits.seed,
        hide_emitters: loaded.hide_emitters,
        media: &media,
        weights: weights.as_slice()?,
    };
    let pool = limits.pool()?;
    let (found, interrupted) = watched(py, tick.as_ref(), None, |shared| {
        pool.install(|| index_derivatives(&loaded.groups, &options, &shared.handle))
    })?;
    let found = found.map_err(|e| refused(&e))?.filter(|_| !interrupted);
    let found = found.ok_or_else(|| PyKeyboardInterrupt::new_err(()))?;
    let both = found.by.into_iter().map(|derivative| {
        let shape = &derivative.shape;
        Ok((
            array(py, derivative.values, shape)?,
            array(py, derivative.errors, shape)?,
        ))
    });
    both.collect()
}

fn refused(error: &IndexDerivativeError) -> PyErr {
    match error {
        IndexDerivativeError::Memory(_) => PyMemoryError::new_err(error.to_string()),
        _ => errors::render(error.to_string()),
    }
}
