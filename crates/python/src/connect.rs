//! Rays between two points.

use crate::errors;
use crate::numbers::Rows;
use crate::scene::Scene;
use pyo3::prelude::*;
use pyo3::types::PyType;
use transport::trace::{Branch, branches};

/// A ray between two points, found by ``morgana.connect``. Rays can be pickled, and compared with
/// ``==``.
#[pyclass(frozen, get_all, eq, module = "morgana")]
#[derive(Clone, Debug, PartialEq)]
pub struct Ray {
    /// Unit direction in which the ray leaves the first point, three floats.
    direction_out: [f64; 3],
    /// Unit direction in which the ray arrives at the second point, three floats.
    direction_in: [f64; 3],
    /// Length of the ray, in scene units.
    arc_length: f64,
    /// Optical path length ∫ n ds, in scene units.
    optical_length: f64,
    /// Cross section of the ray tube at the second point per solid angle at the first, dA⊥/dΩ, in
    /// square scene units per sr; d² for a straight ray of length d.
    jacobian: f64,
    /// Transmittance of each channel, 0 to 1, a list of float.
    transmittance: Vec<f64>,
    /// Number of reflections where refraction was possible.
    reflections: u32,
    /// True if an object blocks the ray.
    occluded: bool,
    /// True for the primary ray, which is found from a fixed start.
    primary: bool,
}

impl Ray {
    fn new(branch: Branch) -> Self {
        let ray = branch.connection;
        Ray {
            direction_out: ray.direction_out.to_array(),
            direction_in: ray.direction_in.to_array(),
            arc_length: ray.arc_length,
            optical_length: ray.optical_length,
            jacobian: ray.jacobian,
            transmittance: branch.transmittance,
            reflections: ray.pattern.reflections(),
            occluded: branch.is_occluded,
            primary: branch.is_primary,
        }
    }
}

/// Values of a ray, in the order of its attributes.
type RayValues = ([f64; 3], [f64; 3], f64, f64, f64, Vec<f64>, u32, bool, bool);

#[pymethods]
impl Ray {
    #[new]
    fn of_values(values: RayValues) -> Self {
        Ray {
            direction_out: values.0,
            direction_in: values.1,
            arc_length: values.2,
            optical_length: values.3,
            jacobian: values.4,
            transmittance: values.5,
            reflections: values.6,
            occluded: values.7,
            primary: values.8,
        }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyType>, (RayValues,)) {
        let ray = slf.get().clone();
        let values = (
            ray.direction_out,
            ray.direction_in,
            ray.arc_length,
            ray.optical_length,
            ray.jacobian,
            ray.transmittance,
            ray.reflections,
            ray.occluded,
            ray.primary,
        );
        (slf.get_type(), (values,))
    }

    fn __repr__(&self) -> String {
        let blocked = if self.occluded { ", occluded" } else { "" };
        format!(
            "<morgana.Ray of length {:.6}, optical length {:.6}{blocked}>",
            self.arc_length, self.optical_length
        )
    }
}

/// Finds the rays between two points. Returns them, the reason if there is no primary ray, and true
/// if there is certainly at most one ray.
#[pyfunction]
pub fn connect(
    py: Python<'_>,
    scene: Py<Scene>,
    a: Rows,
    b: Rows,
    all: Option<u32>,
) -> PyResult<(Vec<Ray>, Option<String>, bool)> {
    let ([from], [to]) = (&a.rows[..], &b.rows[..]) else {
        return Err(errors::render(
            "connect takes two points, of three numbers each",
        ));
    };
    if !(from.is_finite() && to.is_finite()) {
        return Err(errors::render("connect takes two points of finite numbers"));
    }
    let scenes = scene.get().loaded.same_rays();
    let found = py.detach(|| branches(scenes, *from, *to, all));
    let rays = found.list.into_iter().map(Ray::new).collect();
    Ok((rays, found.failure.map(|f| f.to_string()), found.is_unique))
}
