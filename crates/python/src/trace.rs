//! Tracing of rays with given starts.

use crate::ends::{Columns, Ends};
use crate::field::Field;
use crate::numbers::{array, ask_for_memory};
use crate::scene::Scene;
use crate::watch::{Shared, watched};
use eikonal::{Reference, Tolerance};
use glam::DVec3;
use io::clock::Stopped;
use numpy::ndarray::ArrayView2;
use numpy::{PyArrayDyn, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::time::Duration;
use transport::trace::{Path, TracePoint, Tracer, follow_field};

type Numbers<'py> = Bound<'py, PyArrayDyn<f64>>;
type Follow<'a> = Box<dyn Fn(Start) -> Path + Sync + 'a>;

/// Number of rays that are traced before their ends are stored: their points are then discarded.
const BLOCK: usize = 1 << 12;

/// Scene or field that rays pass through.
#[derive(FromPyObject)]
pub enum Through {
    /// A scene, with its surfaces.
    Scene(Py<Scene>),
    /// A field, which has no end.
    Field(Py<Field>),
}

/// Reference of optical path differences.
#[derive(FromPyObject)]
pub enum GivenIndex {
    /// A constant index.
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

/// Dictionary of the options of ray tracing.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct TraceOptions {
    /// Maximum length in scene units, positive; required for a field.
    max_length: Option<f64>,
    reference_index: Option<GivenIndex>,
    /// Time limit in seconds, positive.
    time: Option<f64>,
    /// True to keep the points of each ray.
    paths: bool,
}

/// Start of a ray.
#[derive(Clone, Copy)]
struct Start {
    x: DVec3,
    /// Unit vector.
    direction: DVec3,
}

/// Starts of all rays: Python arrays, which are not copied.
#[derive(Clone, Copy)]
struct Starts<'a> {
    origins: ArrayView2<'a, f64>,
    directions: ArrayView2<'a, f64>,
}

impl Starts<'_> {
    fn len(&self) -> usize {
        self.origins.nrows().min(self.directions.nrows())
    }

    fn get(&self, i: usize) -> Start {
        let row = |of: &ArrayView2<f64>| DVec3::new(of[[i, 0]], of[[i, 1]], of[[i, 2]]);
        Start {
            x: row(&self.origins),
            direction: unit(row(&self.directions)),
        }
    }

    /// Raises an error for starts that have no ray.
    fn check(&self) -> PyResult<()> {
        let refused = |message: String| Err(PyValueError::new_err(message));
        for (i, (x, d)) in self
            .origins
            .rows()
            .into_iter()
            .zip(self.directions.rows())
            .enumerate()
        {
            for (name, numbers) in [("origin", x), ("direction", d)] {
                if numbers.len() != 3 || !numbers.iter().all(|v| v.is_finite()) {
                    return refused(format!(
                        "{name} {i} is {numbers} but must be three finite numbers"
                    ));
                }
            }
            if !unit(DVec3::new(d[0], d[1], d[2])).is_finite() {
                return refused(format!("direction {i} is {d}, which has no length"));
            }
        }
        Ok(())
    }
}

/// Normalises a vector, even if its square overflows or underflows; NaN for the zero vector.
fn unit(d: DVec3) -> DVec3 {
    let size = d.abs().max_element();
    let squares = (1e-100..1e100).contains(&size);
    (if squares { d } else { d / size }).normalize()
}

/// Points of traced rays, ray after ray.
#[pyclass(frozen, module = "morgana._morgana")]
#[derive(Debug)]
pub struct Traced {
    rays: Vec<Vec<TracePoint>>,
}

/// Traces rays from `origins` in `directions`, which need not have unit length. Returns their ends;
/// their points, if requested; and the reason if some rays were not traced.
#[pyfunction]
pub fn trace(
    py: Python<'_>,
    through: Through,
    origins: PyReadonlyArray2<'_, f64>,
    directions: PyReadonlyArray2<'_, f64>,
    options: TraceOptions,
) -> PyResult<(Ends, Option<Traced>, Option<&'static str>)> {
    let starts = Starts {
        origins: origins.as_array(),
        directions: directions.as_array(),
    };
    ask_for_memory(starts.len(), Columns::BYTES, "rays")?;
    starts.check()?;
    let time = options
        .time
        .and_then(|t| Duration::try_from_secs_f64(t).ok());
    let ((columns, rays), interrupted) = watched(py, None, time, |shared| {
        follow_all(
            &starts,
            &follower(&through, &options),
            options.paths,
            shared,
        )
    })?;
    let stopped = if columns.is_complete() {
        None
    } else if interrupted {
        Some(Stopped::Interrupted)
    } else {
        Some(Stopped::Time)
    };
    let objects = match &through {
        Through::Scene(scene) => scene.get().loaded.scene().objects(),
        Through::Field(_) => &[],
    };
    let ends = columns.into_ends(py, objects)?;
    let traced = options.paths.then_some(Traced { rays });
    Ok((ends, traced, stopped.map(Stopped::name)))
}

/// Returns the function that traces a ray.
fn follower<'a>(through: &'a Through, options: &'a TraceOptions) -> Follow<'a> {
    let given = options.reference_index.as_ref().map(GivenIndex::get);
    match through {
        Through::Scene(scene) => {
            let loaded = &scene.get().loaded;
            let tracer = Tracer::new(loaded.scene(), options.max_length);
            let tracer = tracer.with_reference(given.or_else(|| loaded.reference()));
            Box::new(move |start| tracer.follow(start.x, start.direction))
        }
        Through::Field(field) => {
            let index = field.get().index();
            // Use the length that Python has checked.
            let length = options.max_length.unwrap_or(0.0);
            Box::new(move |start| {
                let tolerance = Tolerance::default();
                follow_field(index, tolerance, start.x, start.direction, length, given)
            })
        }
    }
}

/// Returns the ends of all rays, and their points if `keep` is true. Rays that are not traced for
/// lack of time have neither.
fn follow_all(
    starts: &Starts,
    follow: &Follow,
    keep: bool,
    shared: &Shared,
) -> (Columns, Vec<Vec<TracePoint>>) {
    let mut columns = Columns::with_capacity(starts.len());
    let mut rays = Vec::new();
    for first in (0..starts.len()).step_by(BLOCK) {
        let block = first..(first + BLOCK).min(starts.len());
        let one = |i| {
            let is_over = shared.requested() || shared.handle.end_requested();
            let path = (!is_over).then(|| follow(starts.get(i)))?;
            Some(if keep { path } else { without_way(path) })
        };
        let followed: Vec<Option<Path>> = block.into_par_iter().map(one).collect();
        for path in followed {
            columns.push(path.as_ref());
            if keep {
                rays.push(path.map_or(Vec::new(), |path| path.points));
            }
        }
    }
    (columns, rays)
}

/// Reduces a path to its end.
fn without_way(mut path: Path) -> Path {
    Path {
        points: path.points.pop().into_iter().collect(),
        ending: path.ending,
    }
}

impl Traced {
    /// Makes an array of `N` numbers of each point.
    fn of_points<'py, const N: usize>(
        &self,
        py: Python<'py>,
        of: impl Fn(&TracePoint) -> [f64; N],
        shape: &[usize],
    ) -> PyResult<Numbers<'py>> {
        let points = self.rays.iter().flatten();
        let values: Vec<[f64; N]> = points.map(of).collect();
        let shape: Vec<usize> = [values.len()].iter().chain(shape).copied().collect();
        array(py, values.into_flattened(), &shape)
    }
}

#[pymethods]
impl Traced {
    /// Returns the index of the first point of each ray, and the number of all points.
    fn offsets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        let mut offsets = vec![0];
        let mut end = 0;
        for points in &self.rays {
            end += points.len() as i64;
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
}
