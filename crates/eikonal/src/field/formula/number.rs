//! What a program of a formula computes with: values that carry derivatives along.

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
    /// A power of a whole number, of either sign.
    fn integer_power(&self, k: i32) -> Self;
    /// Another power, of what is positive.
    fn real_power(&self, p: f64) -> Self;
    /// A function of it.
    fn apply(&self, function: Function) -> Self;
    /// The angle of the point (`x`, `self`).
    fn atan2(&self, x: &Self) -> Self;
}
