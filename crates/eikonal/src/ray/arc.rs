//! A piece of a ray as a curve: the dense output of one step.

use crate::bounds::Aabb;
use glam::DVec3;

/// A piece of a ray over a span `h` of σ: x(θ), θ ∈ [0, 1], σ = σ₀ + hθ.
///
/// The curve is the quintic that matches position, velocity and acceleration at both ends
/// (Hermite), held as six Bézier control points: it lies in their convex hull, so boxes and
/// intersection tests made from them are conservative. A straight piece has equally spaced
/// control points and is marked as such.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    control: [DVec3; 6],
    h: f64,
    straight: bool,
}

impl Arc {
    /// The straight piece x + v·hθ.
    pub fn line(x: DVec3, v: DVec3, h: f64) -> Self {
        Arc {
            control: std::array::from_fn(|i| x + v * (h * i as f64 / 5.0)),
            h,
            straight: true,
        }
    }

    /// The quintic with position, velocity dx/dσ and acceleration d²x/dσ² given at both ends.
    pub fn hermite(start: [DVec3; 3], end: [DVec3; 3], h: f64) -> Self {
        let [x0, v0, a0] = start;
        let [x1, v1, a1] = end;
        let (d, c) = (h / 5.0, h * h / 20.0);
        Arc {
            control: [
                x0,
                x0 + v0 * d,
                x0 + v0 * (2.0 * d) + a0 * c,
                x1 - v1 * (2.0 * d) + a1 * c,
                x1 - v1 * d,
                x1,
            ],
            h,
            straight: false,
        }
    }

    /// The Bézier control points, first and last on the curve.
    pub fn control(&self) -> &[DVec3; 6] {
        &self.control
    }

    /// Span of σ.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Whether the piece is a straight segment.
    pub fn is_straight(&self) -> bool {
        self.straight
    }

    /// First point, θ = 0.
    pub fn start(&self) -> DVec3 {
        self.control[0]
    }

    /// Last point, θ = 1.
    pub fn end(&self) -> DVec3 {
        self.control[5]
    }

    /// A box that contains the whole piece.
    pub fn aabb(&self) -> Aabb {
        if self.straight {
            Aabb::new(self.control[0], self.control[5])
        } else {
            Aabb::around(self.control)
        }
    }

    /// Position x(θ).
    pub fn position(&self, theta: f64) -> DVec3 {
        if self.straight {
            return self.control[0] + (self.control[5] - self.control[0]) * theta;
        }
        let (t, u) = (theta, 1.0 - theta);
        let (t2, u2) = (t * t, u * u);
        let middle = 10.0 * t2 * u2;
        let weights = [
            u2 * u2 * u,
            5.0 * u2 * u2 * t,
            middle * u,
            middle * t,
            5.0 * t2 * t2 * u,
            t2 * t2 * t,
        ];
        combined(&weights, &self.control)
    }

    /// Velocity dx/dσ at θ; its length is the index n up to the tolerance of the step.
    pub fn velocity(&self, theta: f64) -> DVec3 {
        if self.straight {
            return (self.control[5] - self.control[0]) / self.h;
        }
        combined(&quartic(theta), &self.differences()) * (5.0 / self.h)
    }

    /// Arc length from the start to θ.
    pub fn arc_length(&self, theta: f64) -> f64 {
        self.integrate(theta, f64::sqrt)
    }

    /// Optical path length ∫n ds = ∫n² dσ from the start to θ.
    pub fn optical_length(&self, theta: f64) -> f64 {
        self.integrate(theta, |square| square)
    }

    /// Arc length and optical path length from the start to θ.
    pub fn lengths(&self, theta: f64) -> [f64; 2] {
        let squares = self.squares(theta);
        [weighted(squares.map(f64::sqrt)), weighted(squares)].map(|sum| sum * theta * self.h)
    }

    /// θ at which the arc length from the start is `s`; 1 if the piece is shorter.
    pub fn theta_at_length(&self, s: f64) -> f64 {
        self.theta_at(s, f64::sqrt)
    }

    /// θ at which the optical path length from the start is `s`; 1 if the piece is shorter.
    pub fn theta_at_optical_length(&self, s: f64) -> f64 {
        self.theta_at(s, |square| square)
    }

    /// θ at which ∫f(|v|²) dσ from the start reaches `target`.
    fn theta_at(&self, target: f64, f: impl Fn(f64) -> f64) -> f64 {
        let total = self.integrate(1.0, &f);
        if self.straight || target >= total {
            return (target / total).clamp(0.0, 1.0);
        }
        let rate = |theta: f64| f(self.velocity(theta).length_squared()) * self.h;
        let mut theta = inverse(rate(0.0), total, rate(1.0), target);
        for _ in 0..4 {
            let excess = self.integrate(theta, &f) - target;
            let change = excess / rate(theta);
            theta = (theta - change).clamp(0.0, 1.0);
            // The next change would be its square.
            if change.abs() < 1e-8 {
                break;
            }
        }
        theta
    }

    /// θ in [0, 1] nearest to `y`: the first local minimum of the distance, or an end.
    pub fn closest_approach(&self, y: DVec3) -> f64 {
        let slope = |theta: f64| (self.position(theta) - y).dot(self.velocity(theta));
        let (mut low, mut high) = (0.0, 1.0);
        if slope(low) >= 0.0 {
            return low;
        }
        if slope(high) <= 0.0 {
            return high;
        }
        // Bisection keeps the bracket; secant steps inside it converge quickly (Illinois).
        let (mut f_low, mut f_high) = (slope(low), slope(high));
        let mut theta = low;
        for _ in 0..64 {
            let last = theta;
            theta = (low * f_high - high * f_low) / (f_high - f_low);
            let f = slope(theta);
            if f == 0.0 || (theta - last).abs() < 1e-14 {
                break;
            }
            if f < 0.0 {
                (low, f_low) = (theta, f);
                f_high *= 0.5;
            } else {
                (high, f_high) = (theta, f);
                f_low *= 0.5;
            }
        }
        theta
    }

    /// ∫ f(|v|²) dσ from the start to θ. The speed |v| of the dense output stands for the index, so no field
    /// evaluation is needed.
    fn integrate(&self, theta: f64, f: impl Fn(f64) -> f64) -> f64 {
        weighted(self.squares(theta).map(f)) * theta * self.h
    }

    /// |v|² at the nodes of the quadrature from the start to θ.
    fn squares(&self, theta: f64) -> [f64; 4] {
        if self.straight {
            return [self.velocity(0.0).length_squared(); 4];
        }
        let differences = self.differences();
        let square = |weights: [f64; 5]| combined(&weights, &differences).length_squared();
        let per_span = (5.0 / self.h).powi(2);
        if theta == 1.0 {
            return QUARTICS.map(|weights| square(weights) * per_span);
        }
        NODES.map(|node| square(quartic(node * theta)) * per_span)
    }

    /// From each control point to the next.
    fn differences(&self) -> [DVec3; 5] {
        std::array::from_fn(|i| self.control[i + 1] - self.control[i])
    }
}

/// Nodes of Gauss–Legendre quadrature on [0, 1].
const NODES: [f64; 4] = [
    0.069_431_844_202_973_7,
    0.330_009_478_207_571_9,
    0.669_990_521_792_428_1,
    0.930_568_155_797_026_3,
];

/// Their weights; the same from either end.
const OUTER: f64 = 0.173_927_422_568_726_9;
const INNER: f64 = 0.326_072_577_431_273_1;

/// Bernstein's polynomials at the nodes.
const QUARTICS: [[f64; 5]; 4] = [
    quartic(NODES[0]),
    quartic(NODES[1]),
    quartic(NODES[2]),
    quartic(NODES[3]),
];

/// Gauss–Legendre quadrature over [0, 1] from the values at the nodes.
fn weighted([a, b, c, d]: [f64; 4]) -> f64 {
    OUTER * (a + d) + INNER * (b + c)
}

/// Where in [0, 1] a function that is 0 and `total` at the ends, with these slopes, reaches `target`, if it is
/// cubic and nearly linear.
fn inverse(first: f64, total: f64, last: f64, target: f64) -> f64 {
    let (b, c) = (3.0 * total - 2.0 * first - last, first + last - 2.0 * total);
    let mut t = target / total;
    for _ in 0..2 {
        let excess = t * (first + t * (b + t * c)) - target;
        t = (t - excess / (first + t * (2.0 * b + t * 3.0 * c))).clamp(0.0, 1.0);
    }
    t
}

/// Bernstein's polynomials of degree four.
const fn quartic(t: f64) -> [f64; 5] {
    let u = 1.0 - t;
    let (t2, u2) = (t * t, u * u);
    let middle = 4.0 * t * u;
    [u2 * u2, middle * u2, 6.0 * t2 * u2, middle * t2, t2 * t2]
}

/// Σ wᵢpᵢ.
fn combined<const N: usize>(weights: &[f64; N], points: &[DVec3; N]) -> DVec3 {
    let mut sum = points[0] * weights[0];
    for i in 1..N {
        sum += points[i] * weights[i];
    }
    sum
}
