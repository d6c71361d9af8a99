//! Truncated Taylor series in one variable: the value of a formula with its derivatives of any
//! order (A. Griewank and A. Walther, *Evaluating Derivatives*, 2nd ed., 2008, ch. 13;
//! docs/theory.md#formulas).

use super::function::Function;
use super::number::Number;
use super::real::{ERF_SLOPE, Real};
use std::array::from_fn;

/// Series Σ cₖ tᵏ, k < K: cₖ is the k-th derivative over k!.
#[derive(Clone, Copy, Debug)]
pub(in crate::field) struct Series<B, const K: usize>(pub [B; K]);

impl<B: Real, const K: usize> Series<B, K> {
    /// Creates the series `value` + t.
    pub(in crate::field) fn variable(value: B) -> Self {
        Series(from_fn(|k| match k {
            0 => value,
            1 => B::of(1.0),
            _ => B::of(0.0),
        }))
    }

    /// Creates the series `value` for every t.
    pub(in crate::field) fn fixed(value: B) -> Self {
        Self::constant(0.0).with_value(value)
    }

    /// Returns the product with a number. A loop compiles to less code than a map.
    #[inline(always)]
    fn scaled(mut self, factor: B) -> Self {
        for c in &mut self.0 {
            *c = *c * factor;
        }
        self
    }

    fn value(&self) -> B {
        self.0[0]
    }

    /// Returns the series with another value and unchanged derivatives.
    fn with_value(mut self, value: B) -> Self {
        self.0[0] = value;
        self
    }

    /// Returns the function with this value at t = 0 whose derivative by its argument u = `self` is
    /// `slope`. `slope` computes each coefficient from the coefficients of the function up to its
    /// own order: k fₖ = Σ j uⱼ gₖ₋ⱼ.
    #[inline(always)]
    fn integral(&self, value: B, slope: impl Fn(&[B; K], usize) -> B) -> Self {
        let (u, mut f, mut g) = (&self.0, [B::of(0.0); K], [B::of(0.0); K]);
        f[0] = value;
        for k in 1..K {
            g[k - 1] = slope(&f, k - 1);
            let sum = |sum: B, j: usize| sum + B::of(j as f64) * u[j] * g[k - j];
            f[k] = (2..=k).fold(u[1] * g[k - 1], sum) * B::of(1.0 / k as f64);
        }
        Series(f)
    }

    /// Returns two functions with these values at t = 0. The derivative of the first by u is the
    /// second; the derivative of the second is `sign` times the first. They are sine and cosine,
    /// circular or hyperbolic.
    #[inline(always)]
    fn pair(&self, values: [B; 2], sign: f64) -> [Self; 2] {
        let (u, mut s, mut c) = (&self.0, [B::of(0.0); K], [B::of(0.0); K]);
        [s[0], c[0]] = values;
        for k in 1..K {
            let sum = |of: &[B; K]| {
                let term = |sum: B, j: usize| sum + B::of(j as f64) * u[j] * of[k - j];
                (2..=k).fold(u[1] * of[k - 1], term) * B::of(1.0 / k as f64)
            };
            (s[k], c[k]) = (sum(&c), sum(&s) * B::of(sign));
        }
        [Series(s), Series(c)]
    }

    /// Computes uᵖ by p u′uᵖ = u (uᵖ)′, where u is not zero.
    #[inline(always)]
    fn power(&self, value: B, p: f64) -> Self {
        let (u, mut v) = (&self.0, [B::of(0.0); K]);
        v[0] = value;
        for k in 1..K {
            let term = |j: usize| B::of(p * j as f64 - (k - j) as f64) * u[j] * v[k - j];
            let sum = (2..=k).fold(term(1), |sum, j| sum + term(j));
            v[k] = sum * B::of(1.0 / k as f64) / u[0];
        }
        Series(v)
    }

    #[inline(always)]
    fn sqrt(mut self) -> Self {
        self.0[0] = self.0[0].off_zero();
        let (u, mut v) = (&self.0, [B::of(0.0); K]);
        v[0] = u[0].sqrt();
        if K > 1 {
            let half = B::of(0.5) / v[0];
            for k in 1..K {
                v[k] = (1..k).fold(u[k], |rest, j| rest - v[j] * v[k - j]) * half;
            }
        }
        Series(v)
    }

    fn ln(&self) -> Self {
        let slope = self.reciprocal();
        self.integral(self.value().ln(), |_, k| slope.0[k])
    }

    /// Integrates ±1/√(1 − u²), the slope of arcsin and arccos.
    fn arc(&self, value: B, sign: f64) -> Self {
        let root = self.square().times(-1.0).plus(1.0).sqrt();
        let slope = root.reciprocal().times(sign);
        self.integral(value, |_, k| slope.0[k])
    }

    /// Computes 1/u by recurrence.
    #[inline(always)]
    fn reciprocal(&self) -> Self {
        let (u, mut q) = (&self.0, [B::of(0.0); K]);
        q[0] = B::of(1.0) / u[0];
        for k in 1..K {
            let sum = (2..=k).fold(u[1] * q[k - 1], |sum, j| sum + u[j] * q[k - j]);
            q[k] = -(sum * q[0]);
        }
        Series(q)
    }
}

impl<B: Real, const K: usize> Number for Series<B, K> {
    fn constant(value: f64) -> Self {
        Series(from_fn(|k| B::of(if k == 0 { value } else { 0.0 })))
    }

    #[inline(always)]
    fn add(&self, o: &Self) -> Self {
        Series(from_fn(|k| self.0[k] + o.0[k]))
    }

    #[inline(always)]
    fn sub(&self, o: &Self) -> Self {
        Series(from_fn(|k| self.0[k] - o.0[k]))
    }

    #[inline(always)]
    fn mul(&self, o: &Self) -> Self {
        let (a, b, mut out) = (&self.0, &o.0, self.0);
        for k in 0..K {
            out[k] = a[0] * b[k];
            for j in 1..=k {
                out[k] = out[k] + a[j] * b[k - j];
            }
        }
        Series(out)
    }

    #[inline(always)]
    fn div(&self, o: &Self) -> Self {
        let (b, mut q) = (&o.0, self.0);
        for k in 0..K {
            q[k] = (1..=k).fold(q[k], |rest, j| rest - b[j] * q[k - j]) / b[0];
        }
        Series(q)
    }

    #[inline(always)]
    fn square(&self) -> Self {
        let (u, mut out) = (&self.0, self.0);
        out[0] = u[0].square();
        for k in 1..K {
            let mut half = u[0] * u[k];
            for j in 1..k.div_ceil(2) {
                half = half + u[j] * u[k - j];
            }
            out[k] = half + half;
            if k % 2 == 0 {
                out[k] = out[k] + u[k / 2].square();
            }
        }
        Series(out)
    }

    #[inline(always)]
    fn signed_square(&self) -> Self {
        let sign = self.value().sign();
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

    /// Multiplies squares of the series.
    #[inline(never)]
    fn integer_power(&self, k: i32) -> Self {
        if k == -1 {
            return self.reciprocal();
        }
        let (mut factor, mut left) = (*self, k.unsigned_abs());
        let mut power: Option<Self> = None;
        while left > 0 {
            if left & 1 == 1 {
                power = Some(power.map_or(factor, |p| p.mul(&factor)));
            }
            left >>= 1;
            if left > 0 {
                factor = factor.square();
            }
        }
        let power = power.unwrap_or(Self::constant(1.0));
        let power = if k < 0 { power.reciprocal() } else { power };
        power.with_value(self.value().integer_power(k))
    }

    #[inline(never)]
    fn real_power(&self, p: f64) -> Self {
        self.power(self.value().real_power(p), p)
    }

    #[inline(never)]
    fn apply(&self, function: Function) -> Self {
        let u = self.value();
        match function {
            Function::Sqrt => self.sqrt(),
            Function::Exp => self.integral(u.exp(), |e, k| e[k]),
            Function::Log => self.ln(),
            Function::Sin => self.pair([u.sin(), u.cos()], -1.0)[0],
            Function::Cos => self.pair([u.sin(), u.cos()], -1.0)[1],
            Function::Sinh => self.pair([u.sinh(), u.cosh()], 1.0)[0],
            Function::Cosh => self.pair([u.sinh(), u.cosh()], 1.0)[1],
            Function::Tan => self.integral(u.tan(), |t, k| tangent_slope(t, k, 1.0)),
            Function::Tanh => self.integral(u.tanh(), |t, k| tangent_slope(t, k, -1.0)),
            Function::Atan => {
                let slope = self.square().plus(1.0).reciprocal();
                self.integral(u.atan(), |_, k| slope.0[k])
            }
            Function::Asin => self.arc(u.asin(), 1.0),
            Function::Acos => self.arc(u.acos(), -1.0),
            Function::Erf => {
                let fall = self.square().times(-1.0).apply(Function::Exp);
                self.integral(u.erf(), |_, k| fall.0[k] * B::of(ERF_SLOPE))
            }
        }
    }

    #[inline(never)]
    fn atan2(&self, x: &Self) -> Self {
        let (x, y) = (x, self);
        let mut angle = Self::fixed(y.value().atan2(x.value()));
        if y.value().is_cut(x.value()) {
            // Derivatives across a jump are unknown.
            return Series(from_fn(
                |k| if k == 0 { angle.0[0] } else { B::of(f64::NAN) },
            ));
        }
        let square = x.square().add(&y.square());
        // Solve s θ′ = x y′ − y x′ with s = x² + y².
        let (x, y, s) = (&x.0, &y.0, &square.0);
        for k in 1..K {
            let mut sum = B::of(0.0);
            for j in 1..=k {
                let turn = x[k - j] * y[j] - y[k - j] * x[j];
                sum = sum + turn * B::of(j as f64);
            }
            for j in 1..k {
                sum = sum - s[k - j] * angle.0[j] * B::of(j as f64);
            }
            angle.0[k] = sum / (s[0] * B::of(k as f64));
        }
        angle
    }
}

/// Returns coefficient k of 1 ± f², the slope of tan and tanh, from the coefficients of f up to
/// order k.
#[inline(always)]
fn tangent_slope<B: Real, const K: usize>(f: &[B; K], k: usize, sign: f64) -> B {
    if k == 0 {
        return B::of(1.0) + f[0].square() * B::of(sign);
    }
    let sum = (1..=k).fold(f[0] * f[k], |sum, j| sum + f[j] * f[k - j]);
    sum * B::of(sign)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Functions of 0.3 + t are checked by identities, which are as strict as coefficients from
    /// computer algebra.
    #[test]
    fn functions_and_their_inverses_cancel() {
        let u = Series::<f64, 6>([0.3, 1.0, -0.4, 0.2, 0.1, -0.3]);
        let pairs = [
            (Function::Exp, Function::Log),
            (Function::Sin, Function::Asin),
            (Function::Tan, Function::Atan),
        ];
        for (function, inverse) in pairs {
            assert_near(u.apply(function).apply(inverse), u);
        }
        assert_near(u.real_power(2.5).real_power(0.4), u);
        assert_near(u.square().apply(Function::Sqrt), u);
        let cosine = u.apply(Function::Cos);
        assert_near(cosine.apply(Function::Acos), u);
        assert_near(
            cosine.square().add(&u.apply(Function::Sin).square()),
            Number::constant(1.0),
        );
        let [sinh, cosh] = [Function::Sinh, Function::Cosh].map(|f| u.apply(f));
        assert_near(sinh.div(&cosh), u.apply(Function::Tanh));
        assert_near(
            cosh.sub(&sinh).mul(&u.apply(Function::Exp)),
            Number::constant(1.0),
        );
        let v = u.plus(1.0);
        let cube = v.square().mul(&v);
        assert_near(v.integer_power(-3).mul(&cube), Number::constant(1.0));
        assert_near(
            u.atan2(&u.plus(1.0)),
            u.div(&u.plus(1.0)).apply(Function::Atan),
        );
        assert_near(
            u.plus(-2.0).atan2(&u).plus(-PI),
            u.plus(-2.0)
                .times(-1.0)
                .atan2(&u.times(-1.0))
                .plus(-PI)
                .plus(-PI),
        );
    }

    /// Series of erf at 0.3, with erf′ = 2/√π exp(−u²) and the tabulated value.
    #[test]
    fn error_function() {
        let erf = Series::<f64, 3>::variable(0.3).apply(Function::Erf);
        let slope = ERF_SLOPE * (-0.09f64).exp();
        assert_near(erf, Series([0.328_626_759_459_127_4, slope, -0.3 * slope]));
    }

    #[track_caller]
    fn assert_near<const K: usize>(a: Series<f64, K>, b: Series<f64, K>) {
        let far = a.0.iter().zip(&b.0).any(|(a, b)| (a - b).abs() > 1e-13);
        assert!(!far, "{a:?}\n{b:?}");
    }
}
