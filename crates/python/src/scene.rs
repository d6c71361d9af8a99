//! Scenes.

use crate::dict;
use crate::errors;
use crate::field::Field;
use crate::watch;
use io::arrays::NUMBERED;
use io::assemble::Instrument;
use io::diagnostic::lints;
use io::features::Features;
use io::parameters::{ParameterValue, parameters};
use io::rendered::Naming;
use io::scene::Value;
use io::{Diagnostics, Limits, LoadOptions, Loaded, SceneDescription, WriteError, json};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use transport::meter::ReadingAxis;

/// Function and arguments with which Python recreates a pickled object.
pub type Recipe<'py> = (Bound<'py, PyAny>, Py<PyAny>);

/// Name of an axis of a reading, its number of bins, and their edges.
type AxisOfReading = (String, usize, Option<Vec<f64>>, Option<Vec<f64>>);

/// Maximum size of all arrays in a description, in bytes, up to which a scene keeps its description
/// for changes. Larger arrays would double the memory of the scene.
pub const MAX_KEPT: usize = 256 << 20;

/// An immutable scene, ready to render.
///
/// Made by ``morgana.load_file`` or ``morgana.load_dict``. Scenes can be pickled, hashed, and
/// compared with ``==``: equal scenes have equal descriptions and data, and render in the same way.
#[pyclass(frozen, module = "morgana")]
#[derive(Debug)]
pub struct Scene {
    /// The loaded scene, with everything known about it.
    pub loaded: Loaded,
    /// Name in outputs, a str: the name of the scene's file, or ``dict``.
    #[pyo3(get)]
    pub name: String,
    /// Description of the scene, for changes of parameters, unless it is too large.
    pub description: Option<SceneDescription>,
    /// Data for recreating the scene: ``"file"`` or ``"dict"``, the path of the file or the
    /// dictionary, parameters, and replaced settings. For a scene with other values of parameters:
    /// ``"changed"``, the recipe of the scene before, the values, and replaced settings.
    pub recipe: Py<PyAny>,
}

/// Settings that replace settings of a scene.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Overrides {
    integrator: Option<String>,
    sampler: Option<String>,
    adaptive: bool,
    undisturbed: bool,
    silence: Vec<String>,
    memory: Option<u64>,
}

impl Overrides {
    /// Returns the settings as options of loading.
    pub fn options(self) -> PyResult<LoadOptions> {
        let silenced = self.silence.iter().map(|name| lints::named(name));
        let silenced = silenced
            .collect::<Result<_, _>>()
            .map_err(PyValueError::new_err)?;
        Ok(LoadOptions {
            silenced,
            integrator: self.integrator,
            sampler: self.sampler,
            adaptive: self.adaptive,
            undisturbed: self.undisturbed,
            limits: Limits {
                memory: self.memory,
            },
            keeps_parts: true,
            ..LoadOptions::default()
        })
    }
}

/// Reads a scene file.
#[pyfunction]
pub fn load_file(
    py: Python<'_>,
    path: PathBuf,
    defines: Vec<(String, String)>,
    instead: Bound<'_, PyAny>,
) -> PyResult<Scene> {
    let source = std::path::absolute(&path)?;
    let recipe = ("file", source, defines.clone(), instead.clone()).into_py_any(py)?;
    let options = LoadOptions {
        defines,
        ..instead.extract::<Overrides>()?.options()?
    };
    let name = path.file_name().unwrap_or(path.as_os_str()).to_owned();
    let loading = options.loading.clone();
    let loaded = watch::loaded(py, &loading, move || {
        let (loaded, description) = io::load_described_scene(&path, &options)?;
        Ok((loaded, kept(description)))
    })?;
    let (loaded, description) = loaded.map_err(|d: Diagnostics| errors::scene(&d))?;
    Ok(Scene {
        loaded,
        description,
        name: name.to_string_lossy().into_owned(),
        recipe,
    })
}

/// Reads a scene from a dictionary.
#[pyfunction]
pub fn load_dict(
    py: Python<'_>,
    scene: &Bound<'_, PyDict>,
    defines: Vec<(String, String)>,
    instead: Bound<'_, PyAny>,
) -> PyResult<Scene> {
    let recipe = ("dict", scene.clone(), defines.clone(), instead.clone()).into_py_any(py)?;
    let item = dict::scene(scene)?;
    let options = instead.extract::<Overrides>()?.options()?;
    let loading = options.loading.clone();
    let loaded = watch::loaded(py, &loading, move || {
        let mut diagnostics = Diagnostics::new();
        match json::build(item, &defines, options.limits, &mut diagnostics) {
            Some(description) => {
                let loaded = io::assemble(&description, &options, diagnostics)?;
                Ok((loaded, kept(description)))
            }
            None => Err(diagnostics),
        }
    })?;
    let (loaded, description) = loaded.map_err(|d: Diagnostics| errors::scene(&d))?;
    Ok(Scene {
        loaded,
        description,
        name: "dict".into(),
        recipe,
    })
}

/// Writes the scene of a file to another file. Returns the features that Mitsuba 3 does not have.
#[pyfunction]
pub fn export_file(
    py: Python<'_>,
    path: PathBuf,
    defines: Vec<(String, String)>,
    output: PathBuf,
) -> PyResult<Vec<String>> {
    py.detach(|| {
        let mut diagnostics = Diagnostics::new();
        let scene = io::read_scene(&path, &defines, Limits::default(), &mut diagnostics);
        export(scene, &diagnostics, &output)
    })
}

/// Writes the scene of a dictionary to a file. Returns the features that Mitsuba 3 does not have.
#[pyfunction]
pub fn export_dict(
    py: Python<'_>,
    scene: &Bound<'_, PyDict>,
    defines: Vec<(String, String)>,
    output: PathBuf,
) -> PyResult<Vec<String>> {
    let item = dict::scene(scene)?;
    py.detach(|| {
        let mut diagnostics = Diagnostics::new();
        let scene = json::build(item, &defines, Limits::default(), &mut diagnostics);
        export(scene, &diagnostics, &output)
    })
}

fn export(
    scene: Option<SceneDescription>,
    diagnostics: &Diagnostics,
    output: &Path,
) -> PyResult<Vec<String>> {
    let scene = scene.ok_or_else(|| errors::scene(diagnostics))?;
    io::write_scene(&scene, output).map_err(|error| match error {
        WriteError::File(error) => errors::file(&error),
        _ => PyValueError::new_err(error.to_string()),
    })?;
    Ok(Features::of(&scene).own)
}

#[pymethods]
impl Scene {
    /// Width and height of the picture in pixels, two ints.
    #[getter]
    fn size(&self) -> (usize, usize) {
        let film = self.loaded.scene().film();
        (film.width, film.height)
    }

    /// Names of the channels, a list of str.
    ///
    /// They are ``R``, ``G``, ``B``, or ``Y``, or wavelengths in nm, or quantities.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.loaded.channel_names.clone()
    }

    /// Name of the integrator, a str.
    ///
    /// It is ``auto``, ``path``, ``particle``, ``bdpt``, ``vcm``, ``photon``, ``sppm``, ``preview`` or ``aov``.
    #[getter]
    fn integrator(&self) -> &'static str {
        self.loaded.integrator()
    }

    /// Samples per pixel, an int; particles if there are meters.
    #[getter]
    fn spp(&self) -> u64 {
        self.loaded.samples
    }

    /// Hash of the description and of all data, a str of hexadecimal digits.
    #[getter]
    fn hash(&self) -> String {
        self.loaded.hash.to_string()
    }

    /// Returns the number of samples closest to `samples` that is equal for all instants of a
    /// period of sound.
    fn _whole_periods(&self, samples: u64) -> u64 {
        let replicates = self.loaded.replicates(samples);
        self.loaded.scene().whole_periods(samples, replicates)
    }

    /// Returns warnings about rendering with another integrator.
    fn _doubts<'py>(&self, py: Python<'py>, integrator: &str) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let estimator = self.loaded.renderer_named(integrator);
        let named = estimator.map_err(|d| errors::scene(&d))?;
        errors::diagnostics(py, &named.warnings)
    }

    /// Names of all layers of the picture, in the order of the film.
    #[getter]
    fn _layers(&self) -> Vec<String> {
        Naming::of(&self.loaded).map_or(Vec::new(), |naming| naming.names().collect())
    }

    /// Names of all readings of the meters, and their axes, each with its number of bins, with
    /// their edges if they have positions, and with the coordinates of their items if they have
    /// these instead.
    #[getter]
    fn _readings(&self) -> Vec<(String, Vec<AxisOfReading>)> {
        let (instruments, channels) = (&self.loaded.instruments, self.loaded.channel_names.len());
        let of = |instrument: &Instrument| {
            let frequencies = instrument.meter.frequency_domain();
            let frequencies = frequencies.map(|domain| domain.hertz().to_vec());
            let axis = move |axis: &ReadingAxis| {
                let has_positions = !NUMBERED.contains(&&*axis.name);
                let edges = has_positions.then(|| axis.edges.clone());
                let items = frequencies.clone().filter(|_| axis.name == "frequency");
                (axis.name.to_string(), axis.len(), edges, items)
            };
            let prefix = match instruments.len() {
                1 => String::new(),
                _ => format!("{}.", instrument.name),
            };
            let named = move |(name, axes): (&str, Vec<ReadingAxis>)| {
                let mut axes: Vec<_> = axes.iter().map(&axis).collect();
                axes.extend((channels > 1).then(|| ("channel".to_owned(), channels, None, None)));
                (format!("{prefix}{name}"), axes)
            };
            let mut readings = instrument.meter.readings();
            let absorbed = instrument
                .gruneisen
                .map(|_| readings[Instrument::ABSORBED].1.clone());
            readings.extend(absorbed.map(|axes| ("p0", axes)));
            readings.into_iter().map(named)
        };
        instruments.iter().flat_map(of).collect()
    }

    /// Names of the emitters, a list of str.
    #[getter]
    fn emitters(&self) -> Vec<String> {
        self.loaded.emitter_names.clone()
    }

    /// Names of the meters, a list of str. A scene with meters has no picture.
    #[getter]
    fn meters(&self) -> Vec<String> {
        let instruments = self.loaded.instruments.iter();
        instruments.map(|i| i.name.clone()).collect()
    }

    /// Return the parameters of the scene by name.
    ///
    /// Assign values, then call :meth:`Parameters.update` for the scene with these values.
    ///
    /// Returns
    /// -------
    /// Parameters
    ///     A mapping from names such as ``ball.radius`` to values.
    fn parameters<'py>(slf: Py<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let module = py.import("morgana._parameters")?;
        module.call_method1("parameters", (slf,))
    }

    /// Warnings about the scene, a list of ``Diagnostic``.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        errors::diagnostics(py, &self.loaded.warnings)
    }

    /// Differences from a render by Mitsuba (docs/mitsuba.md), a list of ``Diagnostic``.
    #[getter]
    fn differences<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        errors::diagnostics(py, &self.loaded.notes_of_differences())
    }

    /// Refractive indices of the media by their names, a dict of ``Field``.
    ///
    /// If several media have a name, a number is appended to it, as in ``fog_2``. ``ambient`` is
    /// the medium around everything.
    #[getter]
    fn fields<'py>(slf: Py<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let fields = PyDict::new(py);
        for (i, medium) in slf.get().loaded.scene().media().iter().enumerate() {
            let mut name = medium.name.clone();
            for number in 2.. {
                if !fields.contains(&name)? {
                    break;
                }
                name = format!("{}_{number}", medium.name);
            }
            fields.set_item(&name, Field::of_medium(slf.clone_ref(py), i, name.clone()))?;
        }
        let named = py.import("morgana._values")?.getattr("Named")?;
        named.call1(("field", fields))
    }

    fn __repr__(&self) -> String {
        format!("<morgana.Scene {}>", self.lines().join(", "))
    }

    fn __eq__(&self, other: &Scene) -> bool {
        self.is_same(other)
    }

    fn __hash__(&self) -> u64 {
        let bytes = self.loaded.hash.bytes();
        bytes[..8]
            .iter()
            .fold(0, |hash, byte| hash << 8 | u64::from(*byte))
    }

    /// Pickles the data from which the scene was made, and the function that recreates it.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Recipe<'py>> {
        let remake = py.import("morgana._scene")?.getattr("remake")?;
        let arguments = (self.recipe.clone_ref(py), self.hash());
        Ok((remake, arguments.into_py_any(py)?))
    }

    fn _repr_html_(&self) -> String {
        let rows = self.lines().into_iter().map(|line| {
            let line = line.replace('&', "&amp;").replace('<', "&lt;");
            format!("<li>{line}</li>")
        });
        format!("<ul>{}</ul>", rows.collect::<String>())
    }

    /// Counted samples per sample per pixel: pixels times groups of channels.
    #[getter]
    fn _samples_per_spp(&self) -> usize {
        let film = self.loaded.scene().film();
        let pixels = if self.loaded.instruments.is_empty() {
            film.width * film.height
        } else {
            1
        };
        pixels * self.loaded.groups.len()
    }
}

impl Scene {
    /// True if both scenes have equal descriptions and data, and render in the same way.
    pub fn is_same(&self, other: &Scene) -> bool {
        let method = |l: &Loaded| (l.renderer, l.integrator(), l.samples, l.adaptive, l.sampler);
        self.loaded.hash == other.loaded.hash && method(&self.loaded) == method(&other.loaded)
    }

    /// Returns short descriptions of the scene's properties.
    fn lines(&self) -> Vec<String> {
        let loaded = &self.loaded;
        let media = loaded.scene().media().iter().map(|m| m.name.as_str());
        let mut lines = vec![self.name.clone()];
        match &self.meters()[..] {
            [] => {
                let (width, height) = self.size();
                let channels = loaded.channel_names.len();
                lines.push(format!("{width} × {height} × {channels}"));
                lines.push(format!("{}, {} spp", self.integrator(), self.spp()));
            }
            meters => {
                lines.push(format!("meters: {}", meters.join(" ")));
                lines.push(format!("{} particles", self.spp()));
            }
        }
        lines.push(format!("media: {}", media.collect::<Vec<_>>().join(" ")));
        lines.push(format!("emitters: {}", loaded.emitter_names.join(" ")));
        lines
    }
}

/// Returns a description if its arrays are small enough to be kept.
pub fn kept(description: SceneDescription) -> Option<SceneDescription> {
    let each = parameters(&description).into_iter();
    let size = |value: Option<ParameterValue>| match value {
        Some(ParameterValue::Given(Value::Tensor(tensor))) => tensor.len() * size_of::<f64>(),
        _ => 0,
    };
    let all: usize = each.map(|parameter| size(parameter.value)).sum();
    (all <= MAX_KEPT).then_some(description)
}
