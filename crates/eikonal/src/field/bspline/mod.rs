//! Sampled fields: tricubic B-splines through samples (docs/theory.md#sampled-fields).

mod blocks;
mod bounds;
mod complex;
mod condense;
mod evaluate;
mod homogeneous;
mod lattice;
mod memory;
mod noise;
mod prefilter;
mod scales;
mod smooth;
mod thinned;
mod transpose;
mod values;
mod weights;

pub(super) use complex::ComplexBspline;
pub use lattice::Placement;
pub use noise::NoiseShares;

use super::error::{FieldError, not_negative};
use crate::bounds::{Aabb, FieldBounds};
use blocks::{Blocks, Cells};
use fearless_simd::Level;
use glam::{DAffine3, DVec3};
use homogeneous::HomogeneousBlocks;
use lattice::{Lattice, PAD};
use memory::Coefficients;
use scales::Scales;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

/// Contrast δ = n² − n_ref² as the tricubic B-spline that interpolates samples on a regular grid.
/// It is C² (Unser, Aldroubi and Eden 1991; on GPUs Ruijters and Thévenaz 2012). Its error is of
/// order four in the spacing away from the faces, and of order three on the faces.
///
/// Quadratic n², as in a Luneburg lens or a graded rod, is reproduced exactly up to the faces, and
/// cubic n² away from them. At either end of a line the third difference of the coefficients
/// vanishes. The more usual mirror condition would flatten the field at every wall.
///
/// **Outside** the samples the spline continues quadratically for one spacing. Beyond, the
/// outermost coefficients repeat, and the field is still C² and free of NaN. Within four spacings
/// it bends to a value that no longer changes along the normal. Rays should not go there; bounds
/// there are bounds of this bend.
///
/// Coefficients are stored as f32, four bytes a sample, and n_ref² as f64. Contrasts far below the
/// f32 resolution of n itself are therefore represented. Along an axis with one sample the field is
/// constant.
#[derive(Clone, Debug)]
pub struct Bspline {
    lattice: Lattice,
    n2_ref: f64,
    /// Coefficients of δ, with `PAD` extra coefficients at both ends of each axis, in the order of
    /// the lattice. Copies of the field share them.
    coefficients: Arc<Coefficients>,
    /// Length scales; `None` if the field is constant. Copies of the field share them.
    scales: Option<Arc<Scales>>,
    /// Homogeneous blocks; `None` if the field changes everywhere. Copies of the field share them.
    homogeneous: Option<Arc<HomogeneousBlocks>>,
    /// True if the spline passes through the samples; false if it deviates from them by their
    /// noise.
    interpolates: bool,
    /// Vector instructions of the processor.
    level: Level,
    /// Bounds over blocks, computed when bounds over a large box are first needed. Copies of the
    /// field share them.
    blocks: Arc<OnceLock<Blocks>>,
    /// Stored bounds over ranges of cells. Copies of the field share them.
    bounds: Arc<Mutex<BTreeMap<Cells, FieldBounds>>>,
}

impl Bspline {
    pub(super) fn memory(&self) -> usize {
        let blocks = self.blocks.get().map_or(0, Blocks::memory);
        let scales = self.scales.as_ref().map_or(0, |s| s.memory());
        let homogeneous = self.homogeneous.as_ref().map_or(0, |c| c.memory());
        let bounds = self.stored().len() * size_of::<(Cells, FieldBounds)>();
        self.coefficients.len() * size_of::<f32>() + blocks + scales + homogeneous + bounds
    }

    /// Creates a field from `samples` of n (f32 or f64), x fastest, then y, then z. The grid has
    /// `dims` samples in the box `bounds`.
    ///
    /// With f32 samples of n, 1/spacing² amplifies the rounding of n, 6e-8, in the Hessian
    /// ([`Bspline::noise_shares`]). Pass small contrasts as f64, or smooth them.
    ///
    /// # Errors
    ///
    /// A grid without samples, or too large for memory; a box that is not finite or has no volume;
    /// a wrong number of samples; samples that are not positive and finite.
    pub fn from_samples<T: Copy + Into<f64>>(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        samples: &[T],
    ) -> Result<Self, FieldError> {
        Self::smoothed(dims, bounds, placement, samples, 0.0)
    }

    /// Creates a field like [`Bspline::from_samples`], which deviates from samples with noise of
    /// the standard deviation `noise`: see [`Bspline::from_vec`].
    ///
    /// # Errors
    ///
    /// Errors of [`Bspline::from_samples`]; a noise that is negative or not finite.
    pub fn smoothed<T: Copy + Into<f64>>(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        samples: &[T],
        noise: f64,
    ) -> Result<Self, FieldError> {
        let double = size_of::<T>() > size_of::<f32>();
        let sampling = Sampling { noise, double };
        Self::converted(dims, bounds, placement, samples, sampling, |n| (*n).into())
    }

    /// Creates a field like [`Bspline::smoothed`] through `index` of each sample, without a copy of
    /// the samples.
    pub(in crate::field) fn converted<T>(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        samples: &[T],
        sampling: Sampling,
        index: impl Fn(&T) -> f64,
    ) -> Result<Self, FieldError> {
        let lattice = Lattice::new(dims, bounds, placement)?;
        check_count(dims, samples.len())?;
        not_negative(NOISE, sampling.noise)?;
        Self::build(lattice, sampling, |[i, j, k]| {
            index(&samples[(k * dims[1] + j) * dims[0] + i])
        })
    }

    /// Creates a field like [`Bspline::from_samples`], with samples n = `index(x)` at the positions
    /// of the grid.
    ///
    /// # Errors
    ///
    /// Errors of [`Bspline::from_samples`].
    pub fn from_fn(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        mut index: impl FnMut(DVec3) -> f64,
    ) -> Result<Self, FieldError> {
        let lattice = Lattice::new(dims, bounds, placement)?;
        let positions = lattice.clone();
        let sampling = Sampling {
            noise: 0.0,
            double: true,
        };
        Self::build(lattice, sampling, |sample| {
            index(positions.position(sample))
        })
    }

    /// Returns the number of coefficients of a grid of `dims` samples; zero for an invalid grid.
    /// [`Bspline::from_vec`] does not reallocate a vector of samples with this capacity.
    pub fn room(dims: [usize; 3]) -> usize {
        let cube = Aabb::new(DVec3::ZERO, DVec3::ONE);
        Lattice::new(dims, cube, Placement::Centers).map_or(0, |lattice| lattice.stored())
    }

    /// Creates a field like [`Bspline::from_samples`] in the memory of the samples, with n =
    /// `index`(sample). With `noise` > 0, the standard deviation of noise in n, the spline deviates
    /// from the samples by this noise (`smooth.rs`) instead of passing through them.
    ///
    /// # Errors
    ///
    /// Errors of [`Bspline::smoothed`].
    pub fn from_vec(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        samples: Vec<f32>,
        index: impl Fn(f64) -> f64,
        noise: f64,
    ) -> Result<Self, FieldError> {
        let lattice = Lattice::new(dims, bounds, placement)?;
        check_count(dims, samples.len())?;
        let noise = not_negative(NOISE, noise)?;
        let [x, y, z] = dims;
        let n2 = |sample: [usize; 3], v: f32| square(sample, index(f64::from(v)));
        let middle = dims.map(|n| n / 2);
        let n2_ref = n2(middle, samples[(middle[2] * y + middle[1]) * x + middle[0]])?;
        let mut data = samples;
        data.reserve_exact(lattice.stored().saturating_sub(data.len()));
        data.resize(lattice.stored(), 0.0);
        // Start from the back, so that nothing is overwritten before it has been moved.
        let (mut constant, mut end) = (true, data.len());
        for row in (0..y * z).rev() {
            let (j, k) = (row % y, row / y);
            let start = lattice.offset([PAD, j + PAD, k + PAD]);
            data.copy_within(row * x..(row + 1) * x, start);
            data[start + x..end].fill(0.0);
            for (i, v) in data[start..start + x].iter_mut().enumerate() {
                let delta = n2([i, j, k], *v)? - n2_ref;
                constant &= delta == 0.0;
                *v = delta as f32;
            }
            end = start;
        }
        data[..end].fill(0.0);
        Ok(Self::of_contrasts(lattice, n2_ref, data, constant, noise))
    }

    fn build(
        lattice: Lattice,
        sampling: Sampling,
        mut index: impl FnMut([usize; 3]) -> f64,
    ) -> Result<Self, FieldError> {
        let dims = lattice.dims();
        let mut n2_at = |sample| square(sample, index(sample));
        // Take the reference from the middle: the corners of a grid often hold an outside medium of
        // no interest.
        let n2_ref = n2_at(dims.map(|n| n / 2))?;
        let mut data: Vec<f32> = Vec::new();
        let room = data.try_reserve_exact(lattice.stored());
        room.map_err(|_| FieldError::GridTooLarge { dims })?;
        data.resize(lattice.stored(), 0.0);
        // Compute contrasts plane by plane; in double precision without noise, filter each plane.
        let mut plane = vec![0.0; lattice.strides()[2]];
        let by_planes = sampling.double && sampling.noise == 0.0;
        let mut constant = true;
        for k in 0..dims[2] {
            for j in 0..dims[1] {
                let row = lattice.offset([PAD, j + PAD, 0]);
                for (i, slot) in plane[row..row + dims[0]].iter_mut().enumerate() {
                    let delta = n2_at([i, j, k])? - n2_ref;
                    constant &= delta == 0.0;
                    *slot = delta;
                }
            }
            if by_planes {
                prefilter::plane(&lattice, &mut plane);
            }
            let stored = &mut data[lattice.offset([0, 0, k + PAD])..];
            let places = stored.iter_mut().zip(&plane);
            places.for_each(|(slot, v)| *slot = *v as f32);
        }
        if by_planes && !constant {
            prefilter::planes(&lattice, &mut data);
            return Ok(Self::of_coefficients(
                lattice,
                n2_ref,
                data,
                Some(ROUNDINGS),
            ));
        }
        let Sampling { noise, .. } = sampling;
        Ok(Self::of_contrasts(lattice, n2_ref, data, constant, noise))
    }

    /// Creates a field from samples of δ in rows, in their places among the coefficients, with
    /// noise in n.
    fn of_contrasts(
        lattice: Lattice,
        n2_ref: f64,
        mut data: Vec<f32>,
        constant: bool,
        noise: f64,
    ) -> Self {
        if !constant {
            prefilter::prefilter(&lattice, &mut data, 2.0 * n2_ref.sqrt() * noise);
        }
        let roundings = (!constant).then_some(1.0);
        Bspline {
            interpolates: noise == 0.0,
            ..Self::of_coefficients(lattice, n2_ref, data, roundings)
        }
    }

    /// Creates a field from coefficients in rows, with rounding errors of `roundings` halves of the
    /// last bit; `None` for a constant field.
    fn of_coefficients(
        lattice: Lattice,
        n2_ref: f64,
        data: Vec<f32>,
        roundings: Option<f64>,
    ) -> Self {
        let scales = roundings.map(|r| Arc::new(Scales::new(&lattice, &data, n2_ref, r)));
        let homogeneous = HomogeneousBlocks::new(&lattice, &data).filter(|_| scales.is_some());
        let coefficients = Coefficients::new(&lattice, data);
        Bspline {
            scales,
            homogeneous: homogeneous.map(Arc::new),
            lattice,
            n2_ref,
            coefficients: Arc::new(coefficients),
            interpolates: true,
            level: crate::lanes::level(),
            blocks: Arc::default(),
            bounds: Arc::default(),
        }
    }

    /// Returns the coefficients of δ, in rows.
    pub(super) fn coefficients(&self) -> SplineCoefficients {
        let [x, y, z] = self.lattice.stored_dims();
        let place = |axis, i| self.lattice.place(axis, i);
        let mut values = Vec::with_capacity(x * y * z);
        for (k, j) in (0..z).flat_map(|k| (0..y).map(move |j| (k, j))) {
            let row = place(1, j) + place(2, k);
            values.extend((0..x).map(|i| self.coefficients[row + place(0, i)]));
        }
        SplineCoefficients {
            dims: [x, y, z],
            values,
            n2_ref: self.n2_ref,
            to_index: self.lattice.to_index(),
        }
    }

    /// Returns the length scale, see [`Scales`].
    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        let scales = self.scales.as_ref();
        scales.map_or(f64::INFINITY, |s| s.at(self.lattice.coordinates(x)))
    }

    /// Returns the homogeneous span, see [`HomogeneousBlocks::span`].
    pub(super) fn homogeneous_span(&self, x: DVec3, v: DVec3) -> f64 {
        let homogeneous = self.homogeneous.as_ref();
        homogeneous.map_or(0.0, |blocks| blocks.span(x, v))
    }

    /// Returns the span of two cells along the axis along which a ray is fastest; a basis function
    /// extends over four cells.
    pub(super) fn resolved_span(&self, v: DVec3) -> f64 {
        2.0 / (v * self.lattice.per_spacing()).abs().max_element()
    }

    pub(super) fn is_constant(&self) -> bool {
        self.scales.is_none()
    }
}

/// Coefficients of a [`Bspline`]: n² = n_ref² + Σ c_ijk β(u − i) β(v − j) β(w − k) with the cubic
/// B-spline β.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineCoefficients {
    /// Number of coefficients along x, y, z.
    pub dims: [usize; 3],
    /// Coefficients of n² − n_ref², x fastest.
    pub values: Vec<f32>,
    /// Reference n_ref².
    pub n2_ref: f64,
    /// Map from positions to (u, v, w). It is singular along axes with one sample.
    pub to_index: DAffine3,
}

/// Properties of samples.
#[derive(Clone, Copy)]
pub(super) struct Sampling {
    /// Standard deviation of the noise.
    pub noise: f64,
    /// True if the samples have double precision.
    pub double: bool,
}

/// Rounding of coefficients of samples in double precision, in halves of the last bit. Coefficients
/// are rounded before the filter along z, which amplifies the rounding up to three times, and after
/// it.
const ROUNDINGS: f64 = 4.0;
/// Name of the noise in errors.
const NOISE: &str = "noise of samples";

fn check_count(dims: [usize; 3], actual: usize) -> Result<(), FieldError> {
    let expected = dims.iter().product();
    if actual == expected {
        Ok(())
    } else {
        Err(FieldError::SampleCount {
            dims,
            expected,
            actual,
        })
    }
}

/// Returns n² of a sample n; an error if n is not an index.
fn square(index: [usize; 3], n: f64) -> Result<f64, FieldError> {
    if n.is_finite() && n > 0.0 {
        Ok(n * n)
    } else {
        Err(FieldError::BadSample { index, value: n })
    }
}
