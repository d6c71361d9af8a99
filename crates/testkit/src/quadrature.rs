//! Adaptive quadrature over rectangles.

/// How hard [`integrate_cell`] works.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Absolute error aimed at per top-level cell.
    pub tolerance: f64,
    /// Subdivisions made regardless of the error estimate, so that narrow peaks are not missed.
    pub min_depth: u32,
    /// Subdivisions at which the recursion gives up, at jumps of the integrand.
    pub max_depth: u32,
}

impl Default for Effort {
    fn default() -> Self {
        Effort {
            tolerance: 1e-8,
            min_depth: 1,
            max_depth: 9,
        }
    }
}

/// ∫f over [lo, hi] by tensor Simpson, cells split in four until the estimate settles.
pub fn integrate_cell(
    f: &impl Fn([f64; 2]) -> f64,
    lo: [f64; 2],
    hi: [f64; 2],
    effort: Effort,
) -> f64 {
    let coarse = simpson(f, lo, hi);
    refine(f, lo, hi, coarse, effort, 0)
}

fn refine(
    f: &impl Fn([f64; 2]) -> f64,
    lo: [f64; 2],
    hi: [f64; 2],
    coarse: f64,
    effort: Effort,
    depth: u32,
) -> f64 {
    let mid = [0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])];
    let quarters = [
        (lo, mid),
        ([mid[0], lo[1]], [hi[0], mid[1]]),
        ([lo[0], mid[1]], [mid[0], hi[1]]),
        (mid, hi),
    ];
    let parts = quarters.map(|(a, b)| simpson(f, a, b));
    let fine: f64 = parts.iter().sum();
    let error = (fine - coarse).abs() / 15.0;
    // The tolerance is shared by the cells of a level: half of it per split keeps the sum bounded
    // for the integrands met here, whose error sits in a few cells.
    let tolerance = effort.tolerance * 0.5f64.powi(depth as i32);
    if depth >= effort.max_depth || (depth >= effort.min_depth && error <= tolerance) {
        return fine + (fine - coarse) / 15.0;
    }
    quarters
        .iter()
        .zip(parts)
        .map(|(&(a, b), c)| refine(f, a, b, c, effort, depth + 1))
        .sum()
}

/// Simpson's rule on the 3 × 3 points of one cell.
fn simpson(f: &impl Fn([f64; 2]) -> f64, lo: [f64; 2], hi: [f64; 2]) -> f64 {
    let (dx, dy) = (hi[0] - lo[0], hi[1] - lo[1]);
    let row = |y: f64| f([lo[0], y]) + 4.0 * f([lo[0] + 0.5 * dx, y]) + f([hi[0], y]);
    (row(lo[1]) + 4.0 * row(lo[1] + 0.5 * dy) + row(hi[1])) * dx * dy / 36.0
}

#[cfg(test)]
mod tests {
    use super::{Effort, integrate_cell};

    #[test]
    fn smooth_and_discontinuous_integrands() {
        let smooth = integrate_cell(
            &|[x, y]| (x + 2.0 * y).exp(),
            [0.0; 2],
            [1.0; 2],
            Effort::default(),
        );
        let exact = (1f64.exp() - 1.0) * (2f64.exp() - 1.0) / 2.0;
        assert!((smooth - exact).abs() < 1e-7, "{smooth} against {exact}");
        let step = |[x, _]: [f64; 2]| if x < 0.3 { 1.0 } else { 0.0 };
        let jump = integrate_cell(&step, [0.0; 2], [1.0; 2], Effort::default());
        assert!((jump - 0.3).abs() < 1e-3, "{jump}");
    }

    #[test]
    fn narrow_peak() {
        let peak = |[x, y]: [f64; 2]| (-(x * x + y * y) * 5e3).exp();
        let value = integrate_cell(&peak, [-1.0; 2], [1.0; 2], Effort::default());
        let exact = std::f64::consts::PI / 5e3;
        assert!((value - exact).abs() < 1e-7, "{value} against {exact}");
    }
}
