//! From samples to the coefficients of the spline that interpolates them.

use super::lattice::{Lattice, PAD};

/// Turns samples into coefficients in place, axis by axis; line by line in f64.
pub(super) fn prefilter(lattice: &Lattice, data: &mut [f32]) {
    let (size, stride) = (lattice.stored_dims(), lattice.strides());
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut line = vec![0.0_f64; size[axis]];
        let mut scratch = line.clone();
        for i in 0..size[a] {
            for j in 0..size[b] {
                let first = i * stride[a] + j * stride[b];
                let places = || (first..).step_by(stride[axis]);
                for (value, p) in line.iter_mut().zip(places()) {
                    *value = f64::from(data[p]);
                }
                solve_line(&mut line, &mut scratch);
                for (value, p) in line.iter().zip(places()) {
                    data[p] = *value as f32;
                }
            }
        }
    }
}

/// Samples f in `line[PAD..len − PAD]` become coefficients c with
/// c₍i₋₁₎ + 4cᵢ + c₍i₊₁₎ = 6fᵢ; those in the padding continue them quadratically.
fn solve_line(line: &mut [f64], scratch: &mut [f64]) {
    let n = line.len() - 2 * PAD;
    // One or two samples are their own coefficients.
    if n > 2 {
        solve_tridiagonal(&mut line[PAD..PAD + n], scratch);
    }
    extend(line, n);
}

/// The interpolation conditions with c₋₁ = 3c₀ − 3c₁ + c₂ put into the first, 7c₀ − 2c₁ + c₂ =
/// 6f₀; less the second (c₀ + 4c₁ + c₂ = 6f₁) it reads 6c₀ − 6c₁ = 6(f₀ − f₁). Likewise at the end.
fn solve_tridiagonal(c: &mut [f64], factor: &mut [f64]) {
    let last = c.len() - 1;
    // Rows: c₀ − c₁ = f₀ − f₁, then (1, 4, 1), then c₍last₎ − c₍last₋₁₎ = f₍last₎ − f₍last₋₁₎.
    let end = c[last] - c[last - 1];
    c[0] -= c[1];
    factor[0] = -1.0;
    for i in 1..last {
        let pivot = 1.0 / (4.0 - factor[i - 1]);
        factor[i] = pivot;
        c[i] = (6.0 * c[i] - c[i - 1]) * pivot;
    }
    c[last] = (end + c[last - 1]) / (1.0 + factor[last - 1]);
    for i in (0..last).rev() {
        c[i] -= factor[i] * c[i + 1];
    }
}

/// Fills the padding with the polynomial of degree two (less for fewer than three samples)
/// through the outermost coefficients.
fn extend(line: &mut [f64], n: usize) {
    let next = |a: f64, b: f64, c: f64| match n {
        1 => a,
        2 => 2.0 * a - b,
        _ => 3.0 * a - 3.0 * b + c,
    };
    // With fewer than three samples the farther arguments are not used.
    for i in (0..PAD).rev() {
        line[i] = next(line[i + 1], line[i + 2], line[i + 3]);
    }
    for i in PAD + n..line.len() {
        line[i] = next(line[i - 1], line[i - 2], line[i - 3]);
    }
}
