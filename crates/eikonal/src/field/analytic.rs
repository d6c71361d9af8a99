//! Derivatives of n² with respect to the parameters of fields with a formula. The formula is
//! evaluated again with numbers that carry mixed derivatives (docs/theory.md#derivatives-of-rays).

use super::IndexDerivative;
use super::formula::{HESSIAN, Number, Spatial};
use glam::DVec3;

/// Maximum number of parameter values of a field with a formula.
pub(super) const MAX_VALUES: usize = 8;

/// A field with n² as a formula of the position and of a few numbers.
pub(super) trait Analytic {
    /// Names of the parameters, as in scenes, and the number of values of each: at most
    /// `MAX_VALUES` values in total.
    const PARAMETERS: &'static [(&'static str, usize)];

    /// Returns the parameter values, one after another. Entries after the last value have no
    /// effect.
    fn numbers(&self) -> [f64; MAX_VALUES];

    /// Returns n² at a position.
    fn squared<N: Number>(x: [N; 3], p: &[N]) -> N;
}

/// Returns the number of parameter values.
pub(super) fn count<A: Analytic>() -> usize {
    A::PARAMETERS.iter().map(|(_, count)| count).sum()
}

/// Adds the derivatives of a loss with respect to all parameter values of a field. `by` is the
/// derivative with respect to n² and ∇n² at `x`.
pub(super) fn add_derivative<A: Analytic>(
    field: &A,
    x: DVec3,
    by: IndexDerivative,
    into: &mut [f64],
) {
    let numbers = field.numbers();
    add_mixed(&numbers[..count::<A>()], x, by, A::squared, into);
}

/// A number with derivatives up to second order by three variables.
pub(super) type Mixed = Spatial<f64, HESSIAN>;

/// Adds the derivatives of by·(f, ∇f) with respect to the parameter values of f, two at a time. The
/// first variable moves along the derivative with respect to ∇f, the others are the two parameter
/// values.
pub(super) fn add_mixed(
    numbers: &[f64],
    x: DVec3,
    by: IndexDerivative,
    f: impl Fn([Mixed; 3], &[Mixed]) -> Mixed,
    into: &mut [f64],
) {
    let mut place = [0, 1, 2].map(|axis| Mixed::constant(x[axis]));
    for (axis, coordinate) in place.iter_mut().enumerate() {
        coordinate.0[1] = by.gradient[axis];
    }
    let fixed: Vec<Mixed> = numbers.iter().map(|v| Mixed::constant(*v)).collect();
    for first in (0..numbers.len()).step_by(2) {
        let mut p = fixed.clone();
        let pair = first..(first + 2).min(numbers.len());
        for i in pair.clone() {
            p[i] = Mixed::coordinate(1 + i - first, numbers[i]);
        }
        let found = f(place, &p).0;
        // Select (∂/∂p, ∂²/∂p∂ε) of both, from the order xx, yy, zz, xy, yz, zx.
        let changes = [[found[2], found[7]], [found[3], found[9]]];
        for (i, [value, along]) in pair.zip(changes) {
            // Planted error "derivatives by numbers of formulas without those of the slope", found by morgana-eikonal/eikonal::adjoint::parameters::fields_by_their_parameters:
            // into[i] += by.n2 * value + 0.0 * along;
            into[i] += by.n2 * value + along;
        }
    }
}

/// Returns a·b.
pub(super) fn dot<N: Number>(a: &[N], b: &[N]) -> N {
    let products = a.iter().zip(b).map(|(a, b)| a.mul(b));
    products
        .reduce(|sum, p| sum.add(&p))
        .unwrap_or(N::constant(0.0))
}

/// Returns a − b.
pub(super) fn difference<N: Number>(a: [N; 3], b: &[N]) -> [N; 3] {
    std::array::from_fn(|i| a[i].sub(&b[i]))
}
