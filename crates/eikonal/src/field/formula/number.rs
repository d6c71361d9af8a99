//! Numbers of formula programs: values that carry derivatives.

use super::function::Function;

/// A value with derivatives.
pub(in crate::field) trait Number: Copy {
    /// Returns a constant.
    fn constant(value: f64) -> Self;
    /// Returns the sum.
    fn add(&self, o: &Self) -> Self;
    /// Returns the difference.
    fn sub(&self, o: &Self) -> Self;
    /// Returns the product.
    fn mul(&self, o: &Self) -> Self;
    /// Returns the quotient.
    fn div(&self, o: &Self) -> Self;
    /// Returns the square.
    fn square(&self) -> Self;
    /// Returns x|x|: the square with the sign of x.
    fn signed_square(&self) -> Self;
    /// Returns the sum with a constant.
    fn plus(self, constant: f64) -> Self;
    /// Returns the product with a constant.
    fn times(self, constant: f64) -> Self;
    /// Returns the integer power, of either sign.
    fn integer_power(&self, k: i32) -> Self;
    /// Returns the real power of a positive value.
    fn real_power(&self, p: f64) -> Self;
    /// Returns the value of a function.
    fn apply(&self, function: Function) -> Self;
    /// Returns the angle of the point (`x`, `self`).
    fn atan2(&self, x: &Self) -> Self;
}
