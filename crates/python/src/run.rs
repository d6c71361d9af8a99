//! Runs: samples, taken while Python handles signals, and results.

use crate::errors;
use crate::finished::RunRecord;
use crate::limits::Limits;
use crate::measure::Measured;
use crate::render::Rendered;
use crate::scene::Scene;
use crate::watch::watched;
use io::clock::{Clock, Stopped};
use io::device::{DeviceChoice, GpuDescription};
use io::part::Body;
use io::{Outcome, Run};
use pyo3::prelude::*;
use std::time::Instant;

/// Renders a picture, or measures if the scene has meters. `tick` is called repeatedly with the
/// number of samples, or particles, so far.
#[pyfunction]
pub fn render<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    integrator: Option<&str>,
    device: &str,
    tick: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut run = limits.run_by(&scene.get().loaded, integrator)?;
    let device: DeviceChoice = device
        .parse()
        .map_err(|why| errors::render(format!("device is '{device}': {why}")))?;
    py.detach(|| run.choose_device(device))
        .map_err(|e| errors::refusal(&e))?;
    if !run.has_meters() {
        run.check(io::Limits::default())
            .map_err(|e| errors::refusal(&e))?;
    }
    let driven = Driven::by(py, &mut run, &limits, tick.as_ref())?;
    let record = RunRecord {
        renderer: run.renderer,
        reason: run.reason.clone(),
        seed: limits.seed,
        requested: limits.samples,
        stopped: driven.stopped.map(Stopped::name),
        threads: Some(driven.threads),
        device: run.device_name().into(),
        seconds: driven.seconds,
    };
    finish(py, &run, driven.body, scene.clone_ref(py), record)
}

/// Samples that a run has taken.
#[derive(Debug)]
pub struct Driven {
    pub body: Body,
    /// Reason for an early end of the run.
    pub stopped: Option<Stopped>,
    /// True if Ctrl-C was pressed.
    pub interrupted: bool,
    pub threads: usize,
    pub seconds: f64,
}

impl Driven {
    /// Chooses the integrator of a run, if it is undecided, and takes the samples.
    pub fn by(
        py: Python<'_>,
        run: &mut Run,
        limits: &Limits,
        tick: Option<&Py<PyAny>>,
    ) -> PyResult<Self> {
        let (pool, started, time) = (limits.pool()?, Instant::now(), run.time);
        let ((body, stopped), interrupted) = watched(py, tick, time, |shared| {
            let (handle, requested) = (&shared.handle, || shared.requested());
            let mut clock = Clock::start(time, &requested);
            let body = pool.install(|| {
                run.choose(handle);
                let mut body = run.start()?;
                run.advance(&mut body, handle, &mut clock, |_| ())?;
                Ok(body)
            });
            (body, clock.end(handle))
        })?;
        let body = body.map_err(|e| errors::refusal(&e))?;
        Ok(Driven {
            stopped: stopped.or(body.reached().then_some(Stopped::Target)),
            body,
            interrupted,
            threads: pool.current_num_threads(),
            seconds: started.elapsed().as_secs_f64(),
        })
    }
}

/// Converts the samples of a run to a Python object.
pub fn finish<'py>(
    py: Python<'py>,
    run: &Run,
    body: Body,
    scene: Py<Scene>,
    record: RunRecord,
) -> PyResult<Bound<'py, PyAny>> {
    let outcome = py.detach(|| run.finish(body));
    Ok(match outcome.map_err(|e| errors::refusal(&e))? {
        Outcome::Picture(rendering) => {
            Bound::new(py, Rendered::new(*rendering, scene, record))?.into_any()
        }
        Outcome::Readings(measurement) => {
            Bound::new(py, Measured::new(*measurement, scene, record))?.into_any()
        }
    })
}

/// Lists the GPUs of this machine: name, kind, driver, and bytes of the largest buffer.
#[pyfunction]
pub fn devices(py: Python<'_>) -> Vec<(String, String, String, u64)> {
    let gpus = py.detach(io::device::gpus);
    let tuple = |gpu: GpuDescription| (gpu.name, gpu.kind, gpu.driver, gpu.memory);
    gpus.into_iter().map(tuple).collect()
}
