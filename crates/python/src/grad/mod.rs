//! Ends of many rays, and derivatives of losses by media, surfaces and starts.

mod course;
mod ends;
mod share;

use crate::numbers::{array, ask_for_memory};
use crate::watch::{Shared, watched};
use course::{Course, FoundDerivatives, GivenChange, GivenLayout, RayOptions};
use eikonal::adjoint::{AdjointRay, Layout, RayFailure, StartChange};
use ends::{GivenEnds, Loss, Starts, row};
use glam::DVec3;
use numpy::{PyArrayDyn, PyReadonlyArray2};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;
use share::derivatives;

type Numbers<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Number of rays that are traced between two checks of signals.
const BLOCK: usize = 1 << 10;

/// Returns the number of a failure, in the order of `python/morgana/grad.py`; zero is a ray with an
/// end.
fn number(failure: RayFailure) -> u8 {
    match failure {
        RayFailure::Missed => 1,
        RayFailure::Lost => 2,
        RayFailure::OverBudget => 3,
        RayFailure::MissedSurface => 4,
        RayFailure::Reflected => 5,
        RayFailure::Stopped => 6,
    }
}

fn not_interrupted<T>((result, interrupted): (T, bool)) -> PyResult<T> {
    if interrupted {
        Err(PyKeyboardInterrupt::new_err(()))
    } else {
        Ok(result)
    }
}

/// Positions, directions and optical lengths of ends, or their changes; NaN for rays without an
/// end.
struct Columns {
    positions: Vec<f64>,
    directions: Vec<f64>,
    lengths: Vec<f64>,
    failures: Vec<u8>,
}

impl Columns {
    /// Collects the results of `of` for each ray; an error is the number of a failure.
    fn of(
        py: Python<'_>,
        count: usize,
        course: &Course,
        layout: &Layout,
        of: impl Fn(usize, &mut AdjointRay<Layout>) -> Result<(DVec3, DVec3, f64), u8> + Sync,
    ) -> PyResult<Self> {
        ask_for_memory(count, 7 * size_of::<f64>() + 1, "rays")?;
        let mut found = Columns {
            positions: vec![f64::NAN; 3 * count],
            directions: vec![f64::NAN; 3 * count],
            lengths: vec![f64::NAN; count],
            failures: vec![0; count],
        };
        let work = |shared: &Shared| {
            let vectors = found
                .positions
                .par_chunks_mut(3 * BLOCK)
                .zip(found.directions.par_chunks_mut(3 * BLOCK));
            let numbers = found
                .lengths
                .par_chunks_mut(BLOCK)
                .zip(found.failures.par_chunks_mut(BLOCK));
            let blocks = vectors.zip(numbers).enumerate();
            blocks.for_each(|(block, ((x, d), (lengths, failures)))| {
                let mut ray = course.ray(layout);
                for i in 0..lengths.len() {
                    if shared.requested() || shared.handle.end_requested() {
                        return;
                    }
                    match of(block * BLOCK + i, &mut ray) {
                        Ok((position, direction, length)) => {
                            position.write_to_slice(&mut x[3 * i..]);
                            direction.write_to_slice(&mut d[3 * i..]);
                            lengths[i] = length;
                        }
                        Err(failure) => failures[i] = failure,
                    }
                }
            });
        };
        not_interrupted(watched(py, None, None, work)?)?;
        Ok(found)
    }

    fn into_arrays(self, py: Python<'_>) -> PyResult<FoundEnds<'_>> {
        let count = self.lengths.len();
        Ok((
            array(py, self.positions, &[count, 3])?,
            array(py, self.directions, &[count, 3])?,
            array(py, self.lengths, &[count])?,
            array(py, self.failures, &[count])?,
        ))
    }
}

/// Positions, directions, optical lengths, and numbers of failures.
type FoundEnds<'py> = (
    Numbers<'py>,
    Numbers<'py>,
    Numbers<'py>,
    Bound<'py, PyArrayDyn<u8>>,
);

/// Returns media and surfaces, whose numbers have been checked.
fn layout(course: &Course) -> PyResult<Layout<'_>> {
    let message = "a sequence needs one medium more than refracting surfaces, and a box one medium";
    let refused = || PyValueError::new_err(message);
    course.layout().ok_or_else(refused)
}

/// Traces rays to their ends: positions, unit directions, optical lengths, and numbers of failures.
/// Rays without an end are NaN.
#[pyfunction]
pub fn follow_rays<'py>(
    py: Python<'py>,
    through: GivenLayout<'py>,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    options: RayOptions,
) -> PyResult<FoundEnds<'py>> {
    let course = Course::new(py, &through, &options)?;
    let starts = Starts::new(&origins, &directions, &course);
    let layout = layout(&course)?;
    let follow = |i: usize, ray: &mut AdjointRay<Layout>| {
        let end = ray.follow_through(starts.get(i).0).map_err(number)?;
        Ok((end.x, end.v.normalize(), end.optical_length))
    };
    Columns::of(py, starts.len(), &course, &layout, follow)?.into_arrays(py)
}

/// Computes the changes of ends with media, surfaces and starts as given: positions, directions,
/// optical lengths, and numbers of failures. Rays without an end are NaN.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // Each argument is a Python object.
pub fn push_forward<'py>(
    py: Python<'py>,
    through: GivenLayout<'py>,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    options: RayOptions,
    change: GivenChange<'py>,
    of_origins: PyReadonlyArray2<'py, f64>,
    of_directions: PyReadonlyArray2<'py, f64>,
) -> PyResult<FoundEnds<'py>> {
    let course = Course::new(py, &through, &options)?;
    let starts = Starts::new(&origins, &directions, &course);
    let layout = layout(&course)?;
    let change = course.change(&layout, &through, &change)?;
    let (of_origins, of_directions) = (of_origins.as_array(), of_directions.as_array());
    let push = |i: usize, ray: &mut AdjointRay<Layout>| {
        let (start, length) = starts.get(i);
        let end = ray.follow_through(start).map_err(number)?;
        let turned = row(&of_directions, i) / length;
        let begin = StartChange {
            x: row(&of_origins, i),
            direction: turned.reject_from_normalized(start.direction),
        };
        let found = ray.push_forward(&begin, &change);
        let found = found.ok_or(number(RayFailure::Missed))?;
        Ok((found.x, found.direction(end.v), found.optical_length))
    };
    Columns::of(py, starts.len(), &course, &layout, push)?.into_arrays(py)
}

/// Pulls derivatives of a loss by the ends of rays back: to all media, surfaces and the exit; to
/// origins; to directions as given. Also returns the number of rays without an end on which the
/// loss depends.
#[pyfunction]
#[allow(clippy::type_complexity)] // A tuple of four results.
pub fn pull_back<'py>(
    py: Python<'py>,
    through: GivenLayout<'py>,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    options: RayOptions,
    by: GivenEnds<'py>,
) -> PyResult<(FoundDerivatives<'py>, Numbers<'py>, Numbers<'py>, usize)> {
    let course = Course::new(py, &through, &options)?;
    let starts = Starts::new(&origins, &directions, &course);
    let found = derivatives(py, &course, &starts, &Loss::Derivatives(by.view()))?;
    let count = starts.len();
    Ok((
        course.derivatives(py, &through, found.sums)?,
        array(py, found.origins, &[count, 3])?,
        array(py, found.directions, &[count, 3])?,
        found.failed,
    ))
}

/// Computes Σ ((end − measured)/noise)² over all rays, with a noise for each of the three kinds of
/// data. Also returns the derivatives of half the sum by all media, surfaces and the exit, and the
/// number of measured rays that have no end.
#[pyfunction]
pub fn sum_of_squares<'py>(
    py: Python<'py>,
    through: GivenLayout<'py>,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    options: RayOptions,
    measured: GivenEnds<'py>,
    noise: [f64; 3],
) -> PyResult<(f64, FoundDerivatives<'py>, usize)> {
    let course = Course::new(py, &through, &options)?;
    let starts = Starts::new(&origins, &directions, &course);
    let measured = measured.view();
    let found = derivatives(py, &course, &starts, &Loss::Squares { measured, noise })?;
    let by = course.derivatives(py, &through, found.sums)?;
    Ok((found.squares, by, found.failed))
}
