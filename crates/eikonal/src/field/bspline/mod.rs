//! Sampled fields: a tricubic B-spline through the samples.

mod blocks;
mod bounds;
mod calm;
mod evaluate;
mod lattice;
mod prefilter;
mod scales;
mod weights;

pub use lattice::Placement;

use super::error::FieldError;
use crate::bounds::Aabb;
use blocks::Blocks;
use calm::Calm;
use fearless_simd::Level;
use glam::DVec3;
use lattice::{Lattice, PAD};
use scales::Scales;
use std::sync::{Arc, OnceLock};

/// δ = n² − n_ref² as the tricubic B-spline that interpolates samples on a regular grid: C², of
/// order four in the spacing away from the faces and of order three on them (Unser, Aldroubi and
/// Eden 1991; on GPUs Ruijters and Thévenaz 2012).
///
/// Quadratic n², hence a Luneburg lens or a graded rod, is reproduced exactly up to the faces,
/// cubic n² away from them: at either end of a line the third difference of the coefficients
/// vanishes. The more usual mirror condition would flatten the field at every wall.
///
/// **Outside** the samples the spline continues quadratically for one spacing. Beyond, the outermost
/// coefficients repeat: still C² and free of NaN, the field bends within four spacings to a value
/// that no longer changes along the normal. Rays should not go there, and bounds taken there are
/// those of the bend.
///
/// Coefficients are kept as f32, four bytes a sample, and n_ref² as f64, so that contrasts far below
/// the f32 resolution of n itself survive. Along an axis with one sample the field is constant.
#[derive(Clone, Debug)]
pub struct Bspline {
    lattice: Lattice,
    n2_ref: f64,
    /// Coefficients of δ, with `PAD` extra ones at both ends of each axis, in the order of the lattice.
    /// Shared by copies of the field.
    coefficients: Arc<[f32]>,
    /// None if the field is constant. Shared by copies of the field.
    scales: Option<Arc<Scales>>,
    /// None if it changes everywhere. Shared by copies of the field.
    calm: Option<Arc<Calm>>,
    /// The vector instructions that the processor has.
    level: Level,
    /// Made when bounds over a large box are first asked for.
    blocks: OnceLock<Blocks>,
}

impl Bspline {
    pub(super) fn memory(&self) -> usize {
        let blocks = self.blocks.get().map_or(0, Blocks::memory);
        let scales = self.scales.as_ref().map_or(0, |s| s.memory());
        let calm = self.calm.as_ref().map_or(0, |c| c.memory());
        self.coefficients.len() * size_of::<f32>() + blocks + scales + calm
    }

    /// A field through `samples` of n (f32 or f64), x fastest, then y, then z, of a grid of `dims`
    /// samples in the box `bounds`.
    ///
    /// With f32 samples of n the rounding of n, 6e-8, is amplified by 1/spacing² in the Hessian;
    /// give small contrasts as f64.
    pub fn from_samples<T: Copy + Into<f64>>(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        samples: &[T],
    ) -> Result<Self, FieldError> {
        let lattice = Lattice::new(dims, bounds, placement)?;
        let expected = dims[0] * dims[1] * dims[2];
        if samples.len() != expected {
            return Err(FieldError::SampleCount {
                dims,
                expected,
                actual: samples.len(),
            });
        }
        Self::build(lattice, |[i, j, k]| {
            samples[(k * dims[1] + j) * dims[0] + i].into()
        })
    }

    /// As [`Bspline::from_samples`], with samples n = `index(x)` taken where the grid has them.
    pub fn from_fn(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
        mut index: impl FnMut(DVec3) -> f64,
    ) -> Result<Self, FieldError> {
        let lattice = Lattice::new(dims, bounds, placement)?;
        let positions = lattice.clone();
        Self::build(lattice, |sample| index(positions.position(sample)))
    }

    fn build(
        lattice: Lattice,
        mut index: impl FnMut([usize; 3]) -> f64,
    ) -> Result<Self, FieldError> {
        let dims = lattice.dims();
        let mut n2_at = |sample| square(sample, index(sample));
        // The corners of a grid often hold an outside medium of no interest: the middle does not.
        let n2_ref = n2_at(dims.map(|n| n / 2))?;
        let mut coefficients = vec![0.0_f32; lattice.stored()];
        let mut constant = true;
        for k in 0..dims[2] {
            for j in 0..dims[1] {
                let row = lattice.offset([PAD, j + PAD, k + PAD]);
                for (i, slot) in coefficients[row..row + dims[0]].iter_mut().enumerate() {
                    let delta = n2_at([i, j, k])? - n2_ref;
                    constant &= delta == 0.0;
                    *slot = delta as f32;
                }
            }
        }
        if !constant {
            prefilter::prefilter(&lattice, &mut coefficients);
        }
        let scales = (!constant).then(|| Arc::new(Scales::new(&lattice, &coefficients, n2_ref)));
        let calm = Calm::new(&lattice, &coefficients).filter(|_| !constant);
        lattice.arrange(&mut coefficients);
        Ok(Bspline {
            scales,
            calm: calm.map(Arc::new),
            lattice,
            n2_ref,
            coefficients: coefficients.into(),
            level: crate::lanes::level(),
            blocks: OnceLock::new(),
        })
    }

    /// See [`Scales`].
    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        let scales = self.scales.as_ref();
        scales.map_or(f64::INFINITY, |s| s.at(self.lattice.coordinates(x)))
    }

    /// See [`Calm::span`].
    pub(super) fn calm_span(&self, x: DVec3, v: DVec3) -> f64 {
        let (lattice, calm) = (&self.lattice, self.calm.as_ref());
        calm.map_or(0.0, |c| {
            c.span(lattice.coordinates(x), v * lattice.per_spacing())
        })
    }

    /// Two cells along the axis that a ray runs along the fastest: a basis function reaches over four.
    pub(super) fn resolved_span(&self, v: DVec3) -> f64 {
        2.0 / (v * self.lattice.per_spacing()).abs().max_element()
    }

    pub(super) fn is_constant(&self) -> bool {
        self.scales.is_none()
    }
}

/// n² of a sample that is an index.
fn square(index: [usize; 3], n: f64) -> Result<f64, FieldError> {
    if n.is_finite() && n > 0.0 {
        Ok(n * n)
    } else {
        Err(FieldError::BadSample { index, value: n })
    }
}
