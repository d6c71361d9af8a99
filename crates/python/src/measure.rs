//! Measuring: what meters read.

use crate::errors;
use crate::limits::{Limits, stopped};
use crate::numbers::array;
use crate::render::Run;
use crate::scene::Scene;
use crate::watch::watched;
use io::arrays::{Array, ArrayFormat, Arrays, Context, Quality, arrays};
use io::assemble::Instrument;
use io::{Loaded, report};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;
use transport::meter::{Meter, Reading};
use transport::render::{self, MeasureError, MeasureOptions, Measurement};

/// What meters have read.
#[pyclass(frozen, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Measured {
    measurement: Measurement,
    scene: Py<Scene>,
    /// Everything about the run, as JSON.
    #[pyo3(get)]
    stats: String,
    /// Why it ended early.
    #[pyo3(get)]
    stopped: Option<&'static str>,
}

/// Follows particles through a scene with meters. `tick` is called now and then with the number of particles followed
/// so far.
#[pyfunction]
pub fn measure(
    py: Python<'_>,
    scene: Py<Scene>,
    limits: Limits,
    tick: Option<Py<PyAny>>,
) -> PyResult<Measured> {
    let loaded = &scene.get().loaded;
    let options = options(scene.get(), limits);
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let (pool, started) = (limits.pool()?, Instant::now());
    let ((measurement, is_over), interrupted) =
        watched(py, (tick.as_ref(), limits.time()), |shared| {
            let mut clock = limits.clock(shared);
            let on_pass = |done| clock.look(done == options.particles);
            let handle = &shared.handle;
            let measurement = pool
                .install(|| render::measure(&loaded.groups, &meters, &options, handle, on_pass));
            clock.ended();
            (measurement, clock.is_over)
        })?;
    let measurement = measurement.map_err(|e| failure(&e))?;
    let interrupted = interrupted && measurement.particles < options.particles;
    let run = Run {
        renderer: loaded.renderer,
        seed: limits.seed,
        requested: limits.samples,
        stopped: stopped(interrupted, is_over, false),
        threads: Some(pool.current_num_threads()),
        seconds: started.elapsed().as_secs_f64(),
    };
    Ok(Measured::new(measurement, scene, run))
}

/// How meters are read.
pub fn options(scene: &Scene, limits: Limits) -> MeasureOptions {
    let (max_depth, rr_depth) = scene.loaded.renderer.depths();
    MeasureOptions {
        first: 0,
        particles: limits.samples.unwrap_or(u64::MAX),
        seed: limits.seed,
        max_depth,
        rr_depth,
    }
}

/// Why meters cannot be read.
pub fn failure(error: &MeasureError) -> PyErr {
    match error {
        MeasureError::Dark => errors::render(error.to_string()),
        MeasureError::Memory(_) => PyMemoryError::new_err(error.to_string()),
    }
}

impl Measured {
    pub fn new(measurement: Measurement, scene: Py<Scene>, run: Run) -> Self {
        let stats = json!({
            "scene": scene.get().name,
            "scene_hash": scene.get().loaded.hash.to_string(),
            "seed": run.seed,
            "particles": measurement.particles,
            "particles_requested": run.requested,
            "stopped": run.stopped,
            "threads": run.threads,
            "seconds": run.seconds,
            "counters": report::counters(&measurement.stats),
            "balance": report::balance(&measurement.balance),
            "meters": meters(&measurement, &scene.get().loaded),
        });
        Measured {
            measurement,
            scene,
            stats: stats.to_string(),
            stopped: run.stopped,
        }
    }
}

/// How well each meter's bins are known.
fn meters(measurement: &Measurement, loaded: &Loaded) -> Value {
    let readings = loaded.instruments.iter().zip(&measurement.readings);
    let meter = |(instrument, readings): (&Instrument, &Vec<Reading>)| {
        let each = readings.iter().map(|r| Quality::of(r).json(r.name));
        json!({"name": instrument.name, "readings": each.collect::<Vec<_>>()})
    };
    readings.map(meter).collect()
}

/// Name, unit, names of axes, and the numbers of an array.
type Named<'py> = (String, String, Vec<String>, Bound<'py, PyArrayDyn<f64>>);

#[pymethods]
impl Measured {
    /// All arrays, as they are written to files (docs/meters.md).
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Vec<Named<'py>>> {
        let list = self.readings(Vec::new()).list.into_iter();
        let named = |a: Array| Ok((a.name, a.unit, a.axes, array(py, a.data, &a.shape)?));
        list.map(named).collect()
    }

    /// Writes all arrays, or the main one, in the format that the name of the file tells.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let stats: Value = serde_json::from_str(&self.stats).unwrap_or_default();
        let names = ["scene", "scene_hash", "seed", "particles"];
        let mut attributes: Vec<_> = names
            .map(|name| (name.to_owned(), stats[name].clone()))
            .into();
        // Numbers that have been text lose their last bit.
        attributes.push(("balance".into(), report::balance(&self.measurement.balance)));
        attributes.push(("morgana_version".into(), env!("CARGO_PKG_VERSION").into()));
        let readings = self.readings(attributes);
        let written = py.detach(|| readings.write(&path, ArrayFormat::of(&path)?));
        written.map_err(|e| errors::file(&e))
    }
}

impl Measured {
    fn readings(&self, attributes: Vec<(String, Value)>) -> Arrays {
        let loaded = &self.scene.get().loaded;
        let context = Context {
            instruments: &loaded.instruments,
            measurement: &self.measurement,
            channels: &loaded.channel_names,
        };
        arrays(&context, attributes)
    }
}
