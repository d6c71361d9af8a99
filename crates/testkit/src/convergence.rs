//! Order of convergence from errors at several step sizes.

/// Least-squares line through (ln h, ln error).
#[derive(Clone, Copy, Debug)]
pub struct OrderFit {
    /// Order of convergence: the slope of the line.
    pub order: f64,
    /// Factor C in error ≈ C · h^`order`.
    pub constant: f64,
    /// Largest |ln error − line|. It is small in the asymptotic range.
    pub residual: f64,
}

/// Fits error ≈ C·h^p.
///
/// # Panics
/// Panics with fewer than two points, unequal lengths, or values that are not positive. An error of
/// exactly zero has no logarithm: drop it, or take larger steps.
pub fn fit_order(h: &[f64], error: &[f64]) -> OrderFit {
    assert!(
        h.len() == error.len() && h.len() >= 2,
        "two or more (h, error) pairs are needed"
    );
    assert!(
        h.iter().chain(error).all(|&v| v > 0.0),
        "step sizes and errors must be positive"
    );
    let x: Vec<f64> = h.iter().map(|v| v.ln()).collect();
    let y: Vec<f64> = error.iter().map(|v| v.ln()).collect();
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sxy: f64 = x.iter().zip(&y).map(|(a, b)| (a - mx) * (b - my)).sum();
    let sxx: f64 = x.iter().map(|a| (a - mx).powi(2)).sum();
    let order = sxy / sxx;
    let offset = my - order * mx;
    let residual = x
        .iter()
        .zip(&y)
        .map(|(a, b)| (b - offset - order * a).abs())
        .fold(0.0, f64::max);
    OrderFit {
        order,
        constant: offset.exp(),
        residual,
    }
}

#[cfg(test)]
mod tests {
    use super::fit_order;

    #[test]
    fn recovers_a_power_law() {
        let h = [0.1, 0.05, 0.025, 0.0125];
        let fit = fit_order(&h, &h.map(|v: f64| 3.0 * v.powi(4)));
        assert!((fit.order - 4.0).abs() < 1e-12 && (fit.constant - 3.0).abs() < 1e-9);
        assert!(fit.residual < 1e-12);
    }

    #[test]
    fn trapezoid_rule_is_second_order() {
        let h = [0.2, 0.1, 0.05, 0.025];
        let error = h.map(|h: f64| {
            let n = (1.0 / h).round() as i32;
            let inner: f64 = (1..n).map(|i| (f64::from(i) * h).exp()).sum();
            (h * (inner + 0.5 * (1.0 + 1f64.exp())) - (1f64.exp() - 1.0)).abs()
        });
        assert!((fit_order(&h, &error).order - 2.0).abs() < 0.01);
    }
}
