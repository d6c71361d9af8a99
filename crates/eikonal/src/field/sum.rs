//! Superposition of fields.

use super::error::{FieldError, positive};
use super::{BoundsOf, Field, Jet};
use crate::bounds::{Aabb, FieldBounds};
use glam::DVec3;

/// Squared index n²(x) = n_ref² + Σ (n_i²(x) − n_ref²): perturbations of a common background n_ref.
///
/// n² is added, not n, so that bounds and derivatives add up too.
#[derive(Clone, Debug)]
pub struct Sum {
    n2_ref: f64,
    terms: Vec<Field>,
}

impl Sum {
    pub(super) fn memory(&self) -> usize {
        self.terms.iter().map(Field::memory).sum()
    }

    /// Creates the superposition of `terms`, each a perturbation of the index `n_ref` > 0.
    ///
    /// # Errors
    ///
    /// A reference index that is not positive and finite.
    pub fn new(n_ref: f64, terms: Vec<Field>) -> Result<Self, FieldError> {
        let n_ref = positive("refractive index of reference", n_ref)?;
        Ok(Sum {
            n2_ref: n_ref * n_ref,
            terms,
        })
    }

    /// Returns n_ref.
    pub(super) fn reference(&self) -> f64 {
        self.n2_ref.sqrt()
    }

    /// Returns the terms.
    pub(super) fn terms(&self) -> impl Iterator<Item = &Field> {
        self.terms.iter()
    }

    /// Returns a sum with `f` applied to each term.
    pub(super) fn map(&self, f: impl Fn(&Field) -> Field) -> Self {
        Sum {
            n2_ref: self.n2_ref,
            terms: self.terms.iter().map(f).collect(),
        }
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        let terms = self.terms.iter();
        terms.fold(self.n2_ref, |n2, t| n2 + (t.n2(x) - self.n2_ref))
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let start = (self.n2_ref, DVec3::ZERO);
        self.terms.iter().fold(start, |(n2, grad), t| {
            let (n2_term, grad_term) = t.gradient(x);
            (n2 + (n2_term - self.n2_ref), grad + grad_term)
        })
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let start = Jet::constant(self.n2_ref);
        self.terms.iter().fold(start, |sum, t| {
            let term = t.jet(x);
            Jet {
                n2: sum.n2 + (term.n2 - self.n2_ref),
                grad: sum.grad + term.grad,
                hess: sum.hess + term.hess,
            }
        })
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        self.bounds_by(region, Field::bounds)
    }

    /// Computes bounds from `inner`, the bounds of the terms: the extreme eigenvalues of a sum lie
    /// between the sums of the extreme eigenvalues (Weyl).
    pub(super) fn bounds_by(&self, region: &Aabb, inner: BoundsOf) -> FieldBounds {
        let start = FieldBounds::constant(self.n2_ref);
        self.terms.iter().fold(start, |sum, t| {
            let term = inner(t, region);
            FieldBounds {
                n2_min: sum.n2_min + (term.n2_min - self.n2_ref),
                n2_max: sum.n2_max + (term.n2_max - self.n2_ref),
                grad_max: sum.grad_max + term.grad_max,
                hess_min: sum.hess_min + term.hess_min,
                hess_max: sum.hess_max + term.hess_max,
            }
        })
    }

    /// Returns the smallest length scale of all terms.
    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        let terms = self.terms.iter();
        terms.fold(f64::INFINITY, |l, t| l.min(t.length_scale(x)))
    }

    /// Returns the smallest length scale of all terms for a velocity.
    pub(super) fn step_scale(&self, x: DVec3, v: DVec3) -> f64 {
        let terms = self.terms.iter();
        terms.fold(f64::INFINITY, |l, t| l.min(t.step_scale(x, v)))
    }

    /// Returns the shortest homogeneous span of all terms.
    pub(super) fn homogeneous_span(&self, x: DVec3, v: DVec3) -> f64 {
        let terms = self.terms.iter();
        terms.fold(f64::INFINITY, |span, t| span.min(t.homogeneous_span(x, v)))
    }

    /// Returns the shortest resolved span of all terms.
    pub(super) fn resolved_span(&self, x: DVec3, v: DVec3) -> f64 {
        let terms = self.terms.iter();
        terms.fold(f64::INFINITY, |span, t| span.min(t.resolved_span(x, v)))
    }

    pub(super) fn is_constant(&self) -> bool {
        self.terms.iter().all(Field::is_constant)
    }
}
