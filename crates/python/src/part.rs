//! Parts of runs, made by other processes and put together here.

use crate::errors;
use crate::limits::Limits;
use crate::measure::{self, Measured};
use crate::render::{self, Rendered, Run};
use crate::scene::Scene;
use crate::watch::{Shared, watched};
use io::Problem;
use io::part::{Body, Header, Part};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::time::Instant;
use transport::meter::Meter;
use transport::render::{MeasureOptions, MeasureState, Options, State};
use transport::renderer::Renderer;

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
    let renderer = render::renderer(scene, integrator)?;
    let header = Header::new(
        &scene.loaded,
        &renderer,
        limits.seed,
        limits.samples,
        Some(shard),
    );
    let (pool, started) = (limits.pool()?, Instant::now());
    let (body, interrupted) = watched(py, (None, None), |shared| {
        pool.install(|| {
            if scene.loaded.instruments.is_empty() {
                Ok(image(scene, (limits, renderer), &header, shared))
            } else {
                readings(scene, limits, &header, shared)
            }
        })
    })?;
    if interrupted {
        return Err(PyKeyboardInterrupt::new_err(()));
    }
    let mut part = Part {
        header,
        body: body?,
    };
    part.header.seconds = started.elapsed().as_secs_f64();
    Ok(PyBytes::new(py, &py.detach(|| part.to_bytes())))
}

fn going_on(shared: &Shared) -> ControlFlow<()> {
    if shared.stop.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

fn image(
    scene: &Scene,
    (limits, renderer): (Limits, Renderer),
    header: &Header,
    shared: &Shared,
) -> Body {
    let (scenes, range) = (&scene.loaded.groups, header.range());
    let options = Options {
        first: range.start,
        samples: range.end - range.start,
        ..render::options(scene, limits, renderer)
    };
    let mut state = State::new(scenes, &options);
    state.advance(scenes, &options, &shared.handle, |_| going_on(shared));
    Body::Image(state.into())
}

fn readings(scene: &Scene, limits: Limits, header: &Header, shared: &Shared) -> PyResult<Body> {
    let (scenes, range) = (&scene.loaded.groups, header.range());
    let options = MeasureOptions {
        first: range.start,
        particles: range.end - range.start,
        ..measure::options(scene, limits)
    };
    let meters = meters(scene);
    let state = MeasureState::new(scenes, &meters).and_then(|mut state| {
        state.advance(scenes, &meters, &options, &shared.handle, |_| {
            going_on(shared)
        })?;
        Ok(state)
    });
    let state = state.map_err(|e| measure::failure(&e))?;
    Ok(Body::Meters(state.into()))
}

fn meters(scene: &Scene) -> Vec<Meter> {
    let instruments = scene.loaded.instruments.iter();
    instruments.map(|i| i.meter.clone()).collect()
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
        let renderer = render::renderer(scene.get(), integrator)?;
        let part = self
            .whole
            .take()
            .ok_or_else(|| errors::render("no part of the run is done"))?;
        let header = Header::new(loaded, &renderer, limits.seed, limits.samples, None);
        let misfit =
            |why: String| errors::render(format!("the parts are not of this scene: {why}"));
        part.header
            .agrees(&header)
            .map_err(|e| misfit(e.to_string()))?;
        let run = Run {
            renderer,
            seed: limits.seed,
            requested: limits.samples,
            stopped: interrupted.then_some("interrupted"),
            threads: None,
            seconds,
        };
        let meters = meters(scene.get());
        match part.body {
            Body::Image(state)
                if state.fits(
                    &loaded.groups,
                    &render::options(scene.get(), limits, renderer),
                ) =>
            {
                let rendering = state.into_rendering(&loaded.groups);
                Ok(Bound::new(py, Rendered::new(rendering, scene, run))?.into_any())
            }
            Body::Meters(state) if state.fits(&loaded.groups, &meters) => {
                let measurement = state.into_measurement(&loaded.groups, &meters);
                let measurement = measurement.map_err(|e| measure::failure(&e))?;
                Ok(Bound::new(py, Measured::new(measurement, scene, run))?.into_any())
            }
            _ => Err(misfit("their contents are others".into())),
        }
    }
}
