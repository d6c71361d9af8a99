//! Rays: those of given starts, and those between two points.

use crate::errors;
use crate::field::Field;
use crate::numbers::{Rows, array};
use crate::scene::Scene;
use eikonal::{Reference, Tolerance};
use glam::DVec3;
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyType;
use rayon::prelude::*;
use transport::trace::{Branch, Path, TraceEnding, TracePoint, Tracer, branches, follow_field};

type Numbers<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Rays that were followed. Their points lie in one array after the other: ray i has those from `offsets[i]` to
/// `offsets[i + 1]`.
#[pyclass(frozen, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Traced {
    /// That through which they went, if it has surfaces.
    scene: Option<Py<Scene>>,
    paths: Vec<Path>,
}

/// What optical path differences are taken against.
#[derive(FromPyObject)]
pub enum GivenIndex {
    /// The same index everywhere.
    Constant(f64),
    /// A field.
    Varying(Py<Field>),
}

impl GivenIndex {
    fn get(&self) -> Reference<'_> {
        match self {
            GivenIndex::Constant(n) => Reference::Index(*n),
            GivenIndex::Varying(field) => Reference::Field(field.get().index()),
        }
    }
}

/// Follows rays through a scene from points in directions, which need not have unit length.
#[pyfunction]
pub fn trace(
    py: Python<'_>,
    scene: Py<Scene>,
    origins: Rows,
    directions: Rows,
    max_length: Option<f64>,
    reference_index: Option<GivenIndex>,
) -> PyResult<Traced> {
    let starts = starts(&origins, &directions)?;
    let paths = py.detach(|| {
        let loaded = &scene.get().loaded;
        let reference = match &reference_index {
            Some(given) => Some(given.get()),
            None => loaded.reference(),
        };
        let tracer = Tracer::new(loaded.scene(), max_length).with_reference(reference);
        let follow = |(x, d): &(DVec3, DVec3)| tracer.follow(*x, *d);
        starts.par_iter().map(follow).collect()
    });
    let scene = Some(scene);
    Ok(Traced { scene, paths })
}

/// Follows rays of the given length through a field, which has no end.
#[pyfunction]
pub fn trace_field(
    py: Python<'_>,
    field: &Field,
    origins: Rows,
    directions: Rows,
    max_length: f64,
    reference_index: Option<GivenIndex>,
) -> PyResult<Traced> {
    let starts = starts(&origins, &directions)?;
    let paths = py.detach(|| {
        let reference = reference_index.as_ref().map(GivenIndex::get);
        let follow = |(x, d): &(DVec3, DVec3)| {
            let tolerance = Tolerance::default();
            follow_field(field.index(), tolerance, *x, *d, max_length, reference)
        };
        starts.par_iter().map(follow).collect()
    });
    let scene = None;
    Ok(Traced { scene, paths })
}

/// Where rays start, with unit directions.
fn starts(origins: &Rows, directions: &Rows) -> PyResult<Vec<(DVec3, DVec3)>> {
    if origins.rows.len() != directions.rows.len() {
        let (a, b) = (origins.rows.len(), directions.rows.len());
        let message = format!("there are {a} origins but {b} directions");
        return Err(PyValueError::new_err(message));
    }
    if let Some(i) = origins.rows.iter().position(|x| !x.is_finite()) {
        return Err(PyValueError::new_err(format!("origin {i} is not finite")));
    }
    let mut starts = Vec::with_capacity(origins.rows.len());
    for (i, (x, d)) in origins.rows.iter().zip(&directions.rows).enumerate() {
        let Some(d) = d.try_normalize() else {
            return Err(PyValueError::new_err(format!(
                "direction {i} has no length"
            )));
        };
        starts.push((*x, d));
    }
    Ok(starts)
}

impl Traced {
    /// `N` numbers of each point.
    fn of_points<'py, const N: usize>(
        &self,
        py: Python<'py>,
        of: impl Fn(&TracePoint) -> [f64; N],
        shape: &[usize],
    ) -> PyResult<Numbers<'py>> {
        let points = self.paths.iter().flat_map(|path| &path.points);
        let values: Vec<[f64; N]> = points.map(of).collect();
        let shape: Vec<usize> = [values.len()].iter().chain(shape).copied().collect();
        array(py, values.into_flattened(), &shape)
    }
}

#[pymethods]
impl Traced {
    fn offsets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        let mut offsets = vec![0];
        let mut end = 0;
        for path in &self.paths {
            end += path.points.len() as i64;
            offsets.push(end);
        }
        let count = offsets.len();
        array(py, offsets, &[count])
    }

    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Numbers<'py>> {
        self.of_points(py, |p| p.x.to_array(), &[3])
    }

    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Numbers<'py>> {
        self.of_points(py, |p| p.direction.to_array(), &[3])
    }

    fn arc_lengths<'py>(&self, py: Python<'py>) -> PyResult<Numbers<'py>> {
        self.of_points(py, |p| [p.arc_length], &[])
    }

    fn optical_lengths<'py>(&self, py: Python<'py>) -> PyResult<Numbers<'py>> {
        self.of_points(py, |p| [p.optical_length], &[])
    }

    fn path_differences<'py>(&self, py: Python<'py>) -> PyResult<Numbers<'py>> {
        self.of_points(py, |p| [p.path_difference], &[])
    }

    fn indices<'py>(&self, py: Python<'py>) -> PyResult<Numbers<'py>> {
        self.of_points(py, |p| [p.index], &[])
    }

    /// For each ray, how it ended, and the name of the object that it ended on.
    fn endings(&self) -> Vec<(&'static str, Option<String>)> {
        let name = |object: usize| {
            let scene = self.scene.as_ref().map(|scene| scene.get().loaded.scene());
            scene.map(|scene| scene.objects()[object].name.clone())
        };
        let ending = |path: &Path| match path.ending {
            TraceEnding::Surface(object) => ("surface", name(object)),
            TraceEnding::Left => ("left the scene", None),
            TraceEnding::Length => ("maximum length", None),
            TraceEnding::Lost => ("lost", None),
        };
        self.paths.iter().map(ending).collect()
    }
}

/// A ray between two points.
#[pyclass(frozen, get_all, eq, module = "morgana")]
#[derive(Clone, Debug, PartialEq)]
pub struct Ray {
    /// Unit direction in which it leaves the first point.
    direction_out: [f64; 3],
    /// Unit direction in which it arrives at the second point.
    direction_in: [f64; 3],
    /// Its length, in scene units.
    arc_length: f64,
    /// Optical path length ∫ n ds, in scene units.
    optical_length: f64,
    /// Cross section of its ray tube at the second point by solid angle at the first, dA⊥/dΩ; d² for a straight ray of
    /// length d.
    jacobian: f64,
    /// Transmittance of each channel.
    transmittance: Vec<f64>,
    /// Reflections where it could have been refracted.
    reflections: u32,
    /// Whether something stands in its way.
    occluded: bool,
    /// Whether it is the one that is found from the usual start.
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

/// The values of a ray, in the order of its attributes.
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

/// The rays between two points, why there is no primary one, and whether there is certainly at most one.
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
