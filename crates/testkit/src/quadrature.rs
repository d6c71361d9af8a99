//! Adaptive quadrature over rectangles.

/// Effort of [`integrate_cell`].
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Target absolute error per top-level cell.
    pub tolerance: f64,
    /// Least number of subdivisions, whatever the error estimate, so that narrow peaks are not
    /// missed.
    pub min_depth: u32,
    /// Largest number of subdivisions, which bounds the work at jumps of the integrand.
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

/// Returns ∫f over [lo, hi] from 3 × 3 Gauss points. Cells are split into four until the estimate
/// settles.
///
/// All points are interior: a jump of the integrand on the border of the cell causes no error.
pub fn integrate_cell(
    f: &impl Fn([f64; 2]) -> f64,
    lo: [f64; 2],
    hi: [f64; 2],
    effort: Effort,
) -> f64 {
    let coarse = gauss(f, lo, hi);
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
    let parts = quarters.map(|(a, b)| gauss(f, a, b));
    let fine: f64 = parts.iter().sum();
    // Along a jump, each level doubles the number of cells: halving the tolerance bounds the sum of
    // errors.
    let tolerance = effort.tolerance * 0.5f64.powi(depth as i32);
    let settled = depth >= effort.min_depth && (fine - coarse).abs() <= tolerance;
    if settled || depth >= effort.max_depth {
        return fine;
    }
    quarters
        .iter()
        .zip(parts)
        .map(|(&(a, b), c)| refine(f, a, b, c, effort, depth + 1))
        .sum()
}

/// Offset of the outer points of the three-point Gauss–Legendre rule on [−1/2, 1/2], √(3/5)/2.
const OFFSET: f64 = 0.387_298_334_620_741_7;

/// Applies the three-point rule in each coordinate of a cell.
fn gauss(f: &impl Fn([f64; 2]) -> f64, lo: [f64; 2], hi: [f64; 2]) -> f64 {
    let (dx, dy) = (hi[0] - lo[0], hi[1] - lo[1]);
    let nodes = [
        (-OFFSET, 5.0 / 18.0),
        (0.0, 8.0 / 18.0),
        (OFFSET, 5.0 / 18.0),
    ];
    let at = |t: f64, a: f64, d: f64| a + (0.5 + t) * d;
    let row = |y: f64| {
        nodes
            .iter()
            .map(|&(t, w)| w * f([at(t, lo[0], dx), y]))
            .sum::<f64>()
    };
    nodes
        .iter()
        .map(|&(t, w)| w * row(at(t, lo[1], dy)))
        .sum::<f64>()
        * dx
        * dy
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
        let peak = |[x, y]: [f64; 2]| (-(x * x + (y - 0.1).powi(2)) * 5e3).exp();
        let effort = Effort {
            min_depth: 4,
            ..Effort::default()
        };
        let value = integrate_cell(&peak, [-1.0; 2], [1.0; 2], effort);
        let exact = std::f64::consts::PI / 5e3;
        assert!((value - exact).abs() < 1e-7, "{value} against {exact}");
    }
}
