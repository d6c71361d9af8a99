//! Parts of runs, made by other processes and put together here.

use crate::errors;
use crate::finished::RunRecord;
use crate::limits::Limits;
use crate::measure::Measured;
use crate::render::Rendered;
use crate::scene::Scene;
use crate::watch::{Shared, watched};
use io::part::{Body, Part};
use io::{Problem, Refusal, Run};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::ops::ControlFlow;
use std::time::Instant;
use transport::render::{MeasureState, State};

/// Takes part `shard`, its number from 0 and that of all parts, of the samples of a run, and returns it as the bytes of a file.
#[pyfunction]
pub fn render_part<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    integrator: Option<&str>,
    shard: [u64; 2],
) -> PyResult<Bound<'py, PyBytes>> {
    let scene = scene.get();
    let mut asked = Run {
        shard: Some(shard),
        ..limits.run_by(&scene.loaded, integrator)?
    };
    let (pool, started) = (limits.pool()?, Instant::now());
    let (body, interrupted) = watched(py, None, None, |shared| {
        pool.install(|| {
            if scene.loaded.instruments.is_empty() {
                asked.choose(&shared.handle);
                Ok(image(&asked, shared))
            } else {
                readings(&asked, shared)
            }
        })
    })?;
    if interrupted {
        return Err(PyKeyboardInterrupt::new_err(()));
    }
    let mut part = Part {
        header: asked.header(),
        body: body?,
    };
    part.header.seconds = started.elapsed().as_secs_f64();
    Ok(PyBytes::new(py, &py.detach(|| part.to_bytes())))
}

fn going_on(shared: &Shared) -> ControlFlow<()> {
    if shared.asked() {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

fn image(asked: &Run, shared: &Shared) -> Body {
    let (scenes, options) = (&asked.loaded.groups, asked.options());
    let mut state = State::new(scenes, &options);
    state.advance(scenes, &options, &shared.handle, |_| going_on(shared));
    Body::Image(state.into())
}

fn readings(asked: &Run, shared: &Shared) -> PyResult<Body> {
    let (scenes, meters) = (&asked.loaded.groups, asked.loaded.meters());
    let options = asked.measure_options();
    let state = MeasureState::new(scenes, &meters).and_then(|mut state| {
        state.advance(scenes, &meters, &options, &shared.handle, |_| {
            going_on(shared)
        })?;
        Ok(state)
    });
    let state = state.map_err(|e| errors::refusal(&Refusal::Meters(e)))?;
    Ok(Body::Meters(state.into()))
}

/// Parts of one run, put together.
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

    /// Adds a part, of which the order does not matter.
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

    /// Samples per pixel, or particles, that are there.
    #[getter]
    fn done(&self) -> u64 {
        self.whole
            .as_ref()
            .map_or(0, |part| part.body.done().count())
    }

    /// What a run in one piece would give. The parts are gone then.
    fn result<'py>(
        &mut self,
        py: Python<'py>,
        scene: Py<Scene>,
        limits: Limits,
        integrator: Option<&str>,
        interrupted: bool,
        seconds: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let loaded = &scene.get().loaded;
        let part = self
            .whole
            .take()
            .ok_or_else(|| errors::render("no part of the run is done"))?;
        let mut asked = limits.run_by(loaded, integrator)?;
        asked.choose_as(&part.header);
        let misfit =
            |why: String| errors::render(format!("the parts are not of this scene: {why}"));
        part.header
            .agrees(&asked.header())
            .map_err(|e| misfit(e.to_string()))?;
        let run = RunRecord {
            renderer: asked.renderer,
            reason: asked.reason.clone(),
            seed: limits.seed,
            requested: limits.samples,
            stopped: interrupted.then_some("interrupted"),
            threads: None,
            seconds,
        };
        let (options, meters) = (asked.options(), loaded.meters());
        match part.body {
            Body::Image(state) if state.fits(&loaded.groups, &options) => {
                let rendering = state.into_rendering(&loaded.groups);
                Ok(Bound::new(py, Rendered::new(rendering, scene, run))?.into_any())
            }
            Body::Meters(state) if state.fits(&loaded.groups, &meters) => {
                let measurement = state.into_measurement(&loaded.groups, &meters);
                let measurement = measurement.map_err(|e| errors::refusal(&Refusal::Meters(e)))?;
                Ok(Bound::new(py, Measured::new(measurement, scene, run))?.into_any())
            }
            _ => Err(misfit("their contents are others".into())),
        }
    }
}
