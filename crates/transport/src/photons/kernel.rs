//! Kernels: weights of the photons around a point.

use glam::DVec3;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Biweight kernel K(d) ∝ (1 − d²/r²)² on a disc or in a ball of radius r, normalised to integral
/// one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    dimensions: f64,
    radius: f64,
    peak: f64,
}

impl Kernel {
    /// Creates a kernel on a disc of radius > 0.
    pub fn disc(radius: f64) -> Self {
        Kernel {
            dimensions: 2.0,
            radius,
            // Planted error "the kernel of a disc too high", found by morgana-transport/transport::photons::agreement::photons_show_what_bdpt_shows:
            // peak: 4.0 / (PI * radius.powi(2)),
            peak: 3.0 / (PI * radius.powi(2)),
        }
    }

    /// Creates a kernel in a ball of radius > 0.
    pub fn ball(radius: f64) -> Self {
        Kernel {
            dimensions: 3.0,
            radius,
            peak: 105.0 / (32.0 * PI * radius.powi(3)),
        }
    }

    /// Returns the radius, beyond which the kernel is zero.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the area or volume of a uniform kernel with equal variance: 1/∫K².
    pub(crate) fn content(&self) -> f64 {
        let r = self.radius;
        if self.dimensions == 2.0 {
            5.0 / 9.0 * PI * r * r
        } else {
            22.0 / 35.0 * PI * r.powi(3)
        }
    }

    /// Evaluates [`Kernel::weigh`] at the distance between two points.
    pub fn between(&self, x: DVec3, y: DVec3) -> Option<(f64, f64)> {
        self.weigh(x.distance_squared(y))
    }

    /// Returns K at a squared distance, and the part of K that is bias to second order: B = ½m∇²K,
    /// where m is the second moment of K along an axis (docs/theory.md#bias-of-photon-maps). The
    /// kernel K − B has zero second moments. Returns `None` beyond the radius.
    pub fn weigh(&self, squared_distance: f64) -> Option<(f64, f64)> {
        let t = squared_distance / (self.radius * self.radius);
        let d = self.dimensions;
        // Use m = r²/(d + 6), and ∇²(1 − u²)² = (−4d + (4d + 8)u²)/r².
        let bias = (-2.0 * d + (2.0 * d + 4.0) * t) / (d + 6.0);
        (t < 1.0).then(|| (self.peak * (1.0 - t).powi(2), self.peak * bias))
    }
}

/// Number of points that represent a kernel in a ball.
const POINTS: usize = 16;

/// Returns points in the unit ball whose density is the biweight kernel: quantiles of the distance,
/// in directions on a spiral.
pub(super) fn kernel_points() -> &'static [DVec3; POINTS] {
    static FOUND: LazyLock<[DVec3; POINTS]> = LazyLock::new(|| {
        std::array::from_fn(|i| {
            let part = |i: usize| (i as f64 + 0.5) / POINTS as f64;
            let (z, angle) = (1.0 - 2.0 * part(i), i as f64 * PI * (3.0 - 5f64.sqrt()));
            let across = (1.0 - z * z).sqrt();
            let direction = DVec3::new(across * angle.cos(), across * angle.sin(), z);
            // Neighbours on the spiral have unlike distances: 7 and the number of points are coprime.
            direction * quantile(part(7 * i % POINTS))
        })
    });
    &FOUND
}

/// Returns the distance within which a part of the biweight kernel in the unit ball lies.
fn quantile(part: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let u: f64 = 0.5 * (low + high);
        let within = 105.0 / 8.0 * (u.powi(3) / 3.0 - 2.0 * u.powi(5) / 5.0 + u.powi(7) / 7.0);
        if within < part { low = u } else { high = u }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes moments over the disc or ball by the midpoint rule: of |x|⁰ and |x|², and ∫K².
    fn moments(kernel: Kernel, surface: impl Fn(f64) -> f64) -> ([[f64; 2]; 2], f64) {
        let n = 4000;
        let (mut sums, mut square) = ([[0.0; 2]; 2], 0.0);
        for i in 0..n {
            let d = kernel.radius() * (i as f64 + 0.5) / n as f64;
            let (k, b) = kernel.weigh(d * d).unwrap();
            let weight = surface(d) * kernel.radius() / n as f64;
            square += k * k * weight;
            for (power, scale) in [(0, 1.0), (1, d * d)] {
                sums[0][power] += k * weight * scale;
                sums[1][power] += (k - b) * weight * scale;
            }
        }
        (sums, square)
    }

    #[test]
    fn moments_are_those_of_the_theory() {
        let disc = moments(Kernel::disc(0.3), |d| 2.0 * PI * d);
        let ball = moments(Kernel::ball(0.3), |d| 4.0 * PI * d * d);
        let kernels = [Kernel::disc(0.3), Kernel::ball(0.3)];
        for (kernel, (_, square)) in kernels.iter().zip([disc, ball]) {
            assert!((kernel.content() * square - 1.0).abs() < 1e-6);
        }
        for ((m, _), dimensions) in [(disc, 2.0), (ball, 3.0)] {
            let second = 0.09 * dimensions / (dimensions + 6.0);
            let expected = [[1.0, second], [1.0, 0.0]];
            for (row, expected) in m.iter().zip(expected) {
                for (value, expected) in row.iter().zip(expected) {
                    assert!((value - expected).abs() < 1e-6, "{value} {expected}");
                }
            }
        }
        assert_eq!(Kernel::disc(0.3).weigh(0.09), None);
    }
}
