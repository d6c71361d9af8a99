//! Where the samples of a grid lie in space and where their coefficients lie in memory.

use crate::bounds::Aabb;
use crate::field::error::FieldError;
use glam::DVec3;

/// Coefficients beyond the outermost samples, at both ends of each axis: one for the spline between
/// the outermost samples, one more for half a voxel beyond them.
pub(super) const PAD: usize = 2;

/// Spacings beyond the outermost samples from which on the field no longer changes.
const BEYOND: f64 = PAD as f64 + 2.0;

/// What a coordinate of zero becomes in `LAST_BIT`: coordinates are at least −`BEYOND`, and their halves
/// rounded down must be positive.
const ORIGIN: isize = 8;
/// A number whose last bit is worth 1, so far from powers of two that sums with coordinates are, too.
const LAST_BIT: f64 = 6_755_399_441_055_744.0 + ORIGIN as f64;
/// The bits of such a sum that count from 1.5·2⁵².
const INTEGER: u64 = (1 << 51) - 1;

/// Where samples lie in the box of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// On the box: the first and the last sample of each axis on its faces.
    Nodes,
    /// At the centres of equal voxels that fill the box, half a spacing from its faces.
    Centers,
}

/// A regular grid of samples.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    dims: [usize; 3],
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
            bytes.checked_mul(n.checked_add(2 * PAD)?)
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
        Ok(Lattice {
            dims,
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

    /// Number of coefficients.
    pub(super) fn stored(&self) -> usize {
        self.stored_dims().iter().product()
    }

    /// Distance in memory from a coefficient to the next along each axis.
    pub(super) fn strides(&self) -> [usize; 3] {
        let [x, y, _] = self.stored_dims();
        [1, x, x * y]
    }

    /// Place in memory of a coefficient, counted from the first stored one.
    pub(super) fn offset(&self, [i, j, k]: [usize; 3]) -> usize {
        let [x, y, _] = self.stored_dims();
        (k * y + j) * x + i
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
    /// stored one, and the fraction of the cell there, in [0, 1].
    ///
    /// Rounding down is done by additions: added to `LAST_BIT`, a number is rounded to an integer, which
    /// the last bits of the sum hold. This takes a tenth of the instructions of conversions that
    /// saturate. On a knot the cell before or the one after it is taken; their values are the same.
    #[inline(always)]
    pub(super) fn locate(&self, x: DVec3) -> ([isize; 3], DVec3) {
        let t = self.coordinates(x);
        let sum = (t - 0.5) + LAST_BIT;
        let fraction = t - (sum - LAST_BIT);
        let integer = |sum: f64| (sum.to_bits() & INTEGER) as isize - ORIGIN;
        let first = sum.to_array().map(|s| first_coefficient(integer(s)));
        (first, fraction)
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
