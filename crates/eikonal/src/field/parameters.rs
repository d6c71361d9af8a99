//! Derivatives by the parameters of fields (docs/theory.md#derivatives-of-rays).

use super::{Bspline, Field};
use glam::DVec3;

/// Derivative of a loss by n² and ∇n² at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IndexDerivative {
    /// By n².
    pub n2: f64,
    /// By ∇n².
    pub gradient: DVec3,
}

impl IndexDerivative {
    /// Of a change of n² and of ∇n².
    pub(super) fn of(&self, n2: f64, gradient: DVec3) -> f64 {
        self.n2 * n2 + self.gradient.dot(gradient)
    }
}

impl Field {
    /// Number of parameters by which derivatives can be taken:
    ///
    /// | field | parameters |
    /// |---|---|
    /// | `Constant` | n |
    /// | `Gaussian` | n₀, Δn, centre (3), width |
    /// | `Selfoc` | n₀, α |
    /// | `Bspline` | coefficients, which [`Bspline::sample_derivative`](super::Bspline::sample_derivative) turns into samples |
    /// | `Affine`, `Scaled` | those of the field within |
    /// | `Sum` | those of its terms, one after another |
    ///
    /// Other fields have none.
    pub fn parameter_count(&self) -> usize {
        match self {
            Field::Constant(_) => 1,
            Field::Gaussian(_) => 6,
            Field::Selfoc(_) => 2,
            Field::Bspline(f) => f.coefficient_count(),
            Field::Sum(f) => f.terms().map(Field::parameter_count).sum(),
            Field::Affine(f) => f.inner().parameter_count(),
            Field::Scaled(f) => f.inner().parameter_count(),
            _ => 0,
        }
    }

    /// The grid whose coefficients its parameters are, if it is one: moved or multiplied, but no sum.
    pub fn grid(&self) -> Option<&Bspline> {
        match self {
            Field::Bspline(f) => Some(f),
            Field::Affine(f) => f.inner().grid(),
            Field::Scaled(f) => f.inner().grid(),
            _ => None,
        }
    }

    /// Adds the derivatives of a loss by the parameters to `into`, given that by n² and ∇n² at `x`.
    pub fn add_parameter_derivative(&self, x: DVec3, by: IndexDerivative, into: &mut [f64]) {
        match self {
            Field::Constant(f) => into[0] += by.n2 * 2.0 * f.n(),
            Field::Gaussian(f) => f.add_parameter_derivative(x, by, into),
            Field::Selfoc(f) => f.add_parameter_derivative(x, by, into),
            Field::Bspline(f) => f.add_coefficient_derivative(x, by, into),
            Field::Sum(f) => {
                let mut rest = into;
                for term in f.terms() {
                    let (own, others) = rest.split_at_mut(term.parameter_count());
                    term.add_parameter_derivative(x, by, own);
                    rest = others;
                }
            }
            Field::Affine(f) => {
                let (x, by) = f.local_derivative(x, by);
                f.inner().add_parameter_derivative(x, by, into);
            }
            Field::Scaled(f) => f.inner().add_parameter_derivative(x, f.unscaled(by), into),
            _ => {}
        }
    }
}
