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
        bezier(&self.control, theta)
    }

    /// Velocity dx/dσ at θ; its length is the index n up to the tolerance of the step.
    pub fn velocity(&self, theta: f64) -> DVec3 {
        if self.straight {
            return (self.control[5] - self.control[0]) / self.h;
        }
        let c = &self.control;
        let d: [DVec3; 5] = std::array::from_fn(|i| c[i + 1] - c[i]);
        bezier(&d, theta) * (5.0 / self.h)
    }

    /// Arc length from the start to θ.
    pub fn arc_length(&self, theta: f64) -> f64 {
        self.integrate(theta, |speed| speed)
    }

    /// Optical path length ∫n ds = ∫n² dσ from the start to θ.
    pub fn optical_length(&self, theta: f64) -> f64 {
        self.integrate(theta, |speed| speed * speed)
    }

    /// θ at which the arc length from the start is `s`; 1 if the piece is shorter.
    pub fn theta_at_length(&self, s: f64) -> f64 {
        self.theta_at(s, |speed| speed)
    }

    /// θ at which the optical path length from the start is `s`; 1 if the piece is shorter.
    pub fn theta_at_optical_length(&self, s: f64) -> f64 {
        self.theta_at(s, |speed| speed * speed)
    }

    /// θ at which ∫f(|v|) dσ from the start reaches `target`.
    fn theta_at(&self, target: f64, f: impl Fn(f64) -> f64) -> f64 {
        let total = self.integrate(1.0, &f);
        let mut theta = (target / total).clamp(0.0, 1.0);
        if self.straight || target >= total {
            return theta;
        }
        // Newton from the proportional guess: the speed is nearly constant over one step.
        for _ in 0..4 {
            let excess = self.integrate(theta, &f) - target;
            let slope = f(self.velocity(theta).length()) * self.h;
            theta = (theta - excess / slope).clamp(0.0, 1.0);
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
        for _ in 0..64 {
            let theta = (low * f_high - high * f_low) / (f_high - f_low);
            let f = slope(theta);
            if f == 0.0 || high - low < 1e-15 {
                return theta;
            }
            if f < 0.0 {
                (low, f_low) = (theta, f);
                f_high *= 0.5;
            } else {
                (high, f_high) = (theta, f);
                f_low *= 0.5;
            }
        }
        0.5 * (low + high)
    }

    /// ∫ f(|v|) dσ from the start to θ by Gauss–Legendre quadrature with four nodes. The speed |v|
    /// of the dense output stands for the index, so no field evaluation is needed.
    fn integrate(&self, theta: f64, f: impl Fn(f64) -> f64) -> f64 {
        if self.straight {
            return f(self.velocity(0.0).length()) * theta * self.h;
        }
        const NODES: [(f64, f64); 4] = [
            (0.069_431_844_202_973_7, 0.173_927_422_568_726_9),
            (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
            (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
            (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
        ];
        let sum: f64 = NODES
            .iter()
            .map(|&(node, weight)| weight * f(self.velocity(node * theta).length()))
            .sum();
        sum * theta * self.h
    }
}

/// De Casteljau's algorithm.
fn bezier<const N: usize>(control: &[DVec3; N], theta: f64) -> DVec3 {
    let mut c = *control;
    for k in 1..N {
        for i in 0..N - k {
            c[i] += (c[i + 1] - c[i]) * theta;
        }
    }
    c[0]
}
