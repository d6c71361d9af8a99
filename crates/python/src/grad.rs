//! Ends of many rays, and derivatives of losses by what the rays go through and by their starts.

use crate::field::Field;
use crate::numbers::array;
use crate::watch::{Shared, watched};
use eikonal::adjoint::{
    AdjointRay, Embedded, EndDerivative, ParameterDerivative, RayEnd, RayFailure, RayStart,
    Receiver,
};
use eikonal::field::{Bspline, Placement};
use eikonal::{Aabb, Field as Index, Tolerance};
use glam::DVec3;
use numpy::ndarray::{ArrayView1, ArrayView2, ArrayView3};
use numpy::{PyArrayDyn, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;

type Numbers<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Rays that are followed before signals are looked at.
const BLOCK: usize = 1 << 10;
/// Bytes of sums that are made side by side, whatever the number of threads: so results do not depend on it.
const SUMS: usize = 160 << 20;
/// No more sums than these.
const MOST_SUMS: usize = 32;

/// Numbers of failures, in the order of `python/morgana/grad.py`; zero for a ray with an end.
fn number(failure: RayFailure) -> u8 {
    match failure {
        RayFailure::Missed => 1,
        RayFailure::Lost => 2,
        RayFailure::OverBudget => 3,
    }
}

/// What rays go through.
#[derive(FromPyObject)]
pub enum GivenField<'py> {
    /// A field.
    Field(Py<Field>),
    /// Samples of n, [z, y, x], in the box.
    Samples(PyReadonlyArray3<'py, f64>),
}

/// A dictionary of where rays go and end.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RayOptions {
    /// Corners of the box; without, the field is everywhere.
    region: Option<([f64; 3], [f64; 3])>,
    /// Index around the box.
    ambient: f64,
    /// Whether the outermost samples lie on the faces of the box.
    nodes: bool,
    /// A point and a unit normal; without, rays end where they leave the box.
    plane: Option<([f64; 3], [f64; 3])>,
    tolerance: f64,
    max_length: f64,
}

/// The same, ready to be followed.
struct Course {
    field: Index,
    grid: Option<Bspline>,
    region: Aabb,
    ambient: f64,
    receiver: Receiver,
    tolerance: Tolerance,
    max_length: f64,
}

impl Course {
    fn new(py: Python<'_>, through: &GivenField, options: &RayOptions) -> PyResult<Self> {
        let vector = DVec3::from_array;
        let everywhere = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        let region = options.region.map_or(everywhere, |(low, high)| {
            Aabb::new(vector(low), vector(high))
        });
        let receiver = match options.plane {
            Some((point, normal)) => Receiver::Plane {
                point: vector(point),
                normal: vector(normal),
            },
            None => Receiver::Leaving(region),
        };
        let grid = match through {
            GivenField::Field(_) => None,
            GivenField::Samples(samples) => {
                let samples = samples.as_array();
                Some(py.detach(|| spline(samples, region, options.nodes))?)
            }
        };
        let field = match (through, &grid) {
            (GivenField::Field(field), _) => field.get().index().clone(),
            (_, Some(grid)) => grid.clone().into(),
            _ => unreachable!("samples make a grid"),
        };
        Ok(Course {
            field,
            grid,
            region,
            ambient: options.ambient,
            receiver,
            tolerance: Tolerance::new(options.tolerance),
            max_length: options.max_length,
        })
    }

    fn world(&self) -> Embedded<'_> {
        Embedded::new(&self.field, self.region, self.ambient)
    }

    fn ray<'w>(&self, world: &'w Embedded<'w>) -> AdjointRay<'w, Embedded<'w>> {
        AdjointRay::new(world, self.receiver, self.tolerance, self.max_length)
    }
}

/// The spline through samples [z, y, x], in a row.
fn spline(samples: ArrayView3<f64>, region: Aabb, nodes: bool) -> PyResult<Bspline> {
    let refused = |message: String| PyValueError::new_err(message);
    let values = samples.as_slice();
    let values = values.ok_or_else(|| refused("samples must be contiguous".into()))?;
    let (z, y, x) = samples.dim();
    let placement = if nodes {
        Placement::Nodes
    } else {
        Placement::Centers
    };
    let made = Bspline::from_samples([x, y, z], region, placement, values);
    made.map_err(|error| refused(error.to_string()))
}

/// Where all rays start: arrays of Python, which are not copied.
#[derive(Clone, Copy)]
struct Starts<'a> {
    origins: ArrayView2<'a, f64>,
    directions: ArrayView2<'a, f64>,
    region: Aabb,
}

fn row(of: &ArrayView2<f64>, i: usize) -> DVec3 {
    DVec3::new(of[[i, 0]], of[[i, 1]], of[[i, 2]])
}

impl Starts<'_> {
    fn len(&self) -> usize {
        self.origins.nrows()
    }

    /// The start of a ray, and the length of its direction as it was given.
    fn get(&self, i: usize) -> (RayStart<bool>, f64) {
        let (x, given) = (row(&self.origins, i), row(&self.directions, i));
        let length = given.length();
        let start = RayStart {
            x,
            direction: given / length,
            region: enters(&self.region, x, given),
        };
        (start, length)
    }
}

/// Whether a ray starts in a box: inside, or on a face and inwards.
fn enters(region: &Aabb, x: DVec3, direction: DVec3) -> bool {
    (0..3).all(|axis| {
        let (x, d) = (x[axis], direction[axis]);
        let [low, high] = [region.min[axis], region.max[axis]];
        x > low && x < high || x == low && d > 0.0 || x == high && d < 0.0
    })
}

fn not_interrupted<T>((result, interrupted): (T, bool)) -> PyResult<T> {
    if interrupted {
        Err(PyKeyboardInterrupt::new_err(()))
    } else {
        Ok(result)
    }
}

/// Follows rays to where they end: positions, unit directions, optical lengths, and numbers of failures. What has no end is NaN.
#[pyfunction]
#[allow(clippy::type_complexity)] // Four arrays.
pub fn follow_rays<'py>(
    py: Python<'py>,
    through: GivenField<'py>,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    options: RayOptions,
) -> PyResult<(
    Numbers<'py>,
    Numbers<'py>,
    Numbers<'py>,
    Bound<'py, PyArrayDyn<u8>>,
)> {
    let course = Course::new(py, &through, &options)?;
    let starts = Starts {
        origins: origins.as_array(),
        directions: directions.as_array(),
        region: course.region,
    };
    let count = starts.len();
    let (mut x, mut d) = (vec![f64::NAN; 3 * count], vec![f64::NAN; 3 * count]);
    let (mut lengths, mut failures) = (vec![f64::NAN; count], vec![0; count]);
    let work = |shared: &Shared| {
        let columns = x.par_chunks_mut(3 * BLOCK).zip(d.par_chunks_mut(3 * BLOCK));
        let more = lengths
            .par_chunks_mut(BLOCK)
            .zip(failures.par_chunks_mut(BLOCK));
        let world = course.world();
        columns
            .zip(more)
            .enumerate()
            .for_each(|(block, ((x, d), (lengths, failures)))| {
                let mut ray = course.ray(&world);
                for i in 0..lengths.len() {
                    if shared.asked() || shared.handle.is_asked() {
                        return;
                    }
                    match ray.follow(starts.get(block * BLOCK + i).0) {
                        Ok(end) => {
                            end.x.write_to_slice(&mut x[3 * i..]);
                            end.v.normalize().write_to_slice(&mut d[3 * i..]);
                            lengths[i] = end.optical_length;
                        }
                        Err(failure) => failures[i] = number(failure),
                    }
                }
            });
    };
    not_interrupted(watched(py, None, None, work)?)?;
    Ok((
        array(py, x, &[count, 3])?,
        array(py, d, &[count, 3])?,
        array(py, lengths, &[count])?,
        array(py, failures, &[count])?,
    ))
}

/// Arrays of ends: positions, unit directions, optical lengths. What is left out is `None`.
#[derive(FromPyObject)]
pub struct GivenEnds<'py>(
    Option<PyReadonlyArray2<'py, f64>>,
    Option<PyReadonlyArray2<'py, f64>>,
    Option<PyReadonlyArray1<'py, f64>>,
);

impl GivenEnds<'_> {
    fn view(&self) -> Ends<'_> {
        Ends {
            positions: self.0.as_ref().map(|of| of.as_array()),
            directions: self.1.as_ref().map(|of| of.as_array()),
            lengths: self.2.as_ref().map(|of| of.as_array()),
        }
    }
}

/// Numbers for the ends of rays.
#[derive(Clone, Copy)]
struct Ends<'a> {
    positions: Option<ArrayView2<'a, f64>>,
    directions: Option<ArrayView2<'a, f64>>,
    lengths: Option<ArrayView1<'a, f64>>,
}

/// Position, direction and optical length of one end, or derivatives by them.
type EndValues = (DVec3, DVec3, f64);

impl Ends<'_> {
    /// Those of a ray, with `missing` for what is left out.
    fn get(&self, i: usize, missing: f64) -> EndValues {
        let vector = |of: &Option<ArrayView2<f64>>| {
            of.as_ref().map_or(DVec3::splat(missing), |of| row(of, i))
        };
        let length = self.lengths.map_or(missing, |of| of[i]);
        (vector(&self.positions), vector(&self.directions), length)
    }
}

/// A loss of the ends of rays.
#[derive(Clone, Copy)]
enum Loss<'a> {
    /// Given by its derivatives.
    Derivatives(Ends<'a>),
    /// ½Σ ((end − measured)/noise)², of what is measured: neither infinite nor NaN.
    Squares {
        measured: Ends<'a>,
        /// Of positions, directions and optical lengths.
        noise: [f64; 3],
    },
}

impl Loss<'_> {
    /// Whether it depends on a ray.
    fn depends_on(&self, i: usize) -> bool {
        match self {
            Loss::Derivatives(by) => by.get(i, 0.0) != (DVec3::ZERO, DVec3::ZERO, 0.0),
            Loss::Squares { measured, .. } => {
                let (x, d, length) = measured.get(i, f64::NAN);
                x.is_finite() || d.is_finite() || length.is_finite()
            }
        }
    }

    /// What a ray adds to twice the sum of squares, and the derivative of the loss by its end.
    fn at(&self, i: usize, end: &RayEnd) -> (f64, EndDerivative) {
        let direction = end.v.normalize();
        let (squares, (x, d, length)) = match self {
            Loss::Derivatives(by) => (0.0, by.get(i, 0.0)),
            Loss::Squares { measured, noise } => {
                let (x, d, length) = measured.get(i, f64::NAN);
                let [of_x, of_d, of_length] = *noise;
                let x = known((end.x - x) / of_x);
                let d = known((direction - d) / of_d);
                let length = known(DVec3::X * ((end.optical_length - length) / of_length)).x;
                let squares = x.length_squared() + d.length_squared() + length * length;
                (squares, (x / of_x, d / of_d, length / of_length))
            }
        };
        (squares, EndDerivative::of_direction(x, d, length, end.v))
    }
}

/// A residual; zero where it is not known.
fn known(residual: DVec3) -> DVec3 {
    if residual.is_finite() {
        residual
    } else {
        DVec3::ZERO
    }
}

/// A part of the rays, in their order, with a sum of its own.
struct Share<'a> {
    first: usize,
    by_origins: &'a mut [f64],
    by_directions: &'a mut [f64],
    sum: ParameterDerivative<'a, bool>,
    /// Of a loss of squares.
    squares: f64,
    /// Rays without an end on which the loss depends all the same.
    failed: usize,
}

impl Share<'_> {
    fn pull_back(&mut self, course: &Course, starts: &Starts, loss: &Loss, shared: &Shared) {
        let world = course.world();
        let mut ray = course.ray(&world);
        for i in 0..self.by_origins.len() / 3 {
            let at = self.first + i;
            if shared.asked() || shared.handle.is_asked() {
                return;
            }
            if !loss.depends_on(at) {
                continue;
            }
            let (start, length) = starts.get(at);
            let Ok(end) = ray.follow(start) else {
                self.failed += 1;
                continue;
            };
            let (squares, by) = loss.at(at, &end);
            self.squares += squares;
            if let Some(back) = ray.pull_back(&by, &mut self.sum) {
                back.x.write_to_slice(&mut self.by_origins[3 * i..]);
                (back.direction / length).write_to_slice(&mut self.by_directions[3 * i..]);
            }
        }
    }
}

/// Takes derivatives of a loss by the ends of rays back: by the samples, or by the parameters of a field; by origins; by directions, as they
/// were given. The number of rays without an end on which the loss depends.
#[pyfunction]
pub fn pull_back<'py>(
    py: Python<'py>,
    through: GivenField<'py>,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    options: RayOptions,
    by: GivenEnds<'py>,
) -> PyResult<(Numbers<'py>, Numbers<'py>, Numbers<'py>, usize)> {
    let course = Course::new(py, &through, &options)?;
    let starts = Starts {
        origins: origins.as_array(),
        directions: directions.as_array(),
        region: course.region,
    };
    let found = derivatives(py, &course, &starts, &Loss::Derivatives(by.view()))?;
    let count = starts.len();
    Ok((
        by_index(py, &through, &course, found.field)?,
        array(py, found.origins, &[count, 3])?,
        array(py, found.directions, &[count, 3])?,
        found.failed,
    ))
}

/// Σ ((end − measured)/noise)² over all rays, with its three kinds of noise; the derivative of half of it by the samples, or by the
/// parameters of a field; and the number of rays that are measured but have no end.
#[pyfunction]
pub fn sum_of_squares<'py>(
    py: Python<'py>,
    through: GivenField<'py>,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    options: RayOptions,
    measured: GivenEnds<'py>,
    noise: [f64; 3],
) -> PyResult<(f64, Numbers<'py>, usize)> {
    let course = Course::new(py, &through, &options)?;
    let starts = Starts {
        origins: origins.as_array(),
        directions: directions.as_array(),
        region: course.region,
    };
    let measured = measured.view();
    let found = derivatives(py, &course, &starts, &Loss::Squares { measured, noise })?;
    let field = by_index(py, &through, &course, found.field)?;
    Ok((found.squares, field, found.failed))
}

/// Derivatives by everything.
struct Derivatives {
    squares: f64,
    /// By the parameters of the field.
    field: Vec<f64>,
    origins: Vec<f64>,
    directions: Vec<f64>,
    failed: usize,
}

fn derivatives(
    py: Python<'_>,
    course: &Course,
    starts: &Starts,
    loss: &Loss,
) -> PyResult<Derivatives> {
    let count = starts.len();
    let (mut origins, mut directions) = (vec![0.0; 3 * count], vec![0.0; 3 * count]);
    let bytes = size_of::<f64>() * course.field.parameter_count().max(1);
    let sums = (SUMS / bytes)
        .clamp(2, MOST_SUMS)
        .min(count.div_ceil(BLOCK))
        .max(1);
    let per_share = count.div_ceil(sums).max(1);
    let work = |shared: &Shared| {
        let columns = origins
            .chunks_mut(3 * per_share)
            .zip(directions.chunks_mut(3 * per_share));
        let share = |(number, (by_origins, by_directions))| Share {
            first: number * per_share,
            by_origins,
            by_directions,
            sum: ParameterDerivative::new(true, &course.field),
            squares: 0.0,
            failed: 0,
        };
        let mut shares: Vec<Share> = columns.enumerate().map(share).collect();
        let each = shares.par_iter_mut();
        each.for_each(|share| share.pull_back(course, starts, loss, shared));
        added(&course.field, shares)
    };
    let (field, squares, failed) = not_interrupted(watched(py, None, None, work)?)?;
    Ok(Derivatives {
        squares,
        field,
        origins,
        directions,
        failed,
    })
}

/// Derivatives by the samples, in their shape, or by the parameters of a field, from those by the parameters.
fn by_index<'py>(
    py: Python<'py>,
    through: &GivenField<'py>,
    course: &Course,
    mut values: Vec<f64>,
) -> PyResult<Numbers<'py>> {
    let mut shape = vec![values.len()];
    if let (GivenField::Samples(samples), Some(grid)) = (through, &course.grid) {
        values = grid.sample_derivative(values);
        let samples = samples.as_array();
        values
            .iter_mut()
            .zip(samples)
            .for_each(|(by, n)| *by *= 2.0 * n);
        shape = samples.shape().to_vec();
    }
    array(py, values, &shape)
}

/// The sums of all shares, in their order, those of squares, and the rays that failed.
fn added(field: &Index, shares: Vec<Share>) -> (Vec<f64>, f64, usize) {
    let (mut squares, mut failed) = (0.0, 0);
    let mut total = vec![0.0; field.parameter_count()];
    for share in shares {
        squares += share.squares;
        failed += share.failed;
        total
            .iter_mut()
            .zip(share.sum.values)
            .for_each(|(sum, value)| *sum += value);
    }
    (total, squares, failed)
}
