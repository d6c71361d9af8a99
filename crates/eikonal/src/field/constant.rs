//! Constant index, n(x) = n₀.

use super::Jet;
use crate::bounds::{Aabb, FieldBounds};
use glam::{DMat3, DVec3};

/// A field of constant index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    n2: f64,
    /// Index √n², stored because straight rays need it very often.
    n: f64,
}

impl Constant {
    /// Creates the field n(x) = `n`, positive and finite. A negative `n` makes n² negative; scenes
    /// reject it, and no ray can be traced.
    pub fn new(n: f64) -> Self {
        let n2 = n * n.abs();
        Constant { n2, n: n2.sqrt() }
    }

    pub(super) fn n2(&self, _: DVec3) -> f64 {
        self.n2
    }

    pub(super) fn n(&self) -> f64 {
        self.n
    }

    pub(super) fn gradient(&self, _: DVec3) -> (f64, DVec3) {
        (self.n2, DVec3::ZERO)
    }

    pub(super) fn jet(&self, _: DVec3) -> Jet {
        Jet {
            n2: self.n2,
            grad: DVec3::ZERO,
            hess: DMat3::ZERO,
        }
    }

    pub(super) fn bounds(&self, _: &Aabb) -> FieldBounds {
        FieldBounds::constant(self.n2)
    }

    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        f64::INFINITY
    }

    pub(super) fn is_constant(&self) -> bool {
        true
    }
}
