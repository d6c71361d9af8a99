//! Ends of rays, and their causes.

use crate::numbers::array;
use numpy::{Element, PyArrayDyn};
use pyo3::prelude::*;
use transport::scene::Object;
use transport::trace::{Path, TraceEnding};

/// Causes of the ends of rays, by the numbers in [`Ends::endings`].
const ENDINGS: [&str; 5] = [
    "surface",
    "left the scene",
    "maximum length",
    "lost",
    "not followed",
];

/// Index in [`ENDINGS`] for rays that were not traced for lack of time.
const NOT_FOLLOWED: u8 = 4;

/// Index for rays that did not end on an object.
const NONE: i32 = -1;

/// Ends of rays: an array for each quantity, with a row for each ray. Rays that were not traced are
/// NaN.
#[pyclass(frozen, get_all, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Ends {
    /// Positions, (rays, 3).
    points: Py<PyAny>,
    /// Unit directions, (rays, 3).
    tangents: Py<PyAny>,
    arc_length: Py<PyAny>,
    optical_length: Py<PyAny>,
    optical_path_difference: Py<PyAny>,
    /// Refractive index.
    n: Py<PyAny>,
    /// Cause of the end of each ray, as an index into `ending_names`.
    endings: Py<PyAny>,
    /// Possible causes of ends.
    ending_names: Vec<&'static str>,
    /// Object on which each ray ended, as an index into `surface_names`; −1 for none.
    surfaces: Py<PyAny>,
    /// Names of objects.
    surface_names: Vec<String>,
}

/// Ends of rays while they are traced.
#[derive(Debug)]
pub struct Columns {
    points: Vec<f64>,
    tangents: Vec<f64>,
    arc_length: Vec<f64>,
    optical_length: Vec<f64>,
    path_difference: Vec<f64>,
    n: Vec<f64>,
    endings: Vec<u8>,
    surfaces: Vec<i32>,
}

impl Columns {
    /// Memory for each ray, in bytes.
    pub const BYTES: usize = 10 * size_of::<f64>() + size_of::<u8>() + size_of::<i32>();

    /// Makes empty columns with capacity for `rays` rays.
    pub fn with_capacity(rays: usize) -> Self {
        Columns {
            points: Vec::with_capacity(3 * rays),
            tangents: Vec::with_capacity(3 * rays),
            arc_length: Vec::with_capacity(rays),
            optical_length: Vec::with_capacity(rays),
            path_difference: Vec::with_capacity(rays),
            n: Vec::with_capacity(rays),
            endings: Vec::with_capacity(rays),
            surfaces: Vec::with_capacity(rays),
        }
    }

    /// Adds the end of the next ray; `None` if it was not traced.
    pub fn push(&mut self, path: Option<&Path>) {
        let end = path.and_then(|path| path.points.last());
        let vector = |v: Option<glam::DVec3>| v.unwrap_or(glam::DVec3::NAN).to_array();
        let number = |v: Option<f64>| v.unwrap_or(f64::NAN);
        self.points.extend(vector(end.map(|p| p.x)));
        self.tangents.extend(vector(end.map(|p| p.direction)));
        self.arc_length.push(number(end.map(|p| p.arc_length)));
        self.optical_length
            .push(number(end.map(|p| p.optical_length)));
        self.path_difference
            .push(number(end.map(|p| p.path_difference)));
        self.n.push(number(end.map(|p| p.index)));
        let (ending, surface) = match path.map(|path| path.ending) {
            Some(TraceEnding::Surface(object)) => (0, object as i32),
            Some(TraceEnding::Left) => (1, NONE),
            Some(TraceEnding::Length) => (2, NONE),
            Some(TraceEnding::Lost) => (3, NONE),
            None => (NOT_FOLLOWED, NONE),
        };
        self.endings.push(ending);
        self.surfaces.push(surface);
    }

    /// Returns true if all rays so far were traced.
    pub fn is_complete(&self) -> bool {
        !self.endings.contains(&NOT_FOLLOWED)
    }

    /// Converts to Python arrays, which take over the memory. `objects` are the objects on which
    /// rays end.
    pub fn into_ends(self, py: Python<'_>, objects: &[Object]) -> PyResult<Ends> {
        let rays = self.endings.len();
        let named = |object: &Object| object.name.clone();
        Ok(Ends {
            points: shaped(py, self.points, &[rays, 3])?,
            tangents: shaped(py, self.tangents, &[rays, 3])?,
            arc_length: shaped(py, self.arc_length, &[rays])?,
            optical_length: shaped(py, self.optical_length, &[rays])?,
            optical_path_difference: shaped(py, self.path_difference, &[rays])?,
            n: shaped(py, self.n, &[rays])?,
            endings: shaped(py, self.endings, &[rays])?,
            ending_names: ENDINGS.to_vec(),
            surfaces: shaped(py, self.surfaces, &[rays])?,
            surface_names: objects.iter().map(named).collect(),
        })
    }
}

fn shaped<T: Element>(py: Python<'_>, values: Vec<T>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    let shaped: Bound<'_, PyArrayDyn<T>> = array(py, values, shape)?;
    Ok(shaped.into_any().unbind())
}
