//! Derivatives of pictures by what their scenes are made of.

use crate::errors;
use crate::limits::Limits;
use crate::numbers::array;
use crate::scene::Scene;
use crate::watch::watched;
use io::Loaded;
use numpy::{PyArrayDyn, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use transport::derivative::{DerivativeError, Parameter};
use transport::film::Decomposition;
use transport::integrator::{Integrator, PathTracer};
use transport::render::{DerivativeOptions, derivatives};

/// Values and standard errors.
type Doubles<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

/// Derivatives of Σ weights × picture by parameters. Weights are those of a picture, or, if they are `layered`, of all its layers, one after
/// the other.
#[pyfunction]
pub fn differentiate<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    parameters: Vec<String>,
    weights: PyReadonlyArray1<'py, f64>,
    layered: bool,
    tick: Option<Py<PyAny>>,
) -> PyResult<Vec<Doubles<'py>>> {
    let loaded = &scene.get().loaded;
    let parameters = parameters.iter().map(|name| parameter(loaded, name));
    let parameters: Vec<Parameter> = parameters.collect::<PyResult<_>>()?;
    let decomposition = if layered {
        loaded.layering.decomposition
    } else {
        Decomposition::default()
    };
    let weights = weights.as_slice()?;
    let options = DerivativeOptions {
        path: path(loaded)?,
        samples: limits.samples.unwrap_or(loaded.samples),
        seed: limits.seed,
        decomposition,
        hide_emitters: loaded.hide_emitters,
        parameters: &parameters,
        weights,
    };
    let pool = limits.pool()?;
    let (found, interrupted) = watched(py, tick.as_ref(), None, |shared| {
        pool.install(|| derivatives(&loaded.groups, &options, &shared.handle))
    })?;
    let Some(found) = found.map_err(|e| refused(&e))?.filter(|_| !interrupted) else {
        return Err(PyKeyboardInterrupt::new_err(()));
    };
    let both = found.by.into_iter().map(|derivative| {
        let shape = &derivative.shape;
        Ok((
            array(py, derivative.values, shape)?,
            array(py, derivative.errors, shape)?,
        ))
    });
    both.collect()
}

fn refused(error: &DerivativeError) -> PyErr {
    match error {
        DerivativeError::Memory(_) => PyMemoryError::new_err(error.to_string()),
        _ => errors::render(error.to_string()),
    }
}

/// The paths that are followed: as long as those of the scene's own integrator.
fn path(loaded: &Loaded) -> PyResult<PathTracer> {
    let own = loaded.renderer.integrator();
    match own {
        Some(Integrator::Path(_) | Integrator::Particle(_) | Integrator::Bdpt(_)) => {
            let (max_depth, rr_depth) = loaded.renderer.depths();
            Ok(PathTracer {
                max_depth,
                rr_depth,
            })
        }
        _ => Err(errors::render(format!(
            "derivatives are those of light without blur, by the paths of the integrator path, not of {}: load the scene with \
             integrator=\"path\"",
            loaded.renderer.name()
        ))),
    }
}

/// Ends of names of parameters, of media, objects and emitters.
const OF_MEDIA: [(&str, fn(usize) -> Parameter); 5] = [
    ("sigma_t", Parameter::Extinction),
    ("albedo", Parameter::Albedo),
    ("sigma_a", Parameter::Absorption),
    ("sigma_s", Parameter::Scattering),
    ("g", Parameter::MeanCosine),
];

/// The parameter of a name such as `smoke.sigma_t`.
fn parameter(loaded: &Loaded, name: &str) -> PyResult<Parameter> {
    let (of, what) = name.rsplit_once('.').unwrap_or(("", name));
    let media = || loaded.scene().media().iter().map(|m| m.name.as_str());
    let objects = || loaded.scene().objects().iter().map(|o| o.name.as_str());
    let emitters = || loaded.emitter_names.iter().map(String::as_str);
    if let Some((_, make)) = OF_MEDIA.iter().find(|(end, _)| *end == what) {
        return Ok(make(only(media(), of, "medium")?));
    }
    match what {
        "reflectance" => Ok(Parameter::Reflectance(only(objects(), of, "object")?)),
        "emission" => Ok(Parameter::Emission(only(emitters(), of, "emitter")?)),
        _ => Err(errors::render(format!(
            "no parameter '{name}': parameters are MEDIUM.sigma_t, .albedo, .sigma_a, .sigma_s and .g, OBJECT.reflectance, and \
             EMITTER.emission"
        ))),
    }
}

/// The only thing of a name.
fn only<'a>(
    mut names: impl Iterator<Item = &'a str> + Clone,
    name: &str,
    what: &str,
) -> PyResult<usize> {
    let all = names.clone();
    let count = all.clone().filter(|known| *known == name).count();
    if count > 1 {
        let message = format!("{count} {what}s are called '{name}': give them ids of their own");
        return Err(errors::render(message));
    }
    names.position(|known| known == name).ok_or_else(|| {
        let known: Vec<String> = all.map(|known| format!("'{known}'")).collect();
        let known = match &known[..] {
            [] => "there is none".into(),
            _ => format!("there are {}", known.join(", ")),
        };
        errors::render(format!("no {what} '{name}': {known}"))
    })
}
