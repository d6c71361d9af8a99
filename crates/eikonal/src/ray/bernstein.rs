//! Polynomials in Bernstein form on [0, 1], and their first root.
//!
//! The Bernstein coefficients of a polynomial are the heights of its Bézier control points. The
//! polynomial lies within their range, and it has at most as many roots in the open interval as the
//! coefficients change sign (G. Farin, *Curves and Surfaces for CAGD*, §5). Both facts survive
//! subdivision by de Casteljau's algorithm, which only takes convex combinations and is therefore
//! stable. Roots are thus found without leaving this basis.
//!
//! Theory: docs/theory.md#dense-output.

use glam::DVec3;
use std::ops::{Add, Mul, Sub};

/// Width below which an interval counts as a point.
const MIN_WIDTH: f64 = 1.0 / (1u64 << 50) as f64;

/// Rounding error of a value reached by subdivision, relative to the largest coefficient. It also
/// covers the error of a root from which a search continues.
const SPLIT_NOISE: f64 = 64.0 * f64::EPSILON;

/// Splits a polynomial (or Bézier curve) at `t`. Returns the coefficients of its restrictions to
/// [0, t] and to [t, 1], each on a unit interval of its own (de Casteljau).
pub fn split<T, const N: usize>(c: &[T; N], t: f64) -> ([T; N], [T; N])
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    let mut right = *c;
    let mut k = 0;
    let left = std::array::from_fn(|_| {
        k += 1;
        let start = right[0];
        for i in 0..N - k {
            right[i] = right[i] + (right[i + 1] - right[i]) * t;
        }
        start
    });
    (left, right)
}

/// Returns the coefficients of the restriction to [a, b] ⊂ [0, 1].
pub fn restrict<T, const N: usize>(c: &[T; N], a: f64, b: f64) -> [T; N]
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    let c = if b < 1.0 { split(c, b).0 } else { *c };
    if a > 0.0 { split(&c, a / b).1 } else { c }
}

/// Returns value and derivative at `t`.
pub fn evaluate<T, const N: usize>(c: &[T; N], t: f64) -> (T, T)
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    const { assert!(N >= 2) };
    let mut c = *c;
    for k in 1..N - 1 {
        for i in 0..N - k {
            c[i] = c[i] + (c[i + 1] - c[i]) * t;
        }
    }
    let slope = c[1] - c[0];
    (c[0] + slope * t, slope * (N - 1) as f64)
}

/// Returns the signed height n·(x − p) of a Bézier curve over the plane through `p` with normal
/// `n`.
pub fn height<const K: usize>(control: &[DVec3; K], p: DVec3, n: DVec3) -> [f64; K] {
    std::array::from_fn(|i| n.dot(control[i] - p))
}

/// Returns the product of two polynomials, of degree (A − 1) + (B − 1).
pub fn product<const A: usize, const B: usize, const C: usize>(
    a: &[f64; A],
    b: &[f64; B],
) -> [f64; C] {
    const { assert!(C + 1 == A + B) };
    let mut c = [0.0; C];
    for i in 0..A {
        for j in 0..B {
            c[i + j] += Weights::<A, B>::TABLE[i][j] * a[i] * b[j];
        }
    }
    c
}

/// Weights of the Bernstein product: binom(m, i) binom(n, j) / binom(m + n, i + j).
struct Weights<const A: usize, const B: usize>;

impl<const A: usize, const B: usize> Weights<A, B> {
    const TABLE: [[f64; B]; A] = {
        let mut w = [[0.0; B]; A];
        let mut i = 0;
        while i < A {
            let mut j = 0;
            while j < B {
                w[i][j] = binomial(A - 1, i) * binomial(B - 1, j) / binomial(A + B - 2, i + j);
                j += 1;
            }
            i += 1;
        }
        w
    };
}

const fn binomial(n: usize, k: usize) -> f64 {
    let (mut b, mut i) = (1.0, 0);
    while i < k {
        b = b * (n - i) as f64 / (i + 1) as f64;
        i += 1;
    }
    b
}

/// Returns the first root in (t_min, t_max] ⊂ [0, 1], accurate to about 1e-15.
///
/// `noise` bounds the error of the polynomial's value at `t_min` and at `t_max`. A smaller value
/// counts as a root, which the half-open interval excludes at `t_min` and includes at `t_max`.
/// Between consecutive arcs, and when a search continues from a known root, each root is therefore
/// found exactly once, if both sides use equal noise. Roots of even multiplicity, where the curve
/// touches zero and turns back, may be missed. A polynomial that is zero throughout has no root.
/// The work is bounded.
pub fn first_root<const N: usize>(
    c: &[f64; N],
    t_min: f64,
    t_max: f64,
    noise: [f64; 2],
) -> Option<f64> {
    let largest = c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let at_min = noise[0]
        + if t_min > 0.0 {
            SPLIT_NOISE * largest
        } else {
            0.0
        };
    let at_max = noise[1]
        + if t_max < 1.0 {
            SPLIT_NOISE * largest
        } else {
            0.0
        };
    let noise = at_min.max(at_max);
    if clear(c, noise) || largest <= noise || t_min.partial_cmp(&t_max)?.is_ge() {
        return None;
    }
    let mut c = restrict(c, t_min, t_max);
    if c[0].abs() <= at_min {
        c[0] = 0.0;
    }
    let ends = c[N - 1].abs() <= at_max;
    if ends {
        c[N - 1] = 0.0;
    }
    let floor = f64::EPSILON * largest;
    let root = search(&c, t_min, t_max, floor);
    // Clamp: rounding can put an isolated root on the end that does not belong to the interval.
    root.or(ends.then_some(t_max))
        .map(|t| t.clamp(t_min.next_up(), t_max))
}

/// Returns true if all coefficients lie on one side of zero by more than the noise: there is no
/// root (convex hull). Also returns true if a coefficient is not a number.
fn clear<const N: usize>(c: &[f64; N], noise: f64) -> bool {
    c.iter().all(|&x| x > noise) || c.iter().all(|&x| x < -noise) || c.iter().any(|x| x.is_nan())
}

/// Returns the first root in the open interval (a, b) of the polynomial with Bernstein coefficients
/// `c` there. Zero coefficients at the ends mean roots at `a` or `b`, which are not reported.
fn search<const N: usize>(c: &[f64; N], a: f64, b: f64, floor: f64) -> Option<f64> {
    let (changes, sign) = sign_changes(c);
    match changes {
        0 => return None,
        1 => return Some(a + (b - a) * polish(c, sign, b - a)),
        _ => {}
    }
    let m = 0.5 * (a + b);
    if b - a < MIN_WIDTH || c.iter().all(|x| x.abs() <= floor) {
        return (changes % 2 == 1).then_some(m);
    }
    let (left, right) = split(c, 0.5);
    search(&left, a, m, floor)
        .or((right[0] == 0.0).then_some(m))
        .or_else(|| search(&right, m, b, floor))
}

/// Returns the number of sign changes, ignoring zeros, and the first sign.
fn sign_changes<const N: usize>(c: &[f64; N]) -> (usize, f64) {
    let (mut changes, mut first, mut last) = (0, 0.0, 0.0);
    for x in c.iter().filter(|x| **x != 0.0) {
        let sign = x.signum();
        if last == 0.0 {
            first = sign;
        } else if sign != last {
            changes += 1;
        }
        last = sign;
    }
    (changes, first)
}

/// Returns the only root in (0, 1) of a polynomial that has the sign `first` before it: Newton's
/// method, safeguarded by bisection of a shrinking bracket. `width` scales the tolerance.
fn polish<const N: usize>(c: &[f64; N], first: f64, width: f64) -> f64 {
    let scaled = Scaled::new(c);
    let (mut lo, mut hi) = (0.0, 1.0);
    let mut t = guess(c);
    let (mut last, mut newton_before) = (1.0f64, false);
    for _ in 0..100 {
        let (value, newton) = scaled.newton(t);
        if value == 0.0 {
            return t;
        }
        if value.signum() == first {
            lo = t;
        } else {
            hi = t;
        }
        // Bisect unless Newton's steps shrink and stay inside the bracket.
        let good = newton > lo && newton < hi && (newton - t).abs() < 0.5 * last;
        let next = if good { newton } else { 0.5 * (lo + hi) };
        let size = (next - t).abs();
        t = next;
        // Estimate the error: Newton's steps decrease quadratically, and a factor of a thousand is
        // kept for safety.
        let left = if good && newton_before {
            size.min(1e3 * size * (size / last).powi(2))
        } else {
            size
        };
        if left * width <= 0.25 * f64::EPSILON || hi - lo <= f64::EPSILON {
            break;
        }
        (last, newton_before) = (size, good);
    }
    t
}

/// Approximates the only root in (0, 1) of a polynomial, by the cubic with equal values and slopes
/// at the ends.
fn guess<const N: usize>(c: &[f64; N]) -> f64 {
    let (first, last, degree) = (c[0], c[N - 1], (N - 1) as f64);
    let slopes = [(c[1] - first) * degree, (last - c[N - 2]) * degree];
    let rise = last - first;
    let square = 3.0 * rise - 2.0 * slopes[0] - slopes[1];
    let cube = slopes[0] + slopes[1] - 2.0 * rise;
    let mut t = -first / rise;
    for _ in 0..2 {
        let value = first + t * (slopes[0] + t * (square + t * cube));
        t -= value / (slopes[0] + t * (2.0 * square + t * 3.0 * cube));
    }
    if t > 0.0 && t < 1.0 { t } else { 0.5 }
}

/// Coefficients times binomials, in forward and in reverse order: the polynomial is (1 − t)ⁿ times
/// a polynomial in t/(1 − t). It is evaluated from the nearer end, where t/(1 − t) is at most 1.
struct Scaled<const N: usize>([[f64; N]; 2]);

impl<const N: usize> Scaled<N> {
    const BINOMIALS: [f64; N] = {
        let mut b = [0.0; N];
        let mut i = 0;
        while i < N {
            b[i] = binomial(N - 1, i);
            i += 1;
        }
        b
    };

    fn new(c: &[f64; N]) -> Self {
        let forward: [f64; N] = std::array::from_fn(|i| Self::BINOMIALS[i] * c[i]);
        let mut back = forward;
        back.reverse();
        Scaled([forward, back])
    }

    /// Returns a multiple of the value at `t`, of equal sign, and the place to which Newton's
    /// method goes from there.
    fn newton(&self, t: f64) -> (f64, f64) {
        let Scaled([forward, back]) = self;
        if t <= 0.5 {
            let (value, step) = step(forward, t);
            (value, t - step)
        } else {
            let (value, step) = step(back, 1.0 - t);
            (value, t + step)
        }
    }
}

/// Returns a positive multiple of the value p = (1 − t)ⁿ q(x) at x = t/(1 − t), and p/p′.
fn step<const N: usize>(scaled: &[f64; N], t: f64) -> (f64, f64) {
    let u = 1.0 - t;
    let x = t / u;
    let square = x * x;
    // Evaluate even and odd powers by Horner's scheme in x², with derivatives by x².
    let (mut sums, mut slopes) = ([0.0; 2], [0.0; 2]);
    for (i, coefficient) in scaled.iter().enumerate().rev() {
        let part = i % 2;
        slopes[part] = slopes[part] * square + sums[part];
        sums[part] = sums[part] * square + coefficient;
    }
    let value = sums[0] + x * sums[1];
    let slope = sums[1] + 2.0 * x * (slopes[0] + x * slopes[1]);
    (value, value * u * u / (slope - (N - 1) as f64 * u * value))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the product ∏ (t − rᵢ), with coefficients −r and 1 − r per factor.
    fn with_roots(r: [f64; 5]) -> [f64; 6] {
        let f = |i: usize| [-r[i], 1.0 - r[i]];
        let a: [f64; 3] = product(&f(0), &f(1));
        let b: [f64; 3] = product(&f(2), &f(3));
        let c: [f64; 5] = product(&a, &b);
        product(&c, &f(4))
    }

    #[test]
    fn finds_roots_in_order() {
        let roots = [0.1, 0.35, 0.36, 0.8, 1.7];
        let c = with_roots(roots);
        let mut from = 0.0;
        for r in &roots[..4] {
            let t = first_root(&c, from, 1.0, [0.0; 2]).unwrap();
            assert!((t - r).abs() < 1e-13, "{t} for {r}");
            from = t;
        }
        assert_eq!(first_root(&c, from, 1.0, [0.0; 2]), None);
    }

    #[test]
    fn respects_the_range() {
        let c = with_roots([0.1, 0.5, 0.9, -1.0, 2.0]);
        assert_eq!(first_root(&c, 0.15, 0.45, [0.0; 2]), None);
        let t = first_root(&c, 0.15, 0.55, [0.0; 2]).unwrap();
        assert!((t - 0.5).abs() < 1e-14);
        assert_eq!(first_root(&c, 0.5, 0.5, [0.0; 2]), None);
        assert_eq!(first_root(&c, f64::NAN, 1.0, [0.0; 2]), None);
    }

    #[test]
    fn a_root_at_an_end_belongs_to_the_interval_before() {
        let c = with_roots([0.0, 1.0, -1.0, 2.0, 3.0]);
        assert_eq!(first_root(&c, 0.0, 1.0, [1e-16; 2]), Some(1.0));
        assert_eq!(first_root(&c, 0.0, 0.9, [1e-16; 2]), None);
        let (left, right) = split(&with_roots([0.5, 2.0, 3.0, 4.0, 5.0]), 0.5);
        assert_eq!(first_root(&left, 0.0, 1.0, [1e-15; 2]), Some(1.0));
        assert_eq!(first_root(&right, 0.0, 1.0, [1e-15; 2]), None);
    }

    #[test]
    fn multiple_roots_terminate() {
        for r in [0.0, 0.3, 0.5, 1.0 / 3.0, 1.0] {
            for c in [
                with_roots([r, r, 2.0, 2.0, 2.0]),
                with_roots([r, r, r, r, -1.0]),
                with_roots([r; 5]),
                [0.0; 6],
                [f64::NAN; 6],
            ] {
                let square: [f64; 11] = product(&c, &c);
                let _ = first_root(&square, 0.0, 1.0, [0.0; 2]);
                let _ = first_root(&c, 0.0, 1.0, [0.0; 2]);
            }
        }
        // A root of odd multiplicity is found, because the sign changes, but less accurately.
        let t = first_root(&with_roots([0.3, 0.3, 0.3, 2.0, 3.0]), 0.0, 1.0, [0.0; 2]);
        assert!((t.unwrap() - 0.3).abs() < 1e-4);
    }

    #[test]
    fn products_and_restrictions_agree_with_values() {
        let (a, b) = (
            [0.3, -1.0, 2.0, 0.7, -0.2, 1.1],
            [1.0, 0.5, -2.0, 0.1, 0.9, -0.4],
        );
        let c: [f64; 11] = product(&a, &b);
        let part = restrict(&c, 0.2, 0.7);
        for i in 0..=10 {
            let t = i as f64 / 10.0;
            let value = evaluate(&c, t).0;
            assert!((value - evaluate(&a, t).0 * evaluate(&b, t).0).abs() < 1e-15);
            let inside = evaluate(&c, 0.2 + 0.5 * t).0;
            assert!((evaluate(&part, t).0 - inside).abs() < 1e-14);
        }
        let (_, slope) = evaluate(&c, 0.4);
        let difference = (evaluate(&c, 0.4 + 1e-6).0 - evaluate(&c, 0.4 - 1e-6).0) / 2e-6;
        assert!((slope - difference).abs() < 1e-8);
    }
}
