//! Results of meters.

use crate::errors;
use crate::finished::{Finished, Pickled, RunRecord};
use crate::numbers::array;
use crate::scene::Scene;
use io::arrays::{Array, ArrayFormat, Arrays, Context, Quality, arrays, attributes, list};
use io::assemble::Instrument;
use io::element::Element;
use io::{Loaded, report};
use numpy::{PyArrayDyn, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyType;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use transport::meter::{Reading, RecordTable};
use transport::render::Measurement;

/// Readings of meters.
#[pyclass(frozen, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Measured(Finished<Measurement>);

impl Measured {
    pub fn new(measurement: Measurement, scene: Py<Scene>, run: RunRecord) -> Self {
        let stats = json!({
            "scene": scene.get().name,
            "scene_hash": scene.get().loaded.hash.to_string(),
            "seed": run.seed,
            "particles": measurement.particles,
            "particles_requested": run.requested,
            "stopped": run.stopped,
            "threads": run.threads,
            "device": run.device,
            "seconds": run.seconds,
            "counters": report::counters(&measurement.stats),
            "balance": report::balance(&measurement.balance),
            "meters": meters(&measurement, &scene.get().loaded),
        });
        Measured(Finished {
            result: measurement,
            scene,
            stats: stats.to_string(),
            stopped: run.stopped.map(str::to_owned),
        })
    }
}

/// Describes the quality of each meter's bins.
fn meters(measurement: &Measurement, loaded: &Loaded) -> Value {
    let read = measurement.readings.iter().zip(&measurement.records);
    let meter = |(instrument, (readings, records)): (
        &Instrument,
        (&Vec<Reading>, &Option<RecordTable>),
    )| {
        let each = readings.iter().map(|r| Quality::of(r).json(&r.name));
        let records = records.as_ref().map(report::records);
        json!({"name": instrument.name, "readings": each.collect::<Vec<_>>(), "records": records})
    };
    loaded.instruments.iter().zip(read).map(meter).collect()
}

/// Reads an NPZ or HDF5 file of readings: its arrays, and its attributes as JSON.
#[pyfunction]
pub fn read_measurement(
    py: Python<'_>,
    path: PathBuf,
) -> PyResult<(Vec<(Outline, ArrayOfNumbers<'_>)>, String)> {
    let read = py.detach(|| Arrays::read_measurement(&path, io::Limits::default()));
    let read = read.map_err(|e| errors::file(&e))?;
    let found = |a: Array| Ok(((a.name, a.unit, a.axes), array(py, a.data, &a.shape)?));
    let list: PyResult<_> = read.list.into_iter().map(found).collect();
    Ok((list?, Value::from_iter(read.attributes).to_string()))
}

/// Array for a file: its outline, and its numbers.
type ArrayForFile<'py> = (Outline, PyReadonlyArrayDyn<'py, f64>);

/// Writes arrays with attributes as JSON, in the format of the file's extension. The first array is
/// the array of formats that hold one.
#[pyfunction]
pub fn write_arrays(
    py: Python<'_>,
    path: PathBuf,
    arrays: Vec<ArrayForFile<'_>>,
    attributes: &str,
    dtype: &str,
) -> PyResult<()> {
    let element = element(dtype)?;
    let attributes: Map<String, Value> = serde_json::from_str(attributes).unwrap_or_default();
    let list = arrays.iter().map(|((name, unit, axes), values)| Array {
        name: name.clone(),
        axes: axes.clone(),
        shape: values.shape().to_vec(),
        unit: unit.clone(),
        data: values.as_array().iter().copied().collect(),
    });
    let arrays = Arrays {
        list: list.collect(),
        main: Some(0),
        attributes: attributes.into_iter().collect(),
        left_out: Vec::new(),
    };
    let written = py.detach(|| arrays.write(&path, ArrayFormat::of(&path)?, element));
    written.map_err(|e| errors::file(&e))
}

/// Returns the type of floating-point numbers with NumPy's name.
fn element(dtype: &str) -> PyResult<Element> {
    let found = Element::of_name(dtype).filter(|e| matches!(e, Element::F32 | Element::F64));
    let message = || format!("dtype must be float32 or float64, not {dtype}");
    found.ok_or_else(|| PyValueError::new_err(message()))
}

/// Numbers of an array.
type ArrayOfNumbers<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Name, unit and names of the axes of an array.
type Outline = (String, String, Vec<String>);

#[pymethods]
impl Measured {
    /// Restores a pickled measurement.
    #[new]
    fn unpickled(
        packed: &[u8],
        scene: Py<Scene>,
        stats: String,
        stopped: Option<String>,
    ) -> PyResult<Self> {
        Finished::unpickled(packed, scene, stats, stopped).map(Measured)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyType>, Pickled<'py>)> {
        Ok((slf.get_type(), slf.get().0.pickled(slf.py())?))
    }

    /// Statistics of the run, as JSON.
    #[getter]
    fn stats(&self) -> &str {
        &self.0.stats
    }

    /// Reason for an early end of the run.
    #[getter]
    fn stopped(&self) -> Option<&str> {
        self.0.stopped.as_deref()
    }

    /// Attributes of the arrays, as JSON (docs/meters.md).
    #[getter]
    fn attributes(&self) -> String {
        Value::from_iter(attributes(&self.context(), Vec::new())).to_string()
    }

    /// Lists all arrays that are written to files (docs/meters.md), without their numbers.
    fn outlines(&self) -> Vec<Outline> {
        let list = list(&self.context(), &|_| false).into_iter();
        list.map(|a| (a.name, a.unit, a.axes)).collect()
    }

    /// Returns the numbers of one of these arrays.
    fn array<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let list = py.detach(|| list(&self.context(), &|other| other == name));
        let found: Option<Array> = list.into_iter().find(|a| a.name == name);
        let found = found.ok_or_else(|| PyKeyError::new_err(name.to_owned()))?;
        array(py, found.data, &found.shape)
    }

    /// Writes the arrays of all meters or of one of them, in the format of the file's extension.
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        dtype: &str,
        meter: Option<usize>,
    ) -> PyResult<()> {
        let element = element(dtype)?;
        let stats: Value = serde_json::from_str(&self.0.stats).unwrap_or_default();
        let names = ["scene", "scene_hash", "seed", "particles"];
        let mut attributes: Vec<_> = names
            .map(|name| (name.to_owned(), stats[name].clone()))
            .into();
        // Take the balance from the result: numbers lose their last bit as text.
        attributes.push(("balance".into(), report::balance(&self.0.result.balance)));
        attributes.push(("morgana_version".into(), env!("CARGO_PKG_VERSION").into()));
        let context = Context {
            meter,
            ..self.context()
        };
        let readings = arrays(&context, attributes);
        let written = py.detach(|| readings.write(&path, ArrayFormat::of(&path)?, element));
        written.map_err(|e| errors::file(&e))
    }
}

impl Measured {
    /// Returns the measurement and its scene.
    fn context(&self) -> Context<'_> {
        let loaded = &self.0.scene.get().loaded;
        Context {
            instruments: &loaded.instruments,
            measurement: &self.0.result,
            channels: &loaded.channel_names,
            meter: None,
        }
    }
}
