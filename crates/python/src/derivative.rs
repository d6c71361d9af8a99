//! Derivatives of pictures and of readings by parameters of their scenes.

use crate::errors;
use crate::limits::Limits;
use crate::numbers::array;
use crate::scene::Scene;
use crate::watch::watched;
use io::Loaded;
use io::arrays::is_phase;
use io::assemble::{Instrument, Normalization};
use numpy::{PyArrayDyn, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use transport::Spectrum;
use transport::bsdf::Tint;
use transport::derivative::{DerivativeError, RadiometricParameter};
use transport::emitter::Emitter;
use transport::film::{Decomposition, LightParts};
use transport::integrator::{Integrator, PathTracer};
use transport::render::{
    DerivativeOptions, Derivatives, Handle, MeterDerivativeOptions, ReadingFunctional,
    check_parameters, derivatives, meter_derivatives,
};

/// Arrays of values and of their standard errors.
pub(crate) type Doubles<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

/// Dictionary of the parameters of the derivatives, and of the integrator.
#[derive(Clone, Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub struct By {
    /// Names of parameters.
    parameters: Vec<String>,
    /// Name of an integrator instead of the scene's.
    integrator: Option<String>,
}

impl By {
    fn parameters(&self, loaded: &Loaded) -> PyResult<Vec<RadiometricParameter>> {
        let parameters = self.parameters.iter();
        parameters.map(|name| parameter(loaded, name)).collect()
    }

    /// Returns the integrator that computes the light of a picture.
    fn integrator(&self, limits: &Limits, loaded: &Loaded) -> PyResult<Integrator> {
        let run = limits.run_by(loaded, self.integrator.as_deref())?;
        run.renderer.integrator().copied().ok_or_else(|| {
            errors::render(format!(
                "derivatives exist only for light, not for {}: use integrator=\"path\"",
                run.renderer.name()
            ))
        })
    }
}

/// Checks, before any rendering, that light has derivatives by the parameters.
#[pyfunction]
pub fn check_derivatives(scene: Py<Scene>, limits: Limits, by: By) -> PyResult<()> {
    let loaded = &scene.get().loaded;
    let parameters = by.parameters(loaded)?;
    let integrator = if loaded.instruments.is_empty() {
        Some(by.integrator(&limits, loaded)?)
    } else {
        None
    };
    check_parameters(&loaded.groups, &parameters, integrator).map_err(|e| refused(loaded, &e))
}

/// Computes derivatives of Σ weights × picture, or × readings, by parameters.
///
/// For a picture, `weights` has one array: for the picture, or, if `layered`, for all its layers in
/// sequence. For meters, `weights` has one array per reading, empty for readings without weights.
#[pyfunction]
pub fn differentiate<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    by: By,
    weights: Vec<PyReadonlyArray1<'py, f64>>,
    layered: bool,
    tick: Option<Py<PyAny>>,
) -> PyResult<Vec<Doubles<'py>>> {
    let loaded = &scene.get().loaded;
    let parameters = by.parameters(loaded)?;
    let weights = weights.iter().map(|array| Ok(array.as_slice()?.to_vec()));
    let weights: Vec<Vec<f64>> = weights.collect::<PyResult<_>>()?;
    let work = if loaded.instruments.is_empty() {
        Work::Picture(by.integrator(&limits, loaded)?)
    } else {
        Work::Meters(of_meters(loaded, &parameters, weights.clone())?)
    };
    let found = watched_derivatives(py, (loaded, &limits), tick.as_ref(), |handle| match &work {
        Work::Picture(integrator) => {
            let mut decomposition = loaded.layering.decomposition;
            if !layered {
                // Select the whole picture. For polarised light, this keeps the Stokes parameters.
                let parts = decomposition.parts.filter(|p| *p == LightParts::Stokes);
                decomposition = Decomposition {
                    parts,
                    ..Decomposition::default()
                };
            }
            let options = DerivativeOptions {
                integrator: *integrator,
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
            let of = ReadingFunctional::Weighted(weights);
            of_readings(loaded, &limits, &parameters, of, handle)
        }
    })?;
    arrays(py, found)
}

/// Computes derivatives of each bin of a reading by parameters. Axes come from the reading, from
/// the parameter, and then from channels. Readings are numbered over all meters.
#[pyfunction]
pub fn jacobian<'py>(
    py: Python<'py>,
    scene: Py<Scene>,
    limits: Limits,
    by: By,
    reading: usize,
    tick: Option<Py<PyAny>>,
) -> PyResult<Vec<Doubles<'py>>> {
    let loaded = &scene.get().loaded;
    let parameters = by.parameters(loaded)?;
    let meters = loaded.instruments.iter().enumerate();
    let mut all = meters.flat_map(|(i, of)| Given::all(of).map(move |given| (i, given)));
    let (meter, given) = all
        .nth(reading)
        .ok_or_else(|| errors::render(DerivativeError::Reading.to_string()))?;
    let scale = given.scale(loaded, &parameters)?;
    let reading = given.reading;
    let of = ReadingFunctional::Each { meter, reading };
    let mut found = watched_derivatives(py, (loaded, &limits), tick.as_ref(), |handle| {
        of_readings(loaded, &limits, &parameters, of, handle)
    })?;
    for derivative in &mut found.by {
        let channels = scale.len();
        let both = [&mut derivative.values, &mut derivative.errors];
        for (i, value) in both.into_iter().flat_map(|v| v.iter_mut().enumerate()) {
            *value *= scale[i % channels];
        }
    }
    arrays(py, found)
}

/// Computes derivatives on a pool of threads, while checking Python's signals for an interruption.
fn watched_derivatives(
    py: Python<'_>,
    (loaded, limits): (&Loaded, &Limits),
    tick: Option<&Py<PyAny>>,
    take: impl Fn(&Handle) -> Result<Option<Derivatives>, DerivativeError> + Send + Sync,
) -> PyResult<Derivatives> {
    let pool = limits.pool()?;
    let (found, interrupted) = watched(py, tick, None, |shared| {
        pool.install(|| take(&shared.handle))
    })?;
    let found = found
        .map_err(|e| refused(loaded, &e))?
        .filter(|_| !interrupted);
    found.ok_or_else(|| PyKeyboardInterrupt::new_err(()))
}

/// Computes derivatives of readings by particles as in a measurement of the scene.
fn of_readings(
    loaded: &Loaded,
    limits: &Limits,
    parameters: &[RadiometricParameter],
    of: ReadingFunctional,
    handle: &Handle,
) -> Result<Option<Derivatives>, DerivativeError> {
    let measure = limits.run(loaded).measure_options();
    let options = MeterDerivativeOptions {
        particles: limits.samples.unwrap_or(loaded.samples),
        seed: limits.seed,
        max_depth: measure.max_depth,
        rr_depth: measure.rr_depth,
        parameters,
        of,
    };
    meter_derivatives(&loaded.groups, &loaded.meters(), &options, handle)
}

/// Converts values and errors to arrays.
fn arrays(py: Python<'_>, found: Derivatives) -> PyResult<Vec<Doubles<'_>>> {
    let both = found.by.into_iter().map(|derivative| {
        let shape = &derivative.shape;
        Ok((
            array(py, derivative.values, shape)?,
            array(py, derivative.errors, shape)?,
        ))
    });
    both.collect()
}

/// Quantity to differentiate.
enum Work {
    /// The picture.
    Picture(Integrator),
    /// Readings, with the weights of each reading of each meter.
    Meters(Vec<Vec<Vec<f64>>>),
}

/// Converts weights of readings to weights of absolute readings, meter by meter, from the weights
/// of readings as the user sees them.
fn of_meters(
    loaded: &Loaded,
    parameters: &[RadiometricParameter],
    weights: Vec<Vec<f64>>,
) -> PyResult<Vec<Vec<Vec<f64>>>> {
    let mut all = weights.into_iter();
    let meters = loaded.instruments.iter().map(|instrument| {
        let mut of_meter = vec![Vec::new(); instrument.meter.readings().len()];
        for (given, weights) in Given::all(instrument).zip(all.by_ref()) {
            if weights.is_empty() {
                continue;
            }
            let scale = given.scale(loaded, parameters)?;
            let absolute: &mut Vec<f64> = &mut of_meter[given.reading];
            absolute.resize(weights.len(), 0.0);
            let each = absolute.iter_mut().zip(weights).enumerate();
            each.for_each(|(i, (sum, weight))| *sum += weight * scale[i % scale.len()]);
        }
        Ok(of_meter)
    });
    meters.collect()
}

/// Reading as the user sees it: an absolute reading of its meter, times a factor.
struct Given {
    /// Number of the absolute reading.
    reading: usize,
    factor: f64,
    /// Subject of the message if the reading is given per emitted watt. It then has no derivatives
    /// by parameters that change the power of emitters.
    per_emitted: Option<&'static str>,
}

impl Given {
    /// Yields the readings of a meter, in the order of `Scene::_readings`.
    fn all(instrument: &Instrument) -> impl Iterator<Item = Given> {
        let per_watt = instrument.normalization == Normalization::PerWatt;
        let per_emitted = per_watt.then_some("readings per watt have");
        let readings = instrument.meter.readings().into_iter().enumerate();
        let measured = readings.map(move |(reading, (name, _))| Given {
            reading,
            factor: 1.0,
            per_emitted: per_emitted.filter(|_| !is_phase(name)),
        });
        let pressure = instrument.gruneisen.map(|gruneisen| Given {
            reading: Instrument::ABSORBED,
            factor: gruneisen.factor(),
            per_emitted: Some("the pressure p0, which a pulse of given energy causes, has"),
        });
        measured.chain(pressure)
    }

    /// Returns the factor on the absolute reading in each channel.
    fn scale(&self, loaded: &Loaded, parameters: &[RadiometricParameter]) -> PyResult<Vec<f64>> {
        let Some(what) = self.per_emitted else {
            return Ok(vec![self.factor; loaded.scene().film().channels]);
        };
        if parameters.iter().any(|p| changes_power(loaded, p)) {
            return Err(errors::render(format!(
                "{what} no derivatives by emission, or by the absorption of media that emit: take a reading of a meter with \
                 normalization=\"absolute\""
            )));
        }
        Ok(reciprocals_of_power(loaded)
            .map(|per| self.factor * per)
            .collect())
    }
}

/// Yields 1/emitted power of each channel; 0 without any power.
fn reciprocals_of_power(loaded: &Loaded) -> impl Iterator<Item = f64> {
    let emitted = loaded.groups.iter().enumerate().flat_map(|(group, scene)| {
        let used = scene.film().channels_of(group);
        let total = scene.powers(used).fold(Spectrum::ZERO, |sum, p| sum + p);
        total.0.into_iter().take(used)
    });
    emitted.map(|power| if power > 0.0 { 1.0 / power } else { 0.0 })
}

/// Returns true if the emitted power depends on a parameter.
fn changes_power(loaded: &Loaded, parameter: &RadiometricParameter) -> bool {
    let emits = |id: usize| {
        let mut emitters = loaded.scene().emitters().iter();
        emitters.any(|e| matches!(e, Emitter::Volume(volume) if volume.medium() == Some(id)))
    };
    match *parameter {
        RadiometricParameter::Emission(_) | RadiometricParameter::Radiance(_) => true,
        RadiometricParameter::Extinction(id)
        | RadiometricParameter::Albedo(id)
        | RadiometricParameter::Absorption(id) => emits(id),
        RadiometricParameter::VoxelAbsorption(id) => emits(id),
        RadiometricParameter::VoxelScattering(_)
        | RadiometricParameter::Scattering(_)
        | RadiometricParameter::MeanCosine(_)
        | RadiometricParameter::Colour(..)
        | RadiometricParameter::Exposure => false,
    }
}

/// Returns a path tracer with the depths of the scene's own integrator.
pub(crate) fn path(loaded: &Loaded) -> PyResult<PathTracer> {
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
            "derivatives by an index need light without blur, from the integrator path, not {}: load the scene with integrator=\"path\"",
            loaded.renderer.name()
        ))),
    }
}

fn refused(loaded: &Loaded, error: &DerivativeError) -> PyErr {
    match *error {
        DerivativeError::Memory(_) => PyMemoryError::new_err(error.to_string()),
        DerivativeError::Dim(i) | DerivativeError::Radiance(i) => {
            errors::render(format!("'{}': {error}", loaded.emitter_names[i]))
        }
        _ => errors::render(error.to_string()),
    }
}

/// Constructor of the parameter of a medium, given the number of the medium.
type OfMedium = fn(usize) -> RadiometricParameter;

/// Suffixes of the names of parameters of media.
const OF_MEDIA: [(&str, OfMedium); 5] = [
    ("sigma_t", RadiometricParameter::Extinction),
    ("albedo", RadiometricParameter::Albedo),
    ("sigma_a", RadiometricParameter::Absorption),
    ("sigma_s", RadiometricParameter::Scattering),
    ("g", RadiometricParameter::MeanCosine),
];

/// End of the name of a medium of labels whose voxels have a number each.
const VOXELS: &str = ".voxels";

/// Returns the parameter with a name such as `smoke.sigma_t`.
fn parameter(loaded: &Loaded, name: &str) -> PyResult<RadiometricParameter> {
    let (of, what) = name.rsplit_once('.').unwrap_or(("", name));
    let media = || loaded.scene().media().iter().map(|m| m.name.as_str());
    let objects = || loaded.scene().objects().iter().map(|o| o.name.as_str());
    let emitters = || loaded.emitter_names.iter().map(String::as_str);
    if let Some(medium) = of.strip_suffix(VOXELS) {
        let medium = only(media(), medium, "medium")?;
        let parameter = match what {
            "sigma_a" => Some(RadiometricParameter::VoxelAbsorption(medium)),
            "sigma_s" => Some(RadiometricParameter::VoxelScattering(medium)),
            _ => None,
        };
        return parameter.ok_or_else(|| {
            let message = format!("no parameter '{name}': voxels have sigma_a and sigma_s");
            errors::render(message)
        });
    }
    if let Some((_, make)) = OF_MEDIA.iter().find(|(end, _)| *end == what) {
        return Ok(make(only(media(), of, "medium")?));
    }
    if let Some(tint) = Tint::ALL.into_iter().find(|tint| tint.name() == what) {
        let object = only(objects(), of, "object")?;
        return Ok(RadiometricParameter::Colour(object, tint));
    }
    match what {
        "emission" => Ok(RadiometricParameter::Emission(only(
            emitters(),
            of,
            "emitter",
        )?)),
        "radiance" => Ok(RadiometricParameter::Radiance(only(
            emitters(),
            of,
            "emitter",
        )?)),
        "exposure" if of.is_empty() => Ok(RadiometricParameter::Exposure),
        _ => Err(errors::render(format!(
            "no parameter '{name}': parameters are MEDIUM.sigma_t, .albedo, .sigma_a, .sigma_s, .g and .ior, OBJECT.reflectance, .diffuse_reflectance, \
              .specular_reflectance, .specular_transmittance, .transmittance and .base_color, EMITTER.emission and .radiance, and exposure"
        ))),
    }
}

/// Returns the number of the only item with a name.
pub(crate) fn only<'a>(
    mut names: impl Iterator<Item = &'a str> + Clone,
    name: &str,
    what: &str,
) -> PyResult<usize> {
    let all = names.clone();
    let count = all.clone().filter(|known| *known == name).count();
    if count > 1 {
        let message = format!("{count} {what}s have the name '{name}': give each its own id");
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
