//! Refractive-index fields. Each supplies n², ∇n², Hess n² and conservative bounds over boxes.

mod constant;

pub use constant::Constant;

use crate::bounds::{Aabb, FieldBounds};
use glam::{DMat3, DVec3};

/// Value and derivatives of n² at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// n².
    pub n2: f64,
    /// ∇n².
    pub grad: DVec3,
    /// Hess n² (symmetric).
    pub hess: DMat3,
}

/// A refractive-index field, a smooth function of position in scene units.
#[derive(Clone, Debug)]
pub enum Field {
    /// The same index everywhere.
    Constant(Constant),
}

/// Calls the same method on whichever field this is.
macro_rules! each {
    ($self:expr, $f:ident => $e:expr) => {
        match $self {
            Field::Constant($f) => $e,
        }
    };
}

impl Field {
    /// n² at `x`.
    pub fn n2(&self, x: DVec3) -> f64 {
        each!(self, f => f.n2(x))
    }

    /// The index n at `x`; NaN where n² < 0.
    pub fn n(&self, x: DVec3) -> f64 {
        self.n2(x).sqrt()
    }

    /// n² and ∇n² at `x`.
    pub fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        each!(self, f => f.gradient(x))
    }

    /// n², ∇n² and Hess n² at `x`.
    pub fn jet(&self, x: DVec3) -> Jet {
        each!(self, f => f.jet(x))
    }

    /// Conservative bounds over a box.
    pub fn bounds(&self, region: &Aabb) -> FieldBounds {
        each!(self, f => f.bounds(region))
    }

    /// The local length scale: a step of a fraction of it cannot jump over a feature of the
    /// field. A 1-Lipschitz function of position; infinite for constant fields.
    pub fn length_scale(&self, x: DVec3) -> f64 {
        each!(self, f => f.length_scale(x))
    }

    /// Whether the index is the same everywhere, so that rays are straight.
    pub fn is_constant(&self) -> bool {
        each!(self, f => f.is_constant())
    }
}
