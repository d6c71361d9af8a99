//! Basis functions of a cubic spline.

use crate::lanes::Summand;
use fearless_simd::{Simd, SimdBase, f64x4};

/// Coefficients of 1, t, t², t³ in the four basis functions that act in a cell.
pub(super) const VALUE: [[f64; 4]; 4] = [
    [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0],
    [-0.5, 0.0, 0.5, 0.0],
    [0.5, -1.0, 0.5, 0.0],
    [-1.0 / 6.0, 0.5, -0.5, 1.0 / 6.0],
];
/// Coefficients of powers of t in the first derivatives of the basis functions.
pub(super) const FIRST_DERIVATIVE: [[f64; 4]; 3] = [
    [-0.5, 0.0, 0.5, 0.0],
    [1.0, -2.0, 1.0, 0.0],
    [-0.5, 1.5, -1.5, 0.5],
];
/// Coefficients of powers of t in the second derivatives of the basis functions.
const SECOND_DERIVATIVE: [[f64; 4]; 2] = [[1.0, -2.0, 1.0, 0.0], [-1.0, 3.0, -3.0, 1.0]];

/// Values of the four basis functions of one axis at a point, and their derivatives by the
/// coordinate in cells.
pub(super) struct Weights<S: Simd> {
    pub value: f64x4<S>,
    pub first: f64x4<S>,
    pub second: f64x4<S>,
}

impl<S: Simd> Weights<S> {
    /// Computes the weights at the fraction `t` of a cell.
    #[inline(always)]
    pub(super) fn new(simd: S, t: f64) -> Self {
        let c = |c: &[f64; 4]| f64x4::from_slice(simd, c);
        let [v0, v1, v2, v3] = &VALUE;
        let [f0, f1, f2] = &FIRST_DERIVATIVE;
        let [s0, s1] = &SECOND_DERIVATIVE;
        Weights {
            value: c(v0).plus(t, c(v1).plus(t, c(v2).plus(t, c(v3)))),
            first: c(f0).plus(t, c(f1).plus(t, c(f2))),
            second: c(s0).plus(t, c(s1)),
        }
    }
}
