//! Media and surfaces that rays pass, and the ends of the rays.

use crate::field::Field;
use crate::numbers::array;
use eikonal::adjoint::{
    AdjointRay, DEPARTURES, Embedded, Layout, LayoutChange, LayoutDerivative, Quadric,
    QuadricDerivative, Receiver, Sequence, SequenceElement,
};
use eikonal::field::{Bspline, Constant, Placement};
use eikonal::{Aabb, Field as Index, Tolerance};
use glam::DVec3;
use numpy::ndarray::ArrayView3;
use numpy::{PyArrayDyn, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Numbers<'py> = Bound<'py, PyArrayDyn<f64>>;

/// The index of a medium.
#[derive(FromPyObject)]
pub enum GivenMedium<'py> {
    /// A field.
    Field(Py<Field>),
    /// Samples of n, [z, y, x], in the box.
    Samples(PyReadonlyArray3<'py, f64>),
    /// A constant index.
    Index(f64),
}

/// Surface: point, unit axis, form and departure of a quadric, and the radius of the opening for an
/// aperture.
type GivenElement = ([f64; 3], [f64; 3], [f64; 4], [f64; DEPARTURES], Option<f64>);

/// Media and surfaces that rays pass.
#[derive(FromPyObject)]
pub struct GivenLayout<'py>(
    /// Media: a single medium in a box, or one more than there are refracting surfaces.
    Vec<GivenMedium<'py>>,
    /// Surfaces in the order in which rays meet them; `None` for a box.
    Option<Vec<GivenElement>>,
);

/// Change of media and surfaces: of the parameters of each medium, of each surface, and of the
/// exit.
#[derive(FromPyObject)]
pub struct GivenChange<'py>(
    Vec<PyReadonlyArray1<'py, f64>>,
    PyReadonlyArray2<'py, f64>,
    [f64; 6],
);

/// Dictionary of the region, the exit and the accuracy of rays.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RayOptions {
    /// Corners of the box; `None` for a field without bounds.
    region: Option<([f64; 3], [f64; 3])>,
    /// Index around the box.
    ambient: f64,
    /// True if the outermost samples lie on the faces of the box.
    nodes: bool,
    /// Point and unit normal of the exit; `None` if rays end where they leave the box.
    plane: Option<([f64; 3], [f64; 3])>,
    tolerance: f64,
    max_length: f64,
}

/// Media, surfaces and exit, ready for tracing.
pub(super) struct Course {
    media: Vec<Index>,
    /// Grid of each medium, if it consists of samples.
    grids: Vec<Option<Bspline>>,
    elements: Option<Vec<SequenceElement>>,
    pub(super) region: Aabb,
    ambient: f64,
    pub(super) receiver: Receiver,
    tolerance: Tolerance,
    max_length: f64,
}

impl Course {
    pub(super) fn new(
        py: Python<'_>,
        through: &GivenLayout,
        options: &RayOptions,
    ) -> PyResult<Self> {
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
        let (mut media, mut grids) = (Vec::new(), Vec::new());
        for medium in &through.0 {
            let (index, grid) = match medium {
                GivenMedium::Field(field) => (field.get().index().clone(), None),
                GivenMedium::Index(n) => (Constant::new(*n).into(), None),
                GivenMedium::Samples(samples) => {
                    let samples = samples.as_array();
                    let grid = py.detach(|| spline(samples, region, options.nodes))?;
                    (grid.clone().into(), Some(grid))
                }
            };
            media.push(index);
            grids.push(grid);
        }
        let elements = through.1.as_ref();
        let course = Course {
            media,
            grids,
            elements: elements.map(|elements| elements.iter().map(element).collect()),
            region,
            ambient: options.ambient,
            receiver,
            tolerance: Tolerance::new(options.tolerance),
            max_length: options.max_length,
        };
        match course.layout() {
            Some(_) => Ok(course),
            None => Err(PyValueError::new_err(
                "there must be one medium more than refracting surfaces",
            )),
        }
    }

    /// Returns the layout; `None` if the numbers of media and surfaces do not match.
    pub(super) fn layout(&self) -> Option<Layout<'_>> {
        match (&self.elements, &self.media[..]) {
            (Some(elements), media) => Sequence::new(elements, media).map(Layout::Sequence),
            (None, [field]) => {
                let embedded = Embedded::new(field, self.region, self.ambient);
                Some(Layout::Boxed(Box::new(embedded)))
            }
            _ => None,
        }
    }

    /// Returns true if rays pass through a box.
    pub(super) fn is_boxed(&self) -> bool {
        self.elements.is_none()
    }

    /// Number of sums of derivatives.
    pub(super) fn sum_count(&self) -> usize {
        self.media.iter().map(Index::sum_count).sum()
    }

    pub(super) fn ray<'w>(&self, layout: &'w Layout<'w>) -> AdjointRay<'w, Layout<'w>> {
        AdjointRay::new(layout, self.receiver, self.tolerance, self.max_length)
    }

    /// Converts derivatives for Python: of each medium by its parameters (samples in their shape),
    /// of each surface, of the exit.
    pub(super) fn derivatives<'py>(
        &self,
        py: Python<'py>,
        through: &GivenLayout,
        sums: Sums,
    ) -> PyResult<FoundDerivatives<'py>> {
        let Sums {
            media,
            surfaces,
            exit,
        } = sums;
        let mut fields = Vec::new();
        for (i, sums) in media.into_iter().enumerate() {
            let (by, shape) = match (&through.0[i], &self.grids[i]) {
                (GivenMedium::Samples(samples), Some(grid)) => {
                    let samples = samples.as_array();
                    let squares = grid.sample_derivative(sums).into_iter();
                    let by = squares.zip(samples).map(|(by, n)| by * 2.0 * n);
                    (by.collect(), samples.shape().to_vec())
                }
                _ => {
                    let by = self.media[i].parameter_derivative(sums);
                    let shape = vec![by.len()];
                    (by, shape)
                }
            };
            fields.push(array(py, by, &shape)?);
        }
        let count = surfaces.len();
        let surfaces = array(py, surfaces.into_flattened(), &[count, 10 + DEPARTURES])?;
        Ok((fields, surfaces, exit))
    }

    /// Converts a change from Python for tracing.
    pub(super) fn change<'a>(
        &self,
        layout: &'a Layout<'a>,
        through: &GivenLayout,
        given: &GivenChange,
    ) -> PyResult<LayoutChange<'a>> {
        let mut change = LayoutChange::new(layout, self.receiver);
        let refused = || PyValueError::new_err("changes must have the shapes of what they change");
        for (i, given) in given.0.iter().enumerate() {
            let given = given.as_slice()?;
            let medium = self.media.get(i).ok_or_else(refused)?;
            if given.len() != medium.parameter_count() {
                return Err(refused());
            }
            change.media[i] = match (&through.0[i], &self.grids[i]) {
                (GivenMedium::Samples(samples), Some(grid)) => {
                    let samples = samples.as_array();
                    let squares = given.iter().zip(samples).map(|(of, n)| of * 2.0 * n);
                    grid.sample_change(&squares.collect::<Vec<_>>())
                }
                _ => medium.parameter_change(given),
            };
        }
        let surfaces = given.1.as_array();
        if surfaces.dim() != (change.surfaces.len(), 10 + DEPARTURES) {
            return Err(refused());
        }
        let numbers = change.surfaces.as_flattened_mut().iter_mut();
        numbers.zip(surfaces).for_each(|(to, of)| *to = *of);
        change.exit = given.2;
        Ok(change)
    }
}

/// Derivatives by each medium, each surface, and the exit.
pub(super) type FoundDerivatives<'py> = (Vec<Numbers<'py>>, Numbers<'py>, [f64; 6]);

/// Sums of derivatives, without the layout to which they belong.
#[derive(Default)]
pub(super) struct Sums {
    media: Vec<Vec<f64>>,
    surfaces: Vec<QuadricDerivative>,
    exit: [f64; 6],
}

impl From<LayoutDerivative<'_>> for Sums {
    fn from(of: LayoutDerivative<'_>) -> Self {
        Sums {
            media: of.media,
            surfaces: of.surfaces,
            exit: of.exit,
        }
    }
}

fn element((point, axis, form, departure, radius): &GivenElement) -> SequenceElement {
    let surface = Quadric {
        point: DVec3::from_array(*point),
        axis: DVec3::from_array(*axis),
        form: *form,
        departure: *departure,
    };
    match radius {
        Some(radius) => SequenceElement::Aperture(surface, *radius),
        None => SequenceElement::Refracting(surface),
    }
}

/// Makes the spline through contiguous samples [z, y, x].
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
