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
    /// A constant.
    fn of(value: f64) -> Self;
    /// Value to use as the argument of a root or as a divisor. An exact zero becomes the smallest
    /// number whose powers do not overflow, so that derivatives by the distance from a centre have
    /// their limits there.
    fn off_zero(self) -> Self;
    /// Sign of x, 1 or −1.
    fn sign(self) -> Self;
    /// Square x².
    fn square(self) -> Self;
    /// Integer power xᵏ.
    fn integer_power(self, k: i32) -> Self;
    /// Real power xᵖ of x > 0.
    fn real_power(self, p: f64) -> Self;
    /// Square root √x.
    fn sqrt(self) -> Self;
    /// Exponential eˣ.
    fn exp(self) -> Self;
    /// Logarithm ln x.
    fn ln(self) -> Self;
    /// sin x.
    fn sin(self) -> Self;
    /// cos x.
    fn cos(self) -> Self;
    /// tan x.
    fn tan(self) -> Self;
    /// arcsin x.
    fn asin(self) -> Self;
    /// arccos x.
    fn acos(self) -> Self;
    /// arctan x.
    fn atan(self) -> Self;
    /// sinh x.
    fn sinh(self) -> Self;
    /// cosh x.
    fn cosh(self) -> Self;
    /// tanh x.
    fn tanh(self) -> Self;
    /// Error function erf x.
    fn erf(self) -> Self;
    /// Angle of the point (`x`, `self`), between −π and π.
    fn atan2(self, x: Self) -> Self;
    /// True if the angle of the point (`x`, `self`) may jump.
    fn is_cut(self, x: Self) -> bool;
}

/// Slope of erf at zero, 2/√π.
pub(super) const ERF_SLOPE: f64 = FRAC_2_SQRT_PI;

/// Replacement for zero, whose square divides without overflow.
const LEAST: f64 = 1e-100;

impl Real for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn off_zero(self) -> Self {
        if self == 0.0 { LEAST } else { self }
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
