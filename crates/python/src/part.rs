//! Parts of runs, which other processes make and this process combines.

use crate::errors;
use crate::finished::RunRecord;
use crate::limits::Limits;
use crate::run::{Driven, finish};
use crate::scene::Scene;
use io::part::Part;
use io::{Problem, Run};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Takes the samples of part `shard`, its number from 0 and the number of all parts. Returns the
/// part as the bytes of a file.
#[pyfunction]
pub fn render_part<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    integrator: Option<&str>,
    shard: [u64; 2],
) -> PyResult<Bound<'py, PyBytes>> {
    let mut run = Run {
        shard: Some(shard),
        ..limits.run_by(&scene.get().loaded, integrator)?
    };
    let driven = Driven::by(py, &mut run, &limits, None)?;
    if driven.interrupted {
        return Err(PyKeyboardInterrupt::new_err(()));
    }
    let mut part = Part {
        header: run.header(),
        body: driven.body,
    };
    part.header.seconds = driven.seconds;
    Ok(PyBytes::new(py, &py.detach(|| part.to_bytes())))
}

/// Combined parts of one run.
#[pyclass(module = "morgana._morgana")]
#[derive(Debug, Default)]
pub struct Parts {
    whole: Option<Part>,
}

#[pymethods]
impl Parts {
    #[new]
    fn new() -> Self {
        Parts::default()
    }

    /// Adds a part; parts may come in any order.
    fn add(&mut self, py: Python<'_>, part: &[u8]) -> PyResult<()> {
        let part = py.detach(|| Part::from_bytes(part));
        let part = part.map_err(|e: Problem| errors::render(format!("a part is {e}")))?;
        match &mut self.whole {
            None => self.whole = Some(part),
            Some(whole) => {
                let merged = py.detach(|| whole.merge(&part));
                merged.map_err(|e| {
                    errors::render(format!("a part does not belong to the others: {e}"))
                })?;
            }
        }
        Ok(())
    }

    /// Number of samples per pixel, or of particles, so far.
    #[getter]
    fn done(&self) -> u64 {
        self.whole
            .as_ref()
            .map_or(0, |part| part.body.done().count())
    }

    /// Returns the result of an undivided run, and removes the parts.
    fn result<'py>(
        &mut self,
        py: Python<'py>,
        scene: Py<Scene>,
        limits: Limits,
        integrator: Option<&str>,
        interrupted: bool,
        seconds: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let part = self
            .whole
            .take()
            .ok_or_else(|| errors::render("no part of the run is done"))?;
        let mut run = limits.run_by(&scene.get().loaded, integrator)?;
        run.choose_as(&part.header);
        let misfit =
            |why: String| errors::render(format!("the parts are not of this scene: {why}"));
        part.header
            .agrees(&run.header())
            .map_err(|e| misfit(e.to_string()))?;
        if !run.fits(&part.body) {
            return Err(misfit("their contents do not fit it".into()));
        }
        let record = RunRecord {
            renderer: run.renderer,
            reason: run.reason.clone(),
            seed: limits.seed,
            requested: limits.samples,
            stopped: interrupted.then_some("interrupted"),
            threads: None,
            device: run.device_name().into(),
            seconds,
        };
        finish(py, &run, part.body, scene.clone_ref(py), record)
    }
}
