//! Where the samples of a grid lie in space and where their coefficients lie in memory.

use crate::bounds::Aabb;
use crate::field::cells;
use crate::field::error::FieldError;
use glam::DVec3;

/// Coefficients beyond the outermost samples, at both ends of each axis: one for the spline between
/// the outermost samples, one more for half a voxel beyond them.
pub(super) const PAD: usize = 2;

/// Spacings beyond the outermost samples from which on the field no longer changes.
const BEYOND: f64 = PAD as f64 + 2.0;

/// Where samples lie in the box of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// On the box: the first and the last sample of each axis on its faces.
    Nodes,
    /// At the centres of equal voxels that fill the box, half a spacing from its faces.
    Centers,
}

/// More coefficients than this (16 MiB) are kept in columns.
const FEW: usize = 1 << 22;
/// Columns are so many coefficients wide along y and along z.
pub(super) const WIDTH: usize = 4;
/// Coefficients of a column at each x: one line of the processor's cache.
pub(super) const SECTION: usize = WIDTH * WIDTH;

/// From so many samples on along an axis, there are coarser lattices.
const MANY: usize = 16;

/// The order of coefficients in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// Rows along x, one after another along y, then z.
    Rows,
    /// Columns of 4 × 4 rows; within a column x is slowest. The coefficients that act at a point lie in at most 4 runs
    /// of memory, not in 16, which pays where the cache does not hold them.
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
    /// 1/spacing; zero along an axis with one sample, along which nothing changes.
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
            0..=FEW => Layout::Rows,
            _ => Layout::Columns,
        };
        Ok(Lattice {
            dims,
            layout,
            origin: min + spacing * first,
            spacing,
            per_spacing: varies / spacing,
            limits: [DVec3::splat(-BEYOND), count - 1.0 + BEYOND],
        })
    }

    pub(super) fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Number of coefficients along each axis.
    pub(super) fn stored_dims(&self) -> [usize; 3] {
        self.dims.map(|n| n + 2 * PAD)
    }

    /// Every second sample along the axes that have many; `None` if none has. Always in rows.
    pub(super) fn coarser(&self) -> Option<Self> {
        let halved = self.dims.map(|n| n >= MANY);
        let factor = DVec3::from_array(halved.map(|h| if h { 2.0 } else { 1.0 }));
        let half = |n: usize| if n >= MANY { n.div_ceil(2) } else { n };
        halved.contains(&true).then(|| Lattice {
            dims: self.dims.map(half),
            layout: Layout::Rows,
            spacing: self.spacing * factor,
            per_spacing: self.per_spacing / factor,
            ..self.clone()
        })
    }

    /// The same grid with another order in memory.
    #[cfg(test)]
    pub(super) fn laid_out(self, layout: Layout) -> Self {
        Lattice { layout, ..self }
    }

    pub(super) fn layout(&self) -> Layout {
        self.layout
    }

    /// Coefficients along each axis for which there is memory: columns are whole.
    fn room(&self) -> [usize; 3] {
        let [x, y, z] = self.stored_dims();
        match self.layout {
            Layout::Rows => [x, y, z],
            Layout::Columns => [x, y.next_multiple_of(WIDTH), z.next_multiple_of(WIDTH)],
        }
    }

    /// Number of coefficients for which there is memory.
    pub(super) fn stored(&self) -> usize {
        self.room().iter().product()
    }

    /// Distance from a coefficient to the next along each axis, as long as they lie in rows.
    pub(super) fn strides(&self) -> [usize; 3] {
        let [x, y, _] = self.room();
        [1, x, x * y]
    }

    /// Place of a coefficient, counted from the first stored one, as long as they lie in rows.
    pub(super) fn offset(&self, index: [usize; 3]) -> usize {
        let strides = self.strides();
        (0..3).map(|axis| index[axis] * strides[axis]).sum()
    }

    /// Number of coefficients of four planes across z, which take the same memory in rows and in columns.
    pub(super) fn slab(&self) -> usize {
        let [x, y, _] = self.room();
        WIDTH * x * y
    }

    /// Brings the coefficients of four planes, in rows, into the order of columns.
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

    /// What an index along an axis, counted from the first stored one, adds to the place of a coefficient in the
    /// final order.
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

    /// Distance from the first sample to the last.
    pub(super) fn size(&self) -> f64 {
        self.position(self.dims.map(|n| n - 1))
            .distance(self.origin)
    }

    /// Position in units of the spacing from sample 0, limited to where the field still changes.
    pub(super) fn coordinates(&self, x: DVec3) -> DVec3 {
        // Of NaN, which ∞ becomes along an axis that does not change, the limit is taken.
        let [low, high] = self.limits;
        ((x - self.origin) * self.per_spacing).max(low).min(high)
    }

    /// The first of the four coefficients that act at a position along each axis, counted from the first
    /// stored one, and the fraction of the cell there, in [0, 1]. On a knot the cell before or the one after it is taken;
    /// their values are the same.
    #[inline(always)]
    pub(super) fn locate(&self, x: DVec3) -> ([isize; 3], DVec3) {
        let (cell, fraction) = cells::located(self.coordinates(x));
        (cell.map(first_coefficient), fraction)
    }

    /// Whether the four coefficients from each of `first` on are stored.
    #[inline(always)]
    pub(super) fn inside(&self, first: [isize; 3]) -> bool {
        let [x, y, z] = self.dims.map(|n| n + 2 * PAD - 4);
        // What is negative is more than that.
        let [i, j, k] = first.map(|i| i as usize);
        (i <= x) & (j <= y) & (k <= z)
    }

    /// Index along `axis` of the stored coefficient that stands for index `i`, which is counted
    /// from the first stored one and may lie outside.
    pub(super) fn clamp(&self, axis: usize, i: isize) -> usize {
        i.clamp(0, (self.dims[axis] + 2 * PAD - 1) as isize) as usize
    }
}

/// The coordinate `t` rounded down.
pub(super) fn cell(t: f64) -> isize {
    t.floor() as isize
}

/// First of the four coefficients, counted from the first stored one, that act in `cell`.
pub(super) fn first_coefficient(cell: isize) -> isize {
    cell - 1 + PAD as isize
}
