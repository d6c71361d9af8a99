//! Bessel functions of the first kind of consecutive integer orders (docs/theory.md#sound).

use std::f64::consts::FRAC_2_PI;

/// Returns J₍m₋₂₎(x) … J₍m₊₂₎(x) for x ≥ 0, with J₋ₚ = (−1)ᵖ Jₚ. A mode of order m and its first
/// two derivatives need them.
pub(super) fn around(m: u16, x: f64) -> [f64; 5] {
    let j: [f64; 5] = run(u32::from(m).saturating_sub(2), x);
    match m {
        0 => [j[2], -j[1], j[0], j[1], j[2]],
        1 => [-j[1], j[0], j[1], j[2], j[3]],
        _ => j,
    }
}

/// Values J_low(x) … J_{low+N−1}(x) for x ≥ 0.
///
/// The recurrence J₍p₊₁₎ = (2p/x) Jₚ − J₍p₋₁₎ is stable upwards while p < x. Above, the ratios rₚ =
/// Jₚ/J₍p₋₁₎ = x/(2p − x r₍p₊₁₎) are stable downwards (Gautschi 1967). Neither range divides by a
/// small x.
pub(super) fn run<const N: usize>(low: u32, x: f64) -> [f64; N] {
    let high = low + N as u32 - 1;
    let mut out = [0.0; N];
    let (mut before, mut j, mut p) = (libm::j0(x), libm::j1(x), 1);
    if low == 0 {
        out[0] = before;
    }
    loop {
        if p >= low {
            out[(p - low) as usize] = j;
        }
        if p == high {
            return out;
        }
        if f64::from(p) >= x {
            break;
        }
        (before, j) = (j, 2.0 * f64::from(p) / x * j - before);
        p += 1;
    }
    for (value, above) in out.iter_mut().zip(ratios::<N>(low, p, x)) {
        *value = above.map_or(*value, |ratio| ratio * j);
    }
    out
}

/// Returns the ratios J_q(x)/J_p(x) for the orders q = low … low+N−1 above p ≥ x; `None` for the
/// other orders.
fn ratios<const N: usize>(low: u32, p: u32, x: f64) -> [Option<f64>; N] {
    // Start high enough: the error of starting with r = 0 falls with (J_start/J_p)².
    let start = low + N as u32 + 7 + x as u32;
    let mut product: [Option<f64>; N] =
        std::array::from_fn(|i| (low + i as u32 > p).then_some(1.0));
    let mut ratio = 0.0;
    for k in (p + 1..=start).rev() {
        ratio = x / (2.0 * f64::from(k) - x * ratio);
        for (value, q) in product.iter_mut().zip(low..) {
            if q >= k {
                *value = value.map(|v| v * ratio);
            }
        }
    }
    product
}

/// Returns an upper bound of |J_p(x)| for x between `low` and `high`: the smallest of 1 (p = 0) or
/// 0.674886 p^(−1/3) (Landau 2000); (x/2)ᵖ/p!; and, past the turning point x = p, (2/π)^½ (x² −
/// p²)^(−1/4) (Watson 1944, §13.74).
pub(super) fn limit(p: u32, [low, high]: [f64; 2]) -> f64 {
    let order = f64::from(p);
    let peak = if p == 0 { 1.0 } else { 0.674886 / order.cbrt() };
    let inner: f64 = (1..=p).map(|i| high / (2.0 * f64::from(i))).product();
    let outer = if low > order {
        (FRAC_2_PI / ((low - order) * (low + order)).sqrt()).sqrt()
    } else {
        f64::INFINITY
    };
    peak.min(inner).min(outer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_hold_and_are_not_far_off() {
        for p in [0, 1, 2, 3, 5, 10, 31, 64] {
            for start in 0..100 {
                let low = f64::from(start);
                for width in [0.0, 0.3, 2.0, 20.0] {
                    let steps = (0..=400).map(|i| low + width * f64::from(i) / 400.0);
                    let largest = steps.map(|x| libm::jn(p, x).abs()).fold(0.0, f64::max);
                    let bound = limit(p as u32, [low, low + width]);
                    assert!(bound >= largest, "J_{p} at {low}: {bound} < {largest}");
                    // Skip arguments well inside the turning point, where all values are small and
                    // the series bound is loose.
                    let oscillates = width == 20.0 && low + width > f64::from(p);
                    assert!(!oscillates || bound < 2.0 * largest, "J_{p} at {low}");
                }
            }
        }
    }

    #[test]
    fn agrees_with_libm_at_all_orders_and_arguments() {
        for m in [0, 1, 2, 3, 5, 10, 31, 64] {
            for step in 0..4000 {
                let x = 0.025 * f64::from(step);
                for (value, order) in around(m, x).into_iter().zip(i32::from(m) - 2..) {
                    let expected = libm::jn(order, x);
                    // Both recurrences lose a few units in the last place of the largest J.
                    assert!(
                        (value - expected).abs() < 2e-14,
                        "J_{order}({x}) = {value}, expected {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn small_arguments_follow_the_leading_term() {
        // Leading term: J_m(x) → (x/2)^m / m!
        for x in [1e-300_f64, 1e-100, 1e-20, 1e-8] {
            let j = around(3, x);
            let half = 0.5 * x;
            let expected = [half, half.powi(2) / 2.0, half.powi(3) / 6.0];
            for (value, expected) in j.into_iter().zip(expected) {
                assert!((value - expected).abs() <= 1e-13 * expected, "{value}");
            }
        }
        assert_eq!(around(2, 0.0), [1.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
