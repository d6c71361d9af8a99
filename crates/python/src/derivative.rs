//! Derivatives of pictures and of readings by what their scenes are made of.

use crate::errors;
use crate::limits::Limits;
use crate::numbers::array;
use crate::scene::Scene;
use crate::watch::watched;
use io::Loaded;
use io::assemble::{Instrument, Normalization};
use numpy::{PyArrayDyn, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use transport::Spectrum;
use transport::derivative::{DerivativeError, RadiometricParameter};
use transport::film::Decomposition;
use transport::integrator::{Integrator, PathTracer};
use transport::render::{
    DerivativeOptions, MeterDerivativeOptions, derivatives, meter_derivatives,
};

/// Values and standard errors.
type Doubles<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

/// Derivatives of Σ weights × picture, or × readings, by parameters. Weights are those of a picture; or, if they are `layered`, of all its layers,
/// one after the other; or of each reading of meters, empty for those that do not count.
#[pyfunction]
pub fn differentiate<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    parameters: Vec<String>,
    weights: Vec<PyReadonlyArray1<'py, f64>>,
    layered: bool,
    tick: Option<Py<PyAny>>,
) -> PyResult<Vec<Doubles<'py>>> {
    let loaded = &scene.get().loaded;
    let parameters = parameters.iter().map(|name| parameter(loaded, name));
    let parameters: Vec<RadiometricParameter> = parameters.collect::<PyResult<_>>()?;
    let weights = weights.iter().map(|array| Ok(array.as_slice()?.to_vec()));
    let weights: Vec<Vec<f64>> = weights.collect::<PyResult<_>>()?;
    let pool = limits.pool()?;
    let work = if loaded.instruments.is_empty() {
        Work::Picture(path(loaded)?)
    } else {
        Work::Meters(of_meters(loaded, &parameters, weights.clone())?)
    };
    let (found, interrupted) = watched(py, tick.as_ref(), None, |shared| {
        let handle = &shared.handle;
        pool.install(|| match &work {
            Work::Picture(path) => {
                let mut decomposition = loaded.layering.decomposition;
                if !layered {
                    decomposition = Decomposition::default();
                }
                let options = DerivativeOptions {
                    path: *path,
                    samples: limits.samples.unwrap_or(loaded.samples),
                    seed: limits.seed,
                    decomposition,
                    hide_emitters: loaded.hide_emitters,
                    parameters: &parameters,
                    weights: &weights[0],
                };
                derivatives(&loaded.groups, &options, handle)
            }
            Work::Meters(weights) => {
                let measure = limits.run(loaded).measure_options();
                let options = MeterDerivativeOptions {
                    particles: limits.samples.unwrap_or(loaded.samples),
                    seed: limits.seed,
                    max_depth: measure.max_depth,
                    rr_depth: measure.rr_depth,
                    parameters: &parameters,
                    weights,
                };
                meter_derivatives(&loaded.groups, &loaded.meters(), &options, handle)
            }
        })
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

/// What is differentiated.
enum Work {
    /// The picture.
    Picture(PathTracer),
    /// Readings, with weights for each meter and each of its readings.
    Meters(Vec<Vec<Vec<f64>>>),
}

/// Weights of absolute readings, meter by meter, from those of the readings as they are given.
fn of_meters(
    loaded: &Loaded,
    parameters: &[RadiometricParameter],
    weights: Vec<Vec<f64>>,
) -> PyResult<Vec<Vec<Vec<f64>>>> {
    let by_emission = |p: &RadiometricParameter| matches!(p, RadiometricParameter::Emission(_));
    let per_watt = |i: &Instrument| i.normalization == Normalization::PerWatt;
    if loaded.instruments.iter().any(per_watt) && parameters.iter().any(by_emission) {
        let message = "readings per watt have no derivatives by emission: give the meter normalization=\"absolute\"";
        return Err(errors::render(message));
    }
    let channels = loaded.scene().film().channels;
    let emitted = loaded.groups.iter().enumerate().flat_map(|(group, scene)| {
        let used = scene.film().channels_of(group);
        let total = scene.powers(used).fold(Spectrum::ZERO, |sum, p| sum + p);
        total.0.into_iter().take(used)
    });
    let emitted: Vec<f64> = emitted.collect();
    let mut all = weights.into_iter();
    let meters = loaded.instruments.iter().map(|instrument| {
        let readings = instrument.meter.readings().len();
        let of_meter = all.by_ref().take(readings).map(|mut weights: Vec<f64>| {
            if per_watt(instrument) {
                let each = weights.iter_mut().enumerate();
                each.for_each(|(i, weight)| *weight /= emitted[i % channels]);
            }
            weights
        });
        of_meter.collect()
    });
    Ok(meters.collect())
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

/// The parameter of a medium, given its number.
type OfMedium = fn(usize) -> RadiometricParameter;

/// Ends of names of parameters, of media, objects and emitters.
const OF_MEDIA: [(&str, OfMedium); 5] = [
    ("sigma_t", RadiometricParameter::Extinction),
    ("albedo", RadiometricParameter::Albedo),
    ("sigma_a", RadiometricParameter::Absorption),
    ("sigma_s", RadiometricParameter::Scattering),
    ("g", RadiometricParameter::MeanCosine),
];

/// The parameter of a name such as `smoke.sigma_t`.
fn parameter(loaded: &Loaded, name: &str) -> PyResult<RadiometricParameter> {
    let (of, what) = name.rsplit_once('.').unwrap_or(("", name));
    let media = || loaded.scene().media().iter().map(|m| m.name.as_str());
    let objects = || loaded.scene().objects().iter().map(|o| o.name.as_str());
    let emitters = || loaded.emitter_names.iter().map(String::as_str);
    if let Some((_, make)) = OF_MEDIA.iter().find(|(end, _)| *end == what) {
        return Ok(make(only(media(), of, "medium")?));
    }
    match what {
        "reflectance" => Ok(RadiometricParameter::Reflectance(only(
            objects(),
            of,
            "object",
        )?)),
        "emission" => Ok(RadiometricParameter::Emission(only(
            emitters(),
            of,
            "emitter",
        )?)),
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
