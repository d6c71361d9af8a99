//! First roots along straight lines, where the polynomials of [`eikonal::ray::bernstein`] have closed
//! forms. The rules at the ends of the interval are the same.

/// Rounding error of a value inside the interval, relative to the largest coefficient.
const INSIDE: f64 = 64.0 * f64::EPSILON;

/// The interval that is searched and the values at its ends, where zero stands for whatever is zero
/// to rounding.
struct Range {
    from: f64,
    to: f64,
    ends: [f64; 2],
}

impl Range {
    /// `None` if the interval is empty, or a value is not a number.
    fn new(
        f: impl Fn(f64) -> f64,
        [from, to]: [f64; 2],
        largest: f64,
        noise: [f64; 2],
    ) -> Option<Self> {
        let inside = INSIDE * largest;
        let at_from = noise[0] + if from > 0.0 { inside } else { 0.0 };
        let at_to = noise[1] + if to < 1.0 { inside } else { 0.0 };
        if largest.partial_cmp(&at_from.max(at_to))?.is_le() || from.partial_cmp(&to)?.is_ge() {
            return None;
        }
        let zeroed = |value: f64, noise: f64| if value.abs() <= noise { 0.0 } else { value };
        let ends = [zeroed(f(from), at_from), zeroed(f(to), at_to)];
        Some(Range { from, to, ends })
    }

    /// `inside` if it is there, else the end if that is a root.
    fn first(&self, inside: Option<f64>) -> Option<f64> {
        let root = inside.or((self.ends[1] == 0.0).then_some(self.to))?;
        Some(root.clamp(self.from.next_up(), self.to))
    }
}

/// Whether all coefficients lie on one side of zero, further off than any rounding.
fn apart<const N: usize>(c: &[f64; N], noise: [f64; 2]) -> bool {
    let near = noise[0].max(noise[1]) + INSIDE * c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    c.iter().all(|&x| x > near) || c.iter().all(|&x| x < -near)
}

/// The root in (from, to] of the linear function with values `c` at 0 and 1. `noise` bounds the errors
/// of these.
pub(super) fn linear(c: &[f64; 2], range: [f64; 2], noise: [f64; 2]) -> Option<f64> {
    if apart(c, noise) {
        return None;
    }
    let f = |t: f64| c[0] + (c[1] - c[0]) * t;
    let largest = c[0].abs().max(c[1].abs());
    let range = Range::new(f, range, largest, noise)?;
    let [a, b] = range.ends;
    let crosses = (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0);
    range.first(crosses.then(|| range.from + (range.to - range.from) * (a / (a - b))))
}

/// The first root in (from, to] of the quadratic function with Bernstein coefficients `c`.
pub(super) fn quadratic(c: &[f64; 3], range: [f64; 2], noise: [f64; 2]) -> Option<f64> {
    if apart(c, noise) {
        return None;
    }
    // f(t) = square t² + 2 slope t + c₀.
    let (slope, square) = (c[1] - c[0], c[0] - 2.0 * c[1] + c[2]);
    let f = |t: f64| c[0] + t * (2.0 * slope + square * t);
    let largest = c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let range = Range::new(f, range, largest, noise)?;
    if range.ends[0] == 0.0 {
        // The other root: the sum of the two is −2 slope/square.
        let other = -2.0 * slope / square - range.from;
        return range.first((other > range.from && other < range.to).then_some(other));
    }
    let discriminant = slope * slope - square * c[0];
    if discriminant <= 0.0 {
        return range.first(None);
    }
    let q = -(slope + discriminant.sqrt().copysign(slope));
    let (a, b) = (q / square, c[0] / q);
    let inside = |t: &f64| *t > range.from && *t < range.to;
    range.first([a.min(b), a.max(b)].into_iter().find(inside))
}

#[cfg(test)]
mod tests {
    use super::*;
    use eikonal::ray::bernstein::first_root;

    /// Numbers in [−1, 1], some of them zero or next to it.
    fn numbers() -> impl Iterator<Item = f64> {
        let mut state = 1u64;
        std::iter::from_fn(move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            let uniform = (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
            Some(match state >> 60 {
                0 => 0.0,
                1 => uniform * 1e-16,
                _ => uniform,
            })
        })
    }

    /// Two searches for one root: by closed form, and by the general method, to rounding where roots are
    /// well separated.
    fn agree(a: Option<f64>, b: Option<f64>) -> bool {
        match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() < 1e-12,
            (a, b) => a == b,
        }
    }

    #[test]
    fn as_the_general_method() {
        let mut numbers = numbers();
        let mut next = || numbers.next().unwrap();
        let mut found = [0; 2];
        for _ in 0..100_000 {
            let (a, b) = (next().abs(), next().abs());
            let range = match next() > 0.0 {
                true => [0.0, 1.0],
                false => [a.min(b), a.max(b)],
            };
            let noise = [1e-15, 1e-15];
            let c = [next(), next()];
            let root = linear(&c, range, noise);
            assert!(
                agree(root, first_root(&c, range[0], range[1], noise)),
                "{c:?} {range:?}"
            );
            found[0] += u32::from(root.is_some());
            let c = [next(), next(), next()];
            let discriminant = c[1] * c[1] - c[0] * c[2];
            if discriminant.abs() < 1e-3 || (c[0] - 2.0 * c[1] + c[2]).abs() < 1e-3 {
                continue;
            }
            let root = quadratic(&c, range, noise);
            assert!(
                agree(root, first_root(&c, range[0], range[1], noise)),
                "{c:?} {range:?}"
            );
            found[1] += u32::from(root.is_some());
        }
        assert!(found.iter().all(|&n| n > 10_000), "{found:?}");
    }

    #[test]
    fn no_roots_without_sense() {
        let nan = f64::NAN;
        assert_eq!(linear(&[nan, 1.0], [0.0, 1.0], [0.0; 2]), None);
        assert_eq!(linear(&[-1.0, 1.0], [nan, 1.0], [0.0; 2]), None);
        assert_eq!(quadratic(&[1.0, nan, 1.0], [0.0, 1.0], [0.0; 2]), None);
        assert_eq!(quadratic(&[0.0; 3], [0.0, 1.0], [0.0; 2]), None);
    }
}
