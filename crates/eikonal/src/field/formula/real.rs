//! Domains of evaluation of formulas: numbers, or intervals that contain all numbers of a range.

use std::f64::consts::FRAC_2_SQRT_PI;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number or an interval, with the functions of formulas.
pub(in crate::field) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Returns a constant.
    fn of(value: f64) -> Self;
    /// Returns the value to use as the argument of a root or as a divisor. An exact zero becomes
    /// the smallest number whose powers do not overflow, so that derivatives by the distance from a
    /// centre have their limits there.
    fn off_zero(self) -> Self;
    /// Returns the sign of x, 1 or −1.
    fn sign(self) -> Self;
    /// Returns the square x².
    fn square(self) -> Self;
    /// Returns the integer power xᵏ.
    fn integer_power(self, k: i32) -> Self;
    /// Returns the real power xᵖ of x > 0.
    fn real_power(self, p: f64) -> Self;
    /// Returns the square root √x.
    fn sqrt(self) -> Self;
    /// Returns the exponential eˣ.
    fn exp(self) -> Self;
    /// Returns the logarithm ln x.
    fn ln(self) -> Self;
    /// Returns sin x.
    fn sin(self) -> Self;
    /// Returns cos x.
    fn cos(self) -> Self;
    /// Returns tan x.
    fn tan(self) -> Self;
    /// Returns arcsin x.
    fn asin(self) -> Self;
    /// Returns arccos x.
    fn acos(self) -> Self;
    /// Returns arctan x.
    fn atan(self) -> Self;
    /// Returns sinh x.
    fn sinh(self) -> Self;
    /// Returns cosh x.
    fn cosh(self) -> Self;
    /// Returns tanh x.
    fn tanh(self) -> Self;
    /// Returns the error function erf x.
    fn erf(self) -> Self;
    /// Returns the angle of the point (`x`, `self`), between −π and π.
    fn atan2(self, x: Self) -> Self;
    /// Returns true if the angle of the point (`x`, `self`) may jump.
    fn is_cut(self, x: Self) -> bool;
}

/// Slope of erf at zero, 2/√π.
pub(super) const ERF_SLOPE: f64 = FRAC_2_SQRT_PI;

/// Replacement for zero, whose square divides without overflow.
const ZERO_REPLACEMENT: f64 = 1e-100;

impl Real for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn off_zero(self) -> Self {
        if self == 0.0 { ZERO_REPLACEMENT } else { self }
    }

    #[inline(always)]
    fn sign(self) -> Self {
        1f64.copysign(self)
    }

    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }

    fn integer_power(self, k: i32) -> Self {
        self.powi(k)
    }

    fn real_power(self, p: f64) -> Self {
        self.powf(p)
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn exp(self) -> Self {
        self.exp()
    }

    fn ln(self) -> Self {
        self.ln()
    }

    fn sin(self) -> Self {
        self.sin()
    }

    fn cos(self) -> Self {
        self.cos()
    }

    fn tan(self) -> Self {
        self.tan()
    }

    fn asin(self) -> Self {
        self.asin()
    }

    fn acos(self) -> Self {
        self.acos()
    }

    fn atan(self) -> Self {
        self.atan()
    }

    fn sinh(self) -> Self {
        self.sinh()
    }

    fn cosh(self) -> Self {
        self.cosh()
    }

    fn tanh(self) -> Self {
        self.tanh()
    }

    fn erf(self) -> Self {
        libm::erf(self)
    }

    fn atan2(self, x: f64) -> f64 {
        self.atan2(x)
    }

    fn is_cut(self, _: f64) -> bool {
        false
    }
}
