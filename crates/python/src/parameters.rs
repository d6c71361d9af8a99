//! Parameters of scenes by name.

use crate::dict;
use crate::errors;
use crate::numbers::array;
use crate::scene::{MAX_KEPT, Overrides, Scene, kept};
use io::json::Item;
use io::parameters::{ParameterValue, parameters, with_values};
use io::scene::{Numbers, SpectrumValue, Tensor, Value};
use io::schema::Default;
use io::{Diagnostics, SceneDescription};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Kind of the recipes of scenes with other values of parameters.
const CHANGED: &str = "changed";

/// Name, type, value, and true for a default.
type Row = (String, &'static str, Py<PyAny>, bool);

/// Returns names, types and values of all parameters of a scene, and true for each default.
#[pyfunction]
pub fn scene_parameters(py: Python<'_>, scene: &Scene) -> PyResult<Vec<Row>> {
    let row = |parameter: io::parameters::SceneParameter| {
        let value = match &parameter.value {
            Some(ParameterValue::Given(value)) => given(py, value)?,
            Some(ParameterValue::Default(value)) => default(py, value, parameter.kind)?,
            None => py.None(),
        };
        Ok((parameter.name, parameter.kind, value, parameter.is_default))
    };
    let all = parameters(scene.description()?);
    all.into_iter().map(row).collect()
}

/// Returns a scene with other values of parameters.
#[pyfunction]
pub fn scene_with_values(
    py: Python<'_>,
    scene: &Scene,
    values: &Bound<'_, PyDict>,
) -> PyResult<Scene> {
    let description = scene.description()?;
    let mut items: Vec<(String, Item)> = Vec::with_capacity(values.len());
    for (name, value) in values {
        let name: String = name.extract()?;
        let item = dict::item(&value, &format!("parameters[{name:?}]"))?;
        items.push((name, item));
    }
    // Replaced values of a scene with replaced values belong to the first scene.
    let recipe = scene.recipe.bind(py).cast::<PyTuple>()?;
    let kind: String = recipe.get_item(0)?.extract()?;
    let instead = recipe.get_item(3)?;
    let all = PyDict::new(py);
    let base = if kind == CHANGED {
        all.update(recipe.get_item(2)?.cast::<PyDict>()?.as_mapping())?;
        recipe.get_item(1)?
    } else {
        recipe.clone().into_any()
    };
    all.update(values.as_mapping())?;
    let options = instead.extract::<Overrides>()?.options()?;
    let made = py.detach(|| {
        let mut diagnostics = Diagnostics::new();
        let changed = with_values(description, items, &mut diagnostics);
        let Some((changed, objects)) = changed else {
            return Err(diagnostics);
        };
        let loaded = scene
            .loaded
            .with_changes(&changed, &objects, &options, diagnostics)?;
        Ok((loaded, changed))
    });
    let (loaded, changed) = made.map_err(|d| errors::scene(&d))?;
    Ok(Scene {
        loaded,
        name: scene.name.clone(),
        description: kept(changed),
        recipe: (CHANGED, base, all, instead).into_py_any(py)?,
    })
}

impl Scene {
    fn description(&self) -> PyResult<&SceneDescription> {
        self.description.as_ref().ok_or_else(|| {
            let most = MAX_KEPT >> 20;
            let message = format!(
                "the arrays of the scene take more than {most} MiB, so it does not keep them for changes of parameters: load the changed scene"
            );
            PyValueError::new_err(message)
        })
    }
}

/// Converts the value of a parameter.
fn given(py: Python<'_>, value: &Value) -> PyResult<Py<PyAny>> {
    match value {
        Value::Float(v) => v.into_py_any(py),
        Value::Integer(v) => v.into_py_any(py),
        Value::Boolean(v) => v.into_py_any(py),
        Value::String(v) => v.into_py_any(py),
        Value::Spectrum(v) => spectrum(py, v),
        Value::Point(v) | Value::Vector(v) => numbers(py, v.to_array().to_vec(), &[3]),
        Value::Transform(v) => numbers(py, v.transpose().to_cols_array().to_vec(), &[4, 4]),
        Value::Tensor(v) => tensor(py, v),
    }
}

fn spectrum(py: Python<'_>, value: &SpectrumValue) -> PyResult<Py<PyAny>> {
    match value {
        SpectrumValue::Uniform(v) | SpectrumValue::EqualEnergy(v) => v.into_py_any(py),
        SpectrumValue::Rgb(v) => numbers(py, v.to_vec(), &[3]),
        SpectrumValue::Sampled(pairs) => {
            let values = pairs.iter().flat_map(|(nm, v)| [*nm, *v]).collect();
            numbers(py, values, &[pairs.len(), 2])
        }
        SpectrumValue::File(name) => name.into_py_any(py),
        SpectrumValue::D65(v) => format!("d65 of luminance {v}").into_py_any(py),
        SpectrumValue::Blackbody {
            temperature, scale, ..
        } => format!("blackbody of {temperature} K times {scale}").into_py_any(py),
    }
}

fn tensor(py: Python<'_>, tensor: &Tensor) -> PyResult<Py<PyAny>> {
    let mut shape = tensor.shape().to_vec();
    if tensor.is_complex() {
        shape.push(2);
    }
    match tensor.numbers() {
        Numbers::Single(v) => array(py, v.clone(), &shape)?.into_py_any(py),
        Numbers::Double(v) => numbers(py, v.clone(), &shape),
    }
}

/// Converts the default of a parameter.
fn default(py: Python<'_>, value: &Default, kind: &str) -> PyResult<Py<PyAny>> {
    match *value {
        Default::Number(v) if kind == "integer" => (v as i64).into_py_any(py),
        Default::Number(v) => v.into_py_any(py),
        Default::Flag(v) => v.into_py_any(py),
        Default::Text(v) => v.into_py_any(py),
        Default::Triple(v) => numbers(py, v.to_vec(), &[3]),
        Default::Identity => {
            let identity = (0..16).map(|i| f64::from(u8::from(i % 5 == 0)));
            numbers(py, identity.collect(), &[4, 4])
        }
        Default::Required | Default::Absent | Default::Computed(_) => Ok(py.None()),
    }
}

fn numbers(py: Python<'_>, values: Vec<f64>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    array(py, values, shape)?.into_py_any(py)
}
