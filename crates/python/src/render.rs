//! Rendered pictures.

use crate::errors;
use crate::finished::{Finished, Pickled, RunRecord};
use crate::image::exposed;
use crate::numbers::array;
use crate::scene::Scene;
use io::assemble::NamedQuantity;
use io::rendered::{Naming, Picture};
use io::report;
use numpy::{Element, PyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyType;
use serde_json::{Value, json};
use std::ops::Range;
use std::path::PathBuf;
use transport::Film;
use transport::render::Rendering;

/// A rendered picture.
#[pyclass(frozen, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Rendered(Finished<Rendering>);

impl Rendered {
    pub fn new(rendering: Rendering, scene: Py<Scene>, run: RunRecord) -> Self {
        let loaded = &scene.get().loaded;
        let told = json!({
            "scene": scene.get().name,
            "integrator": run.renderer.name(),
            "integrator_choice": run.reason,
            "seed": run.seed,
            "spp_requested": run.requested,
            "stopped": run.stopped,
            "threads": run.threads,
            "seconds": run.seconds,
        });
        let stats = report::render(loaded, &rendering, told);
        Rendered(Finished {
            result: rendering,
            scene,
            stats: stats.to_string(),
            stopped: run.stopped.map(str::to_owned),
        })
    }
}

/// Name, means, variances, and mask of unreliable variances of a layer.
type Layer<'py> = (
    String,
    Bound<'py, PyArrayDyn<f32>>,
    Bound<'py, PyArrayDyn<f32>>,
    Bound<'py, PyArrayDyn<bool>>,
);

/// Name, names of channels, means and variances of a quantity.
type Quantity<'py> = (
    String,
    Vec<String>,
    Bound<'py, PyArrayDyn<f32>>,
    Bound<'py, PyArrayDyn<f32>>,
);

/// Name, names of channels, and means of squares of a quantity.
type Moment<'py> = (String, Vec<String>, Bound<'py, PyArrayDyn<f32>>);

/// Makes an array of some channels of a film, (height, width, channels), from the values of
/// `value`.
fn planes<'py>(
    py: Python<'py>,
    film: &Film,
    channels: Range<usize>,
    value: impl Fn(usize, usize) -> f32,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let pixels = film.width() * film.height();
    let value = &value;
    let values = (0..pixels).flat_map(|i| channels.clone().map(move |c| value(c, i)));
    let shape = [film.height(), film.width(), channels.len()];
    array(py, values.collect(), &shape)
}

#[pymethods]
impl Rendered {
    /// Restores a pickled picture.
    #[new]
    fn unpickled(
        packed: &[u8],
        scene: Py<Scene>,
        stats: String,
        stopped: Option<String>,
    ) -> PyResult<Self> {
        Finished::unpickled(packed, scene, stats, stopped).map(Rendered)
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

    /// Returns means, (height, width, channels).
    fn mean<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        self.picture(py, self.film().mean())
    }

    /// Returns variances of the means, (height, width, channels).
    fn variance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        self.picture(py, self.film().variance())
    }

    /// Returns effective numbers of samples, (height, width, channels).
    fn effective<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        self.picture(py, self.film().effective(None))
    }

    /// Returns the mask of unreliable variances, (height, width, channels). It is empty for
    /// quantities other than light, which may have either sign: effective numbers do not apply to
    /// them.
    fn few<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<bool>>> {
        let mut few = self.film().few(None);
        if !self.is_light() {
            few.fill(false);
        }
        self.picture(py, few)
    }

    /// Returns true if the error of the image's mean is unreliable.
    fn mean_few(&self) -> bool {
        self.is_light() && self.film().few_in_all(None)
    }

    /// Returns true if the image shows light, false if it shows other quantities.
    fn is_light(&self) -> bool {
        self.0.scene.get().loaded.renderer.is_light()
    }

    /// Returns quantities other than light, in the image or beside it: names, names of channels,
    /// means and variances.
    fn quantities<'py>(&self, py: Python<'py>) -> PyResult<Vec<Quantity<'py>>> {
        let film = self.film_of_quantities();
        let mut first = 0;
        let named = |quantity: &NamedQuantity| {
            let channels = first..first + quantity.channels.len();
            first = channels.end;
            let mean = planes(py, film, channels.clone(), |c, i| film.mean_at(None, c, i))?;
            let variance = planes(py, film, channels, |c, i| film.variance_at(None, c, i))?;
            let (name, channels) = (quantity.name.clone(), quantity.channels.clone());
            Ok((name, channels, mean, variance))
        };
        self.names_of_quantities().iter().map(named).collect()
    }

    /// Returns second moments: names, names of channels, and values.
    fn moments<'py>(&self, py: Python<'py>) -> PyResult<Vec<Moment<'py>>> {
        let film = self.film();
        let loaded = &self.0.scene.get().loaded;
        let of_light = loaded.moment.iter().map(|name| {
            let channels = 0..film.channels();
            let values = planes(py, film, channels, |c, i| film.second_moment_at(c, i))?;
            Ok((name.clone(), loaded.channel_names.clone(), values))
        });
        let film = self.film_of_quantities();
        let mut first = 0;
        let of_quantities = self.names_of_quantities().iter().filter_map(|quantity| {
            let channels = first..first + quantity.channels.len();
            first = channels.end;
            quantity.squared.then(|| {
                let values = planes(py, film, channels, |c, i| film.second_moment_at(c, i))?;
                let name = format!("m2_{}", quantity.name);
                Ok((name, quantity.channels.clone(), values))
            })
        });
        of_light.chain(of_quantities).collect()
    }

    /// Returns means with reduced weight of rare bright samples, if the film requests them.
    fn reweighted<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        let values = self.film().reweighted();
        values.map(|v| self.picture(py, v)).transpose()
    }

    /// Returns numbers of samples, (height, width).
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u64>>> {
        let film = self.film();
        array(py, film.counts(), &[film.height(), film.width()])
    }

    /// Writes the picture. A PNG file is brightened by `exposure` stops, by default by an automatic
    /// number.
    fn write(&self, py: Python<'_>, path: PathBuf, exposure: Option<f64>) -> PyResult<()> {
        let exposure = exposed(exposure);
        let written = py.detach(|| {
            let picture = self.picture_with_layers();
            picture.write_exposed(&path, exposure)
        });
        written.map_err(|e| errors::file(&e))
    }

    /// Returns separate layers of light, by names with means, variances and flags, and their axes
    /// as JSON.
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<(Vec<Layer<'py>>, String)> {
        let Some(naming) = Naming::of(&self.0.scene.get().loaded) else {
            return Ok((Vec::new(), "[]".into()));
        };
        let film = self.film();
        let layer = |(i, name)| {
            let mean = self.picture(py, film.layer_mean(i))?;
            let variance = self.picture(py, film.layer_variance(i))?;
            let few = if naming.is_of_one_sign(i) {
                film.few(Some(i))
            } else {
                vec![false; film.width() * film.height() * film.channels()]
            };
            Ok((name, mean, variance, self.picture(py, few)?))
        };
        let layers: PyResult<Vec<_>> = naming.names().enumerate().map(layer).collect();
        Ok((layers?, Value::from(naming.axes()).to_string()))
    }

    /// Returns the mean of the image and its standard error.
    fn summary(&self) -> (f64, f64) {
        self.film().summary()
    }
}

impl Rendered {
    fn film(&self) -> &Film {
        &self.0.result.film
    }

    /// Returns the film of quantities other than light.
    fn film_of_quantities(&self) -> &Film {
        let quantities = self.0.result.quantities.as_ref();
        quantities.map_or(self.film(), |quantities| &quantities.film)
    }

    /// Returns the names of the quantities other than light; empty if there are none.
    fn names_of_quantities(&self) -> &[NamedQuantity] {
        &self.0.scene.get().loaded.quantity_names
    }

    /// Returns the picture with all layers, as the program writes it.
    fn picture_with_layers(&self) -> Picture<'_> {
        let loaded = &self.0.scene.get().loaded;
        let stats: Value = serde_json::from_str(&self.0.stats).unwrap_or_default();
        let text = |name: &str| match &stats[name] {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let known = [
            "scene",
            "scene_hash",
            "integrator",
            "seed",
            "spp",
            "branches",
            "connections",
            "trust",
        ];
        let mut attributes: Vec<_> = known.map(|name| (name.to_owned(), text(name))).into();
        let counts = &self.0.result.stats;
        attributes.push(("lost".into(), counts.lost.to_string()));
        let over = report::over_budget(counts).to_string();
        attributes.push(("over_budget".into(), over));
        attributes.push(("not_finite".into(), counts.not_finite.to_string()));
        attributes.push(("morgana_version".into(), env!("CARGO_PKG_VERSION").into()));
        if let Some(naming) = Naming::of(loaded) {
            attributes.push((
                "decomposition".into(),
                Value::from(naming.axes()).to_string(),
            ));
        }
        Picture::new(&self.0.result, loaded, attributes)
    }

    fn picture<'py, T: Element>(
        &self,
        py: Python<'py>,
        values: Vec<T>,
    ) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
        let film = self.film();
        array(py, values, &[film.height(), film.width(), film.channels()])
    }
}
