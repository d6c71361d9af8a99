//! Positions of the samples of a grid in space, and of their coefficients in memory.

use crate::bounds::Aabb;
use crate::field::cells;
use crate::field::error::FieldError;
use glam::{DAffine3, DMat3, DVec3};

/// Number of coefficients beyond the outermost samples, at both ends of each axis: one for the
/// spline between the outermost samples, one more for half a voxel beyond them.
pub(super) const PAD: usize = 2;

/// Distance from the outermost samples, in spacings, beyond which the field no longer changes.
const CONSTANT_DISTANCE: f64 = PAD as f64 + 2.0;

/// Placement of samples in the box of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// Samples on the box: the first and the last sample of each axis lie on its faces.
    Nodes,
    /// Samples at the centres of equal voxels that fill the box, half a spacing from its faces.
    Centers,
}

/// Largest number of coefficients stored in rows (16 MiB); larger grids are stored in columns.
const MAX_ROW_COEFFICIENTS: usize = 1 << 22;
/// Width of columns along y and along z, in coefficients.
pub(super) const WIDTH: usize = 4;
/// Number of coefficients of a column at each x: one line of the processor's cache.
pub(super) const SECTION: usize = WIDTH * WIDTH;

/// Smallest number of samples along an axis that a coarser lattice halves.
const MIN_HALVED_SAMPLES: usize = 16;

/// Order of coefficients in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// Rows along x, one after another along y, then z.
    Rows,
    /// Columns of 4 × 4 rows; within a column x is slowest. The coefficients that act at a point
    /// lie in at most 4 runs of memory instead of 16. This is faster if the cache cannot hold all
    /// coefficients.
    Columns,
}

/// A regular grid of samples.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    dims: [usize; 3],
    layout: Layout,
    /// Position of sample 0.
    origin: DVec3,
    spacing: DVec3,
    /// Reciprocal spacing; zero along an axis with one sample, along which the field is constant.
    per_spacing: DVec3,
    /// Coordinates beyond which the field no longer changes.
    limits: [DVec3; 2],
}

impl Lattice {
    pub(super) fn new(
        dims: [usize; 3],
        bounds: Aabb,
        placement: Placement,
    ) -> Result<Self, FieldError> {
        if dims.contains(&0) {
            return Err(FieldError::EmptyGrid { dims });
        }
        let stored = dims.iter().try_fold(size_of::<f32>(), |bytes, &n| {
            bytes.checked_mul(n.checked_add(2 * PAD)?.checked_next_multiple_of(WIDTH)?)
        });
        if stored.is_none_or(|bytes| bytes > isize::MAX as usize) {
            return Err(FieldError::GridTooLarge { dims });
        }
        let (min, max) = (bounds.min, bounds.max);
        if !(bounds.size().is_finite() && min.cmplt(max).all()) {
            return Err(FieldError::BadBox { min, max });
        }
        let count = DVec3::from_array(dims.map(|n| n as f64));
        let (spacing, first) = match placement {
            Placement::Nodes => (bounds.size() / (count - 1.0).max(DVec3::ONE), 0.0),
            Placement::Centers => (bounds.size() / count, 0.5),
        };
        let varies = DVec3::from_array(dims.map(|n| if n > 1 { 1.0 } else { 0.0 }));
        let layout = match dims.map(|n| n + 2 * PAD).iter().product() {
            0..=MAX_ROW_COEFFICIENTS => Layout::Rows,
            _ => Layout::Columns,
        };
        Ok(Lattice {
            dims,
            layout,
            origin: min + spacing * first,
            spacing,
            per_spacing: varies / spacing,
            limits: [
                DVec3::splat(-CONSTANT_DISTANCE),
                count - 1.0 + CONSTANT_DISTANCE,
            ],
        })
    }

    pub(super) fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Returns the number of coefficients along each axis.
    pub(super) fn stored_dims(&self) -> [usize; 3] {
        self.dims.map(|n| n + 2 * PAD)
    }

    /// Returns a lattice with every second sample along the axes with at least
    /// [`MIN_HALVED_SAMPLES`] samples. Returns `None` if there is no such axis. The result is
    /// always in rows.
    pub(super) fn coarser(&self) -> Option<Self> {
        let halved = self.dims.map(|n| n >= MIN_HALVED_SAMPLES);
        let factor = DVec3::from_array(halved.map(|h| if h { 2.0 } else { 1.0 }));
        let half = |n: usize| {
            if n >= MIN_HALVED_SAMPLES {
                n.div_ceil(2)
            } else {
                n
            }
        };
        halved.contains(&true).then(|| Lattice {
            dims: self.dims.map(half),
            layout: Layout::Rows,
            spacing: self.spacing * factor,
            per_spacing: self.per_spacing / factor,
            ..self.clone()
        })
    }

    /// Returns the grid with another order in memory.
    #[cfg(test)]
    pub(super) fn laid_out(self, layout: Layout) -> Self {
        Lattice { layout, ..self }
    }

    pub(super) fn layout(&self) -> Layout {
        self.layout
    }

    /// Returns the number of coefficients along each axis for which there is memory: columns are
    /// complete.
    fn room(&self) -> [usize; 3] {
        let [x, y, z] = self.stored_dims();
        match self.layout {
            Layout::Rows => [x, y, z],
            Layout::Columns => [x, y.next_multiple_of(WIDTH), z.next_multiple_of(WIDTH)],
        }
    }

    /// Returns the number of coefficients for which there is memory.
    pub(super) fn stored(&self) -> usize {
        self.room().iter().product()
    }

    /// Returns the distance from a coefficient to the next along each axis, for the order in rows.
    pub(super) fn strides(&self) -> [usize; 3] {
        let [x, y, _] = self.room();
        [1, x, x * y]
    }

    /// Returns the place of a coefficient, counted from the first stored one, for the order in
    /// rows.
    pub(super) fn offset(&self, index: [usize; 3]) -> usize {
        let strides = self.strides();
        (0..3).map(|axis| index[axis] * strides[axis]).sum()
    }

    /// Returns the number of coefficients of four planes across z, which take equal memory in rows
    /// and in columns.
    pub(super) fn slab(&self) -> usize {
        let [x, y, _] = self.room();
        WIDTH * x * y
    }

    /// Rearranges the coefficients of four planes from rows to columns.
    pub(super) fn arrange(&self, rows: &[f32], columns: &mut [f32]) {
        let [x, y, _] = self.room();
        for (at, row) in rows.chunks_exact(x).enumerate() {
            let start = self.place(1, at % y) + self.place(2, at / y);
            let places = (start..).step_by(SECTION);
            places
                .zip(row)
                .for_each(|(place, value)| columns[place] = *value);
        }
    }

    /// Returns the contribution of an index along an axis, counted from the first stored
    /// coefficient, to the place of a coefficient in the final order.
    #[inline(always)]
    pub(super) fn place(&self, axis: usize, i: usize) -> usize {
        if self.layout == Layout::Rows {
            return i * self.strides()[axis];
        }
        let [x, y, _] = self.room();
        match axis {
            0 => i * SECTION,
            1 => i / WIDTH * (x * SECTION) + i % WIDTH,
            _ => i / WIDTH * (x * y * WIDTH) + i % WIDTH * WIDTH,
        }
    }

    pub(super) fn position(&self, sample: [usize; 3]) -> DVec3 {
        self.origin + self.spacing * DVec3::from_array(sample.map(|i| i as f64))
    }

    pub(super) fn per_spacing(&self) -> DVec3 {
        self.per_spacing
    }

    pub(super) fn spacing(&self) -> DVec3 {
        self.spacing
    }

    /// Returns the distance from the first sample to the last.
    pub(super) fn size(&self) -> f64 {
        self.position(self.dims.map(|n| n - 1))
            .distance(self.origin)
    }

    /// Returns the position in units of the spacing from sample 0, clamped to the range where the
    /// field changes.
    pub(super) fn coordinates(&self, x: DVec3) -> DVec3 {
        // Map NaN, which ∞ becomes along a constant axis, to the limit.
        let [low, high] = self.limits;
        ((x - self.origin) * self.per_spacing).max(low).min(high)
    }

    /// Returns the map from positions to indices of coefficients, counted from the first stored
    /// coefficient.
    pub(super) fn to_index(&self) -> DAffine3 {
        let first = DVec3::splat(PAD as f64) - self.origin * self.per_spacing;
        DAffine3::from_mat3_translation(DMat3::from_diagonal(self.per_spacing), first)
    }

    /// Returns the index of the first of the four coefficients that act at a position, along each
    /// axis, counted from the first stored coefficient. Also returns the position within the cell,
    /// as fractions in [0, 1]. On a knot it returns the cell before or after the knot; both give
    /// equal values.
    #[inline(always)]
    pub(super) fn locate(&self, x: DVec3) -> ([isize; 3], DVec3) {
        let (cell, fraction) = cells::located(self.coordinates(x));
        (cell.map(first_coefficient), fraction)
    }

    /// Returns true if the four coefficients from each of `first` on are stored.
    #[inline(always)]
    pub(super) fn inside(&self, first: [isize; 3]) -> bool {
        let [x, y, z] = self.dims.map(|n| n + 2 * PAD - 4);
        // Negative indices become large and fail the test.
        let [i, j, k] = first.map(|i| i as usize);
        (i <= x) & (j <= y) & (k <= z)
    }

    /// Returns the index along `axis` of the stored coefficient that replaces index `i`. Both count
    /// from the first stored coefficient; `i` may lie outside the stored range.
    pub(super) fn clamp(&self, axis: usize, i: isize) -> usize {
        i.clamp(0, (self.dims[axis] + 2 * PAD - 1) as isize) as usize
    }
}

/// Returns the coordinate `t` rounded down.
pub(super) fn cell(t: f64) -> isize {
    t.floor() as isize
}

/// Returns the index of the first of the four coefficients that act in `cell`, counted from the
/// first stored coefficient.
pub(super) fn first_coefficient(cell: isize) -> isize {
    cell - 1 + PAD as isize
}
