//! Index of a grid, which all wavelengths of a film share.

use eikonal::field::Bspline;
use glam::DAffine3;
use std::sync::Arc;

/// Index of a grid, with the law of its samples.
#[derive(Clone)]
pub(super) struct IndexGrid {
    /// Index before `rest` is applied.
    pub spline: Arc<Bspline>,
    /// Transform of the spline that remains to be done while rays are traced.
    pub rest: Option<DAffine3>,
    /// Law of the samples; `None` if they are the index itself.
    pub law: Option<Law>,
    /// Least and largest sample, if there are any.
    pub range: Option<[f64; 2]>,
}

/// Law that converts a sample q to an index: n = `n0` + `slope` (q − `reference`).
#[derive(Clone, Copy)]
pub(super) struct Law {
    /// Index at the reference.
    pub n0: f64,
    /// Change of the index per unit of the samples.
    pub slope: f64,
    /// Sample at which the index is `n0`.
    pub reference: f64,
}

impl Law {
    /// Returns the index of a sample.
    pub(super) fn index(&self, q: f64) -> f64 {
        self.n0 + self.slope * (q - self.reference)
    }
}
