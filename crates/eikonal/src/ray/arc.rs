//! A piece of a ray as a curve: the dense output of one step (docs/theory.md#dense-output).

use crate::bounds::Aabb;
use glam::DVec3;

/// Change of θ below which a Newton step is the last: the next change would be about its square.
const MAX_LAST_STEP: f64 = 1e-5;

/// A piece of a ray over a span `h` of σ: x(θ), θ ∈ [0, 1], σ = σ₀ + hθ.
///
/// A curved piece is the quintic that matches position, velocity and acceleration at both ends
/// (Hermite), stored as six Bézier control points. It lies in their convex hull, so that boxes and
/// intersection tests made from them are conservative. A straight piece has closed forms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    curve: Curve,
    h: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Curve {
    /// Straight: start, step to the end, and length of the step.
    Line(DVec3, DVec3, f64),
    /// Curved: Bézier control points.
    Quintic([DVec3; 6]),
}

impl Arc {
    /// Returns the straight piece x + v·hθ.
    #[inline]
    pub fn line(x: DVec3, v: DVec3, h: f64) -> Self {
        let step = v * h;
        Arc {
            curve: Curve::Line(x, step, step.length()),
            h,
        }
    }

    /// Returns the straight piece of a length in a unit direction, where the index is `n`.
    #[inline]
    pub fn straight(x: DVec3, direction: DVec3, length: f64, n: f64) -> Self {
        Arc {
            curve: Curve::Line(x, direction * length, length),
            h: length / n,
        }
    }

    /// Returns the quintic with position, velocity dx/dσ and acceleration d²x/dσ² given at both
    /// ends.
    pub fn hermite(start: [DVec3; 3], end: [DVec3; 3], h: f64) -> Self {
        let [x0, v0, a0] = start;
        let [x1, v1, a1] = end;
        let (d, c) = (h / 5.0, h * h / 20.0);
        Arc {
            curve: Curve::Quintic([
                x0,
                x0 + v0 * d,
                x0 + v0 * (2.0 * d) + a0 * c,
                x1 - v1 * (2.0 * d) + a1 * c,
                x1 - v1 * d,
                x1,
            ]),
            h,
        }
    }

    /// Returns the piece from its end to its start.
    pub fn reversed(&self) -> Self {
        let curve = match self.curve {
            Curve::Line(start, step, length) => Curve::Line(start + step, -step, length),
            Curve::Quintic(mut control) => {
                control.reverse();
                Curve::Quintic(control)
            }
        };
        Arc { curve, h: self.h }
    }

    /// Returns the Bézier control points, first and last on the curve; evenly spaced if it is
    /// straight.
    pub fn control(&self) -> [DVec3; 6] {
        match self.curve {
            Curve::Line(start, step, _) => std::array::from_fn(|i| start + step * (i as f64 / 5.0)),
            Curve::Quintic(control) => control,
        }
    }

    /// Returns the span of σ.
    #[inline]
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Returns true if the piece is straight.
    #[inline]
    pub fn is_straight(&self) -> bool {
        matches!(self.curve, Curve::Line(..))
    }

    /// Returns the first point, θ = 0.
    #[inline]
    pub fn start(&self) -> DVec3 {
        match &self.curve {
            Curve::Line(start, ..) => *start,
            Curve::Quintic(control) => control[0],
        }
    }

    /// Returns the last point, θ = 1.
    #[inline]
    pub fn end(&self) -> DVec3 {
        match &self.curve {
            Curve::Line(start, step, _) => *start + *step,
            Curve::Quintic(control) => control[5],
        }
    }

    /// Returns a box that contains the whole piece.
    pub fn aabb(&self) -> Aabb {
        match &self.curve {
            Curve::Line(..) => Aabb::new(self.start(), self.end()),
            Curve::Quintic(control) => Aabb::around(*control),
        }
    }

    /// Returns the position x(θ).
    #[inline]
    pub fn position(&self, theta: f64) -> DVec3 {
        match &self.curve {
            Curve::Line(start, step, _) => *start + *step * theta,
            Curve::Quintic(control) => combined(&quintic(theta), control),
        }
    }

    /// Returns the velocity dx/dσ at θ; its length is the index n up to the tolerance of the step.
    #[inline]
    pub fn velocity(&self, theta: f64) -> DVec3 {
        match &self.curve {
            Curve::Line(_, step, _) => *step / self.h,
            Curve::Quintic(control) => {
                combined(&quartic(theta), &differences(control)) * (5.0 / self.h)
            }
        }
    }

    /// Returns the derivative dx/dθ at θ.
    #[inline]
    pub fn derivative(&self, theta: f64) -> DVec3 {
        match &self.curve {
            Curve::Line(_, step, _) => *step,
            Curve::Quintic(control) => combined(&quartic(theta), &differences(control)) * 5.0,
        }
    }

    /// Returns the acceleration d²x/dσ² at θ.
    pub fn acceleration(&self, theta: f64) -> DVec3 {
        match &self.curve {
            Curve::Line(..) => DVec3::ZERO,
            Curve::Quintic(control) => {
                let d = differences(control);
                let second: [DVec3; 4] = std::array::from_fn(|i| d[i + 1] - d[i]);
                combined(&cubic(theta), &second) * (20.0 / (self.h * self.h))
            }
        }
    }

    /// Returns the arc length from the start to θ.
    #[inline]
    pub fn arc_length(&self, theta: f64) -> f64 {
        match &self.curve {
            Curve::Line(_, _, length) => length * theta,
            Curve::Quintic(control) => self.integrate(control, theta, f64::sqrt),
        }
    }

    /// Returns the optical path length ∫n ds = ∫n² dσ from the start to θ.
    #[inline]
    pub fn optical_length(&self, theta: f64) -> f64 {
        match &self.curve {
            Curve::Line(_, step, _) => step.length_squared() / self.h * theta,
            Curve::Quintic(control) => self.integrate(control, theta, |square| square),
        }
    }

    /// Returns arc length and optical path length from the start to θ.
    pub fn lengths(&self, theta: f64) -> [f64; 2] {
        match &self.curve {
            Curve::Line(..) => [self.arc_length(theta), self.optical_length(theta)],
            Curve::Quintic(control) => {
                let squares = self.squares(control, theta);
                let sums = [weighted(squares.map(f64::sqrt)), weighted(squares)];
                sums.map(|sum| sum * theta * self.h)
            }
        }
    }

    /// Returns arc length and optical path length as quintics of θ, with the values of
    /// [`lengths`](Self::lengths), the rates and their changes at both ends.
    pub fn lengths_along(&self) -> [LengthAlong; 2] {
        if self.is_straight() {
            return self.lengths(1.0).map(LengthAlong::even);
        }
        let h = self.h;
        let rates = [0.0, 1.0].map(|theta| {
            let (v, a) = (self.velocity(theta), self.acceleration(theta));
            let (square, change) = (v.length_squared(), v.dot(a));
            let speed = square.sqrt();
            [
                [speed * h, change / speed * h * h],
                [square * h, 2.0 * change * h * h],
            ]
        });
        let totals = self.lengths(1.0);
        [0, 1].map(|i| LengthAlong::quintic(rates[0][i], totals[i], rates[1][i]))
    }

    /// Returns the θ at which the arc length from the start is `s`; 1 if the piece is shorter.
    pub fn theta_at_length(&self, s: f64) -> f64 {
        self.theta_at(s, f64::sqrt)
    }

    /// Returns the θ at which the optical path length from the start is `s`; 1 if the piece is
    /// shorter.
    pub fn theta_at_optical_length(&self, s: f64) -> f64 {
        self.theta_at(s, |square| square)
    }

    /// Returns the θ at which the arc length is `s`, between two θ with known arc lengths; the
    /// first of them if the lengths do not differ.
    pub fn theta_between(&self, theta: [f64; 2], lengths: [f64; 2], s: f64) -> f64 {
        let length = lengths[1] - lengths[0];
        let share = if length > 0.0 {
            ((s - lengths[0]) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let guess = theta[0] + share * (theta[1] - theta[0]);
        match &self.curve {
            Curve::Line(..) => guess,
            Curve::Quintic(control) => self
                .by_newton(control, guess, s, &f64::sqrt)
                .clamp(theta[0], theta[1]),
        }
    }

    /// Returns the θ at which ∫f(|v|²) dσ from the start reaches `target`.
    fn theta_at(&self, target: f64, f: impl Fn(f64) -> f64) -> f64 {
        let control = match &self.curve {
            Curve::Line(_, step, _) => {
                let total = f(step.length_squared() / (self.h * self.h)) * self.h;
                return (target / total).clamp(0.0, 1.0);
            }
            Curve::Quintic(control) => control,
        };
        let total = self.integrate(control, 1.0, &f);
        if target >= total {
            return (target / total).clamp(0.0, 1.0);
        }
        let [first, .., last] = differences(control);
        let at_end = |difference: DVec3| f((difference * (5.0 / self.h)).length_squared()) * self.h;
        let guess = LengthAlong::cubic(at_end(first), total, at_end(last)).inverse(target);
        self.by_newton(control, guess, target, &f)
    }

    /// Returns the θ at which ∫f(|v|²) dσ from the start reaches `target`, by Newton's method from
    /// a guess.
    fn by_newton(
        &self,
        control: &[DVec3; 6],
        guess: f64,
        target: f64,
        f: &impl Fn(f64) -> f64,
    ) -> f64 {
        let rate = |theta: f64| f(self.velocity(theta).length_squared()) * self.h;
        let mut theta = guess;
        for _ in 0..4 {
            let excess = self.integrate(control, theta, f) - target;
            let change = excess / rate(theta);
            theta = (theta - change).clamp(0.0, 1.0);
            if change.abs() < MAX_LAST_STEP {
                break;
            }
        }
        theta
    }

    /// Returns the θ in [0, 1] nearest to `y`: the first local minimum of the distance, or an end.
    pub fn closest_approach(&self, y: DVec3) -> f64 {
        let control = match &self.curve {
            Curve::Line(start, step, _) => {
                return ((y - *start).dot(*step) / step.length_squared()).clamp(0.0, 1.0);
            }
            Curve::Quintic(control) => control,
        };
        let differences = differences(control);
        let (mut low, mut high) = (0.0, 1.0);
        let f_low = (control[0] - y).dot(differences[0]);
        if f_low >= 0.0 {
            return low;
        }
        let f_high = (control[5] - y).dot(differences[4]);
        if f_high <= 0.0 {
            return high;
        }
        // Apply Newton's method to the derivative of half the squared distance; bisect where a step
        // would leave the bracket.
        let second: [DVec3; 4] = std::array::from_fn(|i| differences[i + 1] - differences[i]);
        let mut theta = f_low / (f_low - f_high);
        for _ in 0..64 {
            let away = combined(&quintic(theta), control) - y;
            let velocity = combined(&quartic(theta), &differences) * 5.0;
            let acceleration = combined(&cubic(theta), &second) * 20.0;
            let f = away.dot(velocity);
            let curvature = velocity.length_squared() + away.dot(acceleration);
            if f < 0.0 {
                low = theta
            } else {
                high = theta
            }
            let change = f / curvature;
            let inside = low <= theta - change && theta - change <= high;
            theta = if inside {
                theta - change
            } else {
                0.5 * (low + high)
            };
            if inside && change.abs() < MAX_LAST_STEP {
                break;
            }
        }
        theta
    }

    /// Integrates f(|v|²) dσ from the start of a curve to θ. The speed |v| of the dense output
    /// replaces the index, so that the field is not evaluated.
    fn integrate(&self, control: &[DVec3; 6], theta: f64, f: impl Fn(f64) -> f64) -> f64 {
        weighted(self.squares(control, theta).map(f)) * theta * self.h
    }

    /// Returns |v|² at the quadrature nodes between the start of a curve and θ.
    fn squares(&self, control: &[DVec3; 6], theta: f64) -> [f64; 4] {
        let differences = differences(control);
        let square = |weights: [f64; 5]| combined(&weights, &differences).length_squared();
        let per_span = (5.0 / self.h).powi(2);
        if theta == 1.0 {
            return QUARTICS.map(|weights| square(weights) * per_span);
        }
        NODES.map(|node| square(quartic(node * theta)) * per_span)
    }
}

/// Length along an arc as a polynomial of θ without a constant term.
#[derive(Clone, Copy, Debug)]
pub struct LengthAlong([f64; 5]);

impl LengthAlong {
    /// Creates the length of a straight arc, which is `total` at θ = 1.
    #[inline]
    pub fn even(total: f64) -> Self {
        LengthAlong([total, 0.0, 0.0, 0.0, 0.0])
    }

    /// Creates the cubic that is `total` at θ = 1, from its rates at both ends.
    fn cubic(first: f64, total: f64, last: f64) -> Self {
        let second = 3.0 * total - 2.0 * first - last;
        LengthAlong([first, second, first + last - 2.0 * total, 0.0, 0.0])
    }

    /// Creates the quintic that is `total` at θ = 1, from its first and second derivatives at both
    /// ends.
    #[inline]
    pub(super) fn quintic(first: [f64; 2], total: f64, last: [f64; 2]) -> Self {
        let (a, b) = (first[0], 0.5 * first[1]);
        let [value, slope, curvature] = [total - a - b, last[0] - a - 2.0 * b, 0.5 * last[1] - b];
        LengthAlong([
            a,
            b,
            10.0 * value - 4.0 * slope + curvature,
            -15.0 * value + 7.0 * slope - 2.0 * curvature,
            6.0 * value - 3.0 * slope + curvature,
        ])
    }

    /// Returns the length from the start to θ.
    #[inline]
    pub fn at(&self, theta: f64) -> f64 {
        let sum = |sum: f64, c: &f64| (sum + c) * theta;
        self.0.iter().rev().fold(0.0, sum)
    }

    /// Returns the derivative by θ.
    #[inline]
    fn rate(&self, theta: f64) -> f64 {
        let [a, b, c, d, e] = self.0;
        a + theta * (2.0 * b + theta * (3.0 * c + theta * (4.0 * d + theta * 5.0 * e)))
    }

    /// Approximates the θ in [0, 1] at which the length is `target`; the length must be nearly
    /// proportional to θ.
    pub(super) fn inverse(&self, target: f64) -> f64 {
        let mut theta = target / self.at(1.0);
        for _ in 0..2 {
            let excess = self.at(theta) - target;
            theta = (theta - excess / self.rate(theta)).clamp(0.0, 1.0);
        }
        theta
    }
}

/// Returns the differences of consecutive control points.
fn differences(control: &[DVec3; 6]) -> [DVec3; 5] {
    std::array::from_fn(|i| control[i + 1] - control[i])
}

/// Nodes of Gauss–Legendre quadrature with four points on [0, 1].
pub(super) const NODES: [f64; 4] = [
    0.069_431_844_202_973_7,
    0.330_009_478_207_571_9,
    0.669_990_521_792_428_1,
    0.930_568_155_797_026_3,
];

/// Weight of the outer nodes in Gauss–Legendre quadrature with four points; `INNER` is the weight
/// of the inner nodes.
const OUTER: f64 = 0.173_927_422_568_726_9;
const INNER: f64 = 0.326_072_577_431_273_1;

/// Bernstein polynomials at the nodes.
const QUARTICS: [[f64; 5]; 4] = [
    quartic(NODES[0]),
    quartic(NODES[1]),
    quartic(NODES[2]),
    quartic(NODES[3]),
];

/// Integrates over [0, 1] by Gauss–Legendre quadrature, from the values at the nodes.
pub(super) fn weighted([a, b, c, d]: [f64; 4]) -> f64 {
    OUTER * (a + d) + INNER * (b + c)
}

/// Returns the Bernstein polynomials of degree five.
fn quintic(t: f64) -> [f64; 6] {
    let u = 1.0 - t;
    let (t2, u2) = (t * t, u * u);
    let middle = 10.0 * t2 * u2;
    [
        u2 * u2 * u,
        5.0 * u2 * u2 * t,
        middle * u,
        middle * t,
        5.0 * t2 * t2 * u,
        t2 * t2 * t,
    ]
}

/// Returns the Bernstein polynomials of degree four.
const fn quartic(t: f64) -> [f64; 5] {
    let u = 1.0 - t;
    let (t2, u2) = (t * t, u * u);
    let middle = 4.0 * t * u;
    [u2 * u2, middle * u2, 6.0 * t2 * u2, middle * t2, t2 * t2]
}

/// Returns the Bernstein polynomials of degree three.
fn cubic(t: f64) -> [f64; 4] {
    let u = 1.0 - t;
    [u * u * u, 3.0 * u * u * t, 3.0 * u * t * t, t * t * t]
}

/// Returns Σ wᵢpᵢ.
fn combined<const N: usize>(weights: &[f64; N], points: &[DVec3; N]) -> DVec3 {
    let mut sum = points[0] * weights[0];
    for i in 1..N {
        sum += points[i] * weights[i];
    }
    sum
}
