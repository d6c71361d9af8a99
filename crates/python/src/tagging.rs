//! Light with phases that sound modulates.

use crate::numbers::{array, ask_for_memory};
use numpy::{PyArrayDyn, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use transport::sidebands;

/// Returns the fractions of light in the orders 0 to `orders`, the first axis, by the amplitude of
/// its phase.
#[pyfunction]
pub fn order_shares<'py>(
    py: Python<'py>,
    phases: PyReadonlyArrayDyn<'py, f64>,
    orders: u32,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let parts = orders as usize + 1;
    let count = phases.len();
    ask_for_memory(count, parts * size_of::<f64>(), "sidebands")?;
    let mut shares = vec![0.0; parts * count];
    for (i, phase) in phases.as_array().iter().enumerate() {
        for (order, share) in sidebands::order_shares(*phase, orders).enumerate() {
            shares[order * count + i] = share;
        }
    }
    array(py, shares, &[&[parts], phases.shape()].concat())
}

/// Returns the autocorrelation of light by the amplitude of its phase, at a delay that turns the
/// phase of the sound by twice `half_turn`.
#[pyfunction]
pub fn phase_correlation<'py>(
    py: Python<'py>,
    phases: PyReadonlyArrayDyn<'py, f64>,
    half_turn: f64,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let of = |phase: &f64| sidebands::correlation(*phase, half_turn);
    let values = phases.as_array().iter().map(of).collect();
    array(py, values, phases.shape())
}
