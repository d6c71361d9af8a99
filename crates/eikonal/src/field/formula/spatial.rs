//! Values with derivatives by three coordinates.

use super::function::Function;
use super::number::Number;
use super::real::Real;
use super::series::Series;
use std::array::from_fn;

/// Value; with N = 4 also its gradient, with N = 10 also its Hessian: xx, yy, zz, xy, yz, zx.
#[derive(Clone, Copy, Debug)]
pub(in crate::field) struct Spatial<B, const N: usize>(pub [B; N]);

/// Number of entries for the value alone.
pub(in crate::field) const VALUE: usize = 1;
/// Number of entries for value and gradient.
pub(in crate::field) const GRADIENT: usize = 4;
/// Number of entries for value, gradient and Hessian.
pub(in crate::field) const HESSIAN: usize = 10;

impl<B: Real, const N: usize> Spatial<B, N> {
    /// Creates the coordinate along an axis, 0 to 2.
    pub(in crate::field) fn coordinate(axis: usize, value: B) -> Self {
        Spatial(from_fn(|i| match i {
            0 => value,
            i if i == axis + 1 => B::of(1.0),
            _ => B::of(0.0),
        }))
    }

    /// Returns the product with a number. A loop compiles to less code than a map.
    #[inline(always)]
    fn scaled(mut self, factor: B) -> Self {
        for c in &mut self.0 {
            *c = *c * factor;
        }
        self
    }

    /// Returns a function f of this value, from f, f′ and f″/2.
    #[inline(always)]
    fn chain(&self, [f, f1, f2]: [B; 3]) -> Self {
        let (u, mut out) = (&self.0, [f; N]);
        for i in 1..N.min(GRADIENT) {
            out[i] = f1 * u[i];
        }
        if N == HESSIAN {
            let twice = f2 + f2;
            for i in 0..3 {
                let j = (i + 1) % 3;
                out[4 + i] = f1 * u[4 + i] + twice * u[1 + i].square();
                out[7 + i] = f1 * u[7 + i] + twice * (u[1 + i] * u[1 + j]);
            }
        }
        Spatial(out)
    }

    /// Applies a function by evaluating it for a series in the value.
    #[inline(always)]
    fn through(&self, f: impl Fn(Series<B, 3>) -> Series<B, 3>) -> Self {
        self.chain(f(Series::variable(self.0[0])).0)
    }
}

impl<B: Real, const N: usize> Number for Spatial<B, N> {
    fn constant(value: f64) -> Self {
        Spatial(from_fn(|i| B::of(if i == 0 { value } else { 0.0 })))
    }

    #[inline(always)]
    fn add(&self, o: &Self) -> Self {
        Spatial(from_fn(|i| self.0[i] + o.0[i]))
    }

    #[inline(always)]
    fn sub(&self, o: &Self) -> Self {
        Spatial(from_fn(|i| self.0[i] - o.0[i]))
    }

    #[inline(always)]
    fn mul(&self, o: &Self) -> Self {
        let (a, b) = (&self.0, &o.0);
        let mut out = [a[0] * b[0]; N];
        for i in 1..N {
            out[i] = a[0] * b[i] + b[0] * a[i];
        }
        if N == HESSIAN {
            for i in 0..3 {
                let j = (i + 1) % 3;
                let diagonal = a[1 + i] * b[1 + i];
                out[4 + i] = out[4 + i] + (diagonal + diagonal);
                out[7 + i] = out[7 + i] + (a[1 + i] * b[1 + j] + a[1 + j] * b[1 + i]);
            }
        }
        Spatial(out)
    }

    #[inline(always)]
    fn div(&self, o: &Self) -> Self {
        self.mul(&o.integer_power(-1))
    }

    #[inline(always)]
    fn square(&self) -> Self {
        let u = self.0[0];
        self.chain([u.square(), u + u, B::of(1.0)])
    }

    #[inline(always)]
    fn signed_square(&self) -> Self {
        let sign = self.0[0].sign();
        self.square().scaled(sign)
    }

    #[inline(always)]
    fn plus(mut self, constant: f64) -> Self {
        self.0[0] = self.0[0] + B::of(constant);
        self
    }

    #[inline(always)]
    fn times(self, constant: f64) -> Self {
        self.scaled(B::of(constant))
    }

    #[inline(never)]
    fn integer_power(&self, k: i32) -> Self {
        let u = self.0[0];
        if k == -1 {
            let f = B::of(1.0) / u;
            let square = f.square();
            return self.chain([f, -square, square * f]);
        }
        let power = |k: i32| u.integer_power(k);
        let (slope, bend) = (f64::from(k), 0.5 * f64::from(k) * (f64::from(k) - 1.0));
        self.chain([
            power(k),
            power(k - 1) * B::of(slope),
            power(k - 2) * B::of(bend),
        ])
    }

    #[inline(never)]
    fn real_power(&self, p: f64) -> Self {
        self.through(|u| u.real_power(p))
    }

    #[inline(never)]
    fn apply(&self, function: Function) -> Self {
        self.through(|u| u.apply(function))
    }

    /// Uses the partial derivatives of the angle, −y/s by x and x/s by y, with s = x² + y².
    #[inline(never)]
    fn atan2(&self, x: &Self) -> Self {
        let (a, b) = (&x.0, &self.0);
        let (x, y) = (a[0], b[0]);
        let s = x.square() + y.square();
        let (by_x, by_y) = (-y / s, x / s);
        let twice = by_x * by_y + by_x * by_y;
        let mixed = (y.square() - x.square()) / s.square();
        let mut out = [y.atan2(x); N];
        if y.is_cut(x) {
            // Derivatives across a jump are unknown.
            out[1..].fill(B::of(f64::NAN));
            return Spatial(out);
        }
        for i in 1..N {
            out[i] = by_x * a[i] + by_y * b[i];
        }
        if N == HESSIAN {
            let bend = |i: usize, j: usize| {
                let (i, j) = (1 + i % 3, 1 + j % 3);
                let straight = b[i] * b[j] - a[i] * a[j];
                twice * straight + mixed * (a[i] * b[j] + b[i] * a[j])
            };
            for i in 0..3 {
                out[4 + i] = out[4 + i] + bend(i, i);
                out[7 + i] = out[7 + i] + bend(i, i + 1);
            }
        }
        Spatial(out)
    }
}
