//! Refractive-index fields, evaluated at many points.

use crate::numbers::{Rows, array, ask_for_memory};
use crate::scene::{Recipe, Scene};
use crate::{dict, errors, watch};
use eikonal::{Aabb, Field as Index};
use glam::{DMat3, DVec3};
use io::json::Item;
use io::loading::Loading;
use io::scene::SceneHash;
use io::{Diagnostics, Limits, json};
use numpy::PyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

/// The refractive index of a medium as a function of position.
///
/// Obtained from ``Scene.fields`` or ``morgana.load_field``. Fields can be pickled, and compared
/// with ``==``.
#[pyclass(frozen, module = "morgana")]
#[derive(Debug)]
pub struct Field {
    source: Source,
    /// Name of the medium, a str; empty for a field without a scene.
    #[pyo3(get)]
    name: String,
    /// Warnings about a field without a scene. Scenes have their own warnings.
    warnings: Diagnostics,
}

#[derive(Debug)]
enum Source {
    /// Field of a medium of a scene, by number.
    Medium(Py<Scene>, usize),
    /// Field from a dictionary, and perhaps for a wavelength in nm, with the hash of both and of
    /// all data.
    Own(Box<Index>, (Py<PyDict>, Option<f64>), SceneHash),
}

/// Makes a field from a dictionary that describes a volume, for a wavelength in nm if the index
/// depends on it.
#[pyfunction]
#[pyo3(signature = (volume, wavelength=None))]
pub fn load_field(
    py: Python<'_>,
    volume: &Bound<'_, PyDict>,
    wavelength: Option<f64>,
) -> PyResult<Field> {
    let recipe = (volume.clone().unbind(), wavelength);
    let volume = dict::item(volume, "scene[\"volume\"]")?;
    let scene = object("scene", [Some(("volume", volume)), wavelength.map(sensor)]);
    let index = watch::loaded(py, &Loading::default(), move || {
        let mut diagnostics = Diagnostics::new();
        match json::build(scene, &[], Limits::default(), &mut diagnostics) {
            Some(description) => io::assemble_field(&description, diagnostics),
            None => Err(diagnostics),
        }
    })?;
    let made = index.map_err(|d| errors::scene(&d))?;
    Ok(Field {
        source: Source::Own(Box::new(made.field), recipe, made.hash),
        name: String::new(),
        warnings: made.warnings,
    })
}

/// An object of a description.
fn object<const N: usize>(kind: &str, items: [Option<(&str, Item)>; N]) -> Item {
    let kind = ("type", Item::String(kind.to_owned()));
    let all = [kind].into_iter().chain(items.into_iter().flatten());
    Item::Object(all.map(|(key, item)| (key.to_owned(), item)).collect())
}

/// Returns the sensor of a scene with a single wavelength in nm.
fn sensor(wavelength: f64) -> (&'static str, Item) {
    let text = |name, text: String| Some((name, Item::String(text)));
    let film = object(
        "hdrfilm",
        [
            text("pixel_format", "spectral".to_owned()),
            text("wavelengths", wavelength.to_string()),
        ],
    );
    ("sensor", object("perspective", [Some(("film", film))]))
}

impl Field {
    /// Makes the field of a medium of a scene, by number.
    pub fn of_medium(scene: Py<Scene>, medium: usize, name: String) -> Self {
        let source = Source::Medium(scene, medium);
        Field {
            source,
            name,
            warnings: Diagnostics::new(),
        }
    }

    /// Returns the renderer's field.
    pub fn index(&self) -> &Index {
        match &self.source {
            Source::Medium(scene, medium) => &scene.get().loaded.scene().media()[*medium].index,
            Source::Own(index, ..) => index,
        }
    }

    /// Computes `N` numbers for each point, on all CPU cores; NaN for points that are not finite.
    fn map<'py, const N: usize>(
        &self,
        py: Python<'py>,
        points: Rows,
        of: impl Fn(&Index, DVec3) -> [f64; N] + Sync,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        ask_for_memory(points.rows.len(), size_of::<[f64; N]>(), "points")?;
        let field = self.index();
        let at = |x: &DVec3| {
            if x.is_finite() {
                of(field, *x)
            } else {
                [f64::NAN; N]
            }
        };
        let values: Vec<[f64; N]> = py.detach(|| points.rows.par_iter().map(at).collect());
        let shape: Vec<usize> = points.outer.iter().chain(shape).copied().collect();
        array(py, values.into_flattened(), &shape)
    }
}

#[pymethods]
impl Field {
    /// Warnings about a field without a scene.
    #[getter]
    fn _warnings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        errors::diagnostics(py, &self.warnings)
    }

    /// Evaluate the refractive index n.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, (..., 3)
    ///     Positions, in scene units; any strides and any real type of numbers.
    ///
    /// Returns
    /// -------
    /// ndarray, (...)
    ///     Values of n. NaN where a formula has no real index, and where points are not finite.
    ///     Outside its samples, a sampled field approaches a constant
    ///     (docs/scene/volumes.md).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     An array of another shape, or a masked array with hidden elements.
    ///
    /// Examples
    /// --------
    /// >>> field.n([[0, 0, 0], [0, 0, 0.5]])
    #[pyo3(signature = (points))]
    fn n<'py>(&self, py: Python<'py>, points: Rows) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.map(py, points, |field, x| [field.n(x)], &[])
    }

    /// Evaluate the gradient ∇n, per scene unit.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, (..., 3)
    ///     As for ``n``.
    ///
    /// Returns
    /// -------
    /// ndarray, (..., 3)
    ///     ∇n = ∇n²/(2n).
    #[pyo3(signature = (points))]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        points: Rows,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let gradient = |field: &Index, x| {
            let (n2, gradient) = field.gradient(x);
            (gradient / (2.0 * n2.sqrt())).to_array()
        };
        self.map(py, points, gradient, &[3])
    }

    /// Evaluate the matrix of second derivatives Hess n, per square scene unit.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, (..., 3)
    ///     As for ``n``.
    ///
    /// Returns
    /// -------
    /// ndarray, (..., 3, 3)
    ///     Hess n = Hess n²/(2n) − ∇n⊗∇n/n, symmetric.
    #[pyo3(signature = (points))]
    fn hessian<'py>(&self, py: Python<'py>, points: Rows) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.map(py, points, hessian, &[3, 3])
    }

    /// Returns names and values of all parameters with derivatives.
    fn _parameters<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Vec<(String, Bound<'py, PyArrayDyn<f64>>)>> {
        let parameters = self.index().parameters().into_iter();
        parameters
            .map(|p| Ok((p.name, array(py, p.values, &p.shape)?)))
            .collect()
    }

    /// True if the index is constant, a bool.
    #[getter]
    fn is_constant(&self) -> bool {
        self.index().is_constant()
    }

    /// Bound the index in a box.
    ///
    /// Parameters
    /// ----------
    /// lower, upper : sequence of float, (3,)
    ///     Lower and upper corner of the box, in scene units.
    ///
    /// Returns
    /// -------
    /// (float, float)
    ///     Lower and upper bound of n. The bounds need not be attained.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Corners in the wrong order, or not finite.
    #[pyo3(signature = (lower, upper))]
    fn bounds(&self, lower: Rows, upper: Rows) -> PyResult<(f64, f64)> {
        let ([lower], [upper]) = (&lower.rows[..], &upper.rows[..]) else {
            let message = "expected two corners of three coordinates each";
            return Err(PyValueError::new_err(message));
        };
        let (lower, upper) = (lower.to_array(), upper.to_array());
        for (axis, (low, high)) in ["x", "y", "z"]
            .into_iter()
            .zip(lower.into_iter().zip(upper))
        {
            if !(low <= high && low.is_finite() && high.is_finite()) {
                let message = format!(
                    "the box extends from {low} to {high} in {axis}: give its lower corner, then its upper one, of finite numbers"
                );
                return Err(PyValueError::new_err(message));
            }
        }
        let region = Aabb::new(DVec3::from_array(lower), DVec3::from_array(upper));
        let bounds = self.index().bounds(&region);
        Ok((bounds.n2_min.max(0.0).sqrt(), bounds.n2_max.sqrt()))
    }

    fn __eq__(&self, other: &Field) -> bool {
        match (&self.source, &other.source) {
            (Source::Medium(a, i), Source::Medium(b, j)) => i == j && a.get().is_same(b.get()),
            (Source::Own(_, _, a), Source::Own(_, _, b)) => a == b,
            _ => false,
        }
    }

    fn __hash__(&self) -> u64 {
        match &self.source {
            Source::Medium(_, number) => *number as u64,
            Source::Own(_, _, hash) => u64::from(hash.bytes()[0]),
        }
    }

    /// Pickles the data from which the field was made, and the function that recreates it.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Recipe<'py>> {
        let module = py.import("morgana._scene")?;
        Ok(match &self.source {
            Source::Medium(scene, _) => {
                let arguments = (scene.clone_ref(py), self.name.clone());
                (module.getattr("field_of")?, arguments.into_py_any(py)?)
            }
            Source::Own(_, (volume, wavelength), hash) => {
                let arguments = (volume.clone_ref(py), hash.to_string(), *wavelength);
                (module.getattr("remake_field")?, arguments.into_py_any(py)?)
            }
        })
    }

    /// Hash of the data from which the field was made.
    #[getter]
    fn _hash(&self) -> String {
        match &self.source {
            Source::Medium(scene, _) => scene.get().loaded.hash.to_string(),
            Source::Own(_, _, hash) => hash.to_string(),
        }
    }

    fn __repr__(&self) -> String {
        let kind = if self.is_constant() {
            "constant"
        } else {
            "varying"
        };
        match self.name.as_str() {
            "" => format!("<morgana.Field, {kind}>"),
            name => format!("<morgana.Field of '{name}', {kind}>"),
        }
    }
}

/// Computes the Hessian of n from the jet of n², by the chain rule applied twice.
fn hessian(field: &Index, x: DVec3) -> [f64; 9] {
    let jet = field.jet(x);
    let n = jet.n2.sqrt();
    let gradient = jet.grad / (2.0 * n);
    let outer = DMat3::from_cols(
        gradient * gradient.x,
        gradient * gradient.y,
        gradient * gradient.z,
    );
    ((jet.hess * 0.5 - outer) * n.recip()).to_cols_array()
}
