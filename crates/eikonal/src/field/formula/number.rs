//! Numbers of formula programs: values that carry derivatives.

use super::function::Function;

/// A value with derivatives.
pub(in crate::field) trait Number: Copy {
    /// A constant.
    fn constant(value: f64) -> Self;
    /// The sum.
    fn add(&self, o: &Self) -> Self;
    /// The difference.
    fn sub(&self, o: &Self) -> Self;
    /// The product.
    fn mul(&self, o: &Self) -> Self;
    /// The quotient.
    fn div(&self, o: &Self) -> Self;
    /// The square.
    fn square(&self) -> Self;
    /// x|x|: the square with the sign of x.
    fn signed_square(&self) -> Self;
    /// The sum with a constant.
    fn plus(self, constant: f64) -> Self;
    /// The product with a constant.
    fn times(self, constant: f64) -> Self;
    /// Integer power, of either sign.
    fn integer_power(&self, k: i32) -> Self;
    /// Real power of a positive value.
    fn real_power(&self, p: f64) -> Self;
    /// Value of a function.
    fn apply(&self, function: Function) -> Self;
    /// Angle of the point (`x`, `self`).
    fn atan2(&self, x: &Self) -> Self;
}
