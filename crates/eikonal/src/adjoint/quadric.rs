//! Surfaces of the second degree, with derivatives with respect to their parameters
//! (docs/theory.md#derivatives-of-rays).

use super::reverse::SurfaceDerivative;
use crate::interface::Displacement;
use crate::ray::Arc;
use crate::ray::bernstein::{first_root, height, product};
use glam::{DMat3, DVec3};

/// Maximum number of roots of a polynomial of degree ten.
const MAX_ROOTS: usize = 10;
/// Number of coefficients of the departure of an asphere from a conic.
pub const DEPARTURES: usize = 8;
/// Parts of an arc in which an asphere is searched for, besides those that end on its conic.
const ARC_PARTS: usize = 16;
/// Maximum number of iterations that refine a root. Bisection alone takes 53.
const MAX_ITERATIONS: usize = 100;

/// Zero set of F = α(ρ² + w²) + βw² + γw + δ, with d = x − `point`, z = `axis`·d, the distance
/// ρ = |d − z `axis`| from the axis, and w = z − Σ a_j ρ^2j: planes, spheres, cylinders, conics of
/// revolution, and even aspheres. Without departure a_j, F is α|d|² + βz² + γz + δ. If γ is not zero,
/// only the sheet through `point` counts, on which F is monotonic along the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// Point of the axis.
    pub point: DVec3,
    /// Unit vector along the axis.
    pub axis: DVec3,
    /// Coefficients α, β, γ, δ.
    pub form: [f64; 4],
    /// Coefficients a_1, a_2, … of ρ², ρ⁴, …. Surfaces with a departure need δ = 0 and γ ≠ 0.
    pub departure: [f64; DEPARTURES],
}

/// Position relative to a quadric, and the departure there.
struct Local {
    d: DVec3,
    /// Position along the axis.
    z: f64,
    /// Component of `d` across the axis.
    across: DVec3,
    /// Departure P(ρ²), and its first two derivatives with respect to ρ².
    departure: [f64; 3],
    /// Position along the axis relative to the departure.
    w: f64,
    /// Derivative S = ∂F/∂w at a fixed distance from the axis.
    steep: f64,
}

/// Returns the real roots of aθ² + 2bθ + c in ascending order, without cancellation; infinite or NaN
/// where there is none.
fn quadratic_roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let root = (b * b - a * c).sqrt();
    let q = -(b + root.copysign(b));
    let (one, other) = (q / a, c / q);
    if one < other {
        [one, other]
    } else {
        [other, one]
    }
}

/// Derivatives with respect to the point, the axis, the form and the departure of a [`Quadric`].
pub type QuadricDerivative = [f64; 10 + DEPARTURES];

impl Quadric {
    /// Creates the plane through `point` with the unit normal `normal`.
    pub fn plane(point: DVec3, normal: DVec3) -> Self {
        Quadric {
            point,
            axis: normal,
            form: [0.0, 0.0, 1.0, 0.0],
            departure: [0.0; DEPARTURES],
        }
    }

    /// Returns true if the surface is a quadric.
    fn is_quadric(&self) -> bool {
        self.departure == [0.0; DEPARTURES]
    }

    /// Returns the position of a point relative to the surface.
    fn local(&self, x: DVec3) -> Local {
        let [alpha, beta, gamma, _] = self.form;
        let d = x - self.point;
        let z = self.axis.dot(d);
        let across = d - self.axis * z;
        let departure = self.departure_at(across.length_squared());
        let w = z - departure[0];
        Local {
            d,
            z,
            across,
            departure,
            w,
            steep: 2.0 * (alpha + beta) * w + gamma,
        }
    }

    /// Returns the departure P(u) at a squared distance u from the axis, and its first two
    /// derivatives.
    fn departure_at(&self, u: f64) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for a in self.departure.iter().rev() {
            sums[2] = sums[2] * u + 2.0 * sums[1];
            sums[1] = sums[1] * u + sums[0];
            sums[0] = sums[0] * u + a;
        }
        let [value, first, second] = sums;
        // P(u) = u Q(u) with the sums of Q.
        [u * value, value + u * first, 2.0 * first + u * second]
    }

    /// Returns the θ in (0, 1] at which an arc first meets the surface.
    pub(super) fn first(&self, arc: &Arc) -> Option<f64> {
        if !self.is_quadric() {
            return self.first_of_asphere(arc);
        }
        if arc.is_straight() {
            return self.first_on_line(arc);
        }
        let [alpha, beta, gamma, delta] = self.form;
        let control = arc.control();
        let z = height(&control, self.point, self.axis);
        let squares = DVec3::AXES.map(|axis| {
            let d = height(&control, self.point, axis);
            product::<6, 6, 11>(&d, &d)
        });
        let (z2, z) = (
            product::<6, 6, 11>(&z, &z),
            product::<6, 6, 11>(&z, &[1.0; 6]),
        );
        let f: [f64; 11] = std::array::from_fn(|i| {
            let d2: f64 = squares.iter().map(|square| square[i]).sum();
            alpha * d2 + beta * z2[i] + gamma * z[i] + delta
        });
        let mut from = 0.0;
        for _ in 0..MAX_ROOTS {
            let theta = first_root(&f, from, 1.0, [0.0; 2])?;
            if self.holds(arc.position(theta)) {
                return Some(theta);
            }
            from = theta;
        }
        None
    }

    /// Returns the θ in (0, 1] at which a straight arc first meets the surface.
    fn first_on_line(&self, arc: &Arc) -> Option<f64> {
        let [alpha, beta, gamma, delta] = self.form;
        let (d, step) = (arc.start() - self.point, arc.derivative(0.0));
        let (z, rise) = (self.axis.dot(d), self.axis.dot(step));
        let roots = quadratic_roots(
            alpha * step.length_squared() + beta * rise * rise,
            alpha * d.dot(step) + (beta * z + 0.5 * gamma) * rise,
            alpha * d.length_squared() + (beta * z + gamma) * z + delta,
        );
        let meets = |&theta: &f64| theta > 0.0 && theta <= 1.0 && self.holds(arc.position(theta));
        roots.into_iter().find(meets)
    }

    /// Returns the θ in (0, 1] at which an arc first meets an asphere: the first change of side
    /// among the ends of parts of the arc and its intersections with the conic.
    fn first_of_asphere(&self, arc: &Arc) -> Option<f64> {
        let conic = Quadric {
            departure: [0.0; DEPARTURES],
            ..*self
        };
        let parts = (1..=ARC_PARTS).map(|i| i as f64 / ARC_PARTS as f64);
        let mut ends: Vec<f64> = parts.chain(conic.first(arc)).collect();
        ends.sort_by(f64::total_cmp);
        let height = |theta: f64| self.height(arc.position(theta));
        let (mut from, mut before) = (0.0, height(0.0));
        for to in ends {
            let after = height(to);
            if (before < 0.0) != (after < 0.0) {
                let theta = root([from, to], [before, after], height);
                return self.reaches(arc.position(theta)).then_some(theta);
            }
            (from, before) = (to, after);
        }
        None
    }

    /// Returns the height of a point above the asphere along its axis. Beyond the rim of the conic,
    /// the surface continues at the height of the rim.
    fn height(&self, x: DVec3) -> f64 {
        let local = self.local(x);
        let [alpha, beta, gamma, _] = self.form;
        // Solve (α + β)w² + γw + αu = 0 for the sheet through the vertex.
        let square = gamma * gamma - 4.0 * (alpha + beta) * alpha * local.across.length_squared();
        let steep = square.max(0.0).sqrt().copysign(gamma);
        let u = if square < 0.0 {
            gamma * gamma / (4.0 * (alpha + beta) * alpha)
        } else {
            local.across.length_squared()
        };
        local.z - self.departure_at(u)[0] + 2.0 * alpha * u / (gamma + steep)
    }

    /// Returns true if a point lies within the rim of the conic.
    fn reaches(&self, x: DVec3) -> bool {
        let [alpha, beta, gamma, _] = self.form;
        let u = self.local(x).across.length_squared();
        gamma * gamma > 4.0 * (alpha + beta) * alpha * u
    }

    /// Returns true if a point lies on the sheet of the quadric that belongs to the surface.
    fn holds(&self, x: DVec3) -> bool {
        let [alpha, beta, gamma, _] = self.form;
        let z = self.axis.dot(x - self.point);
        gamma == 0.0 || (2.0 * (alpha + beta) * z + gamma) * gamma > 0.0
    }

    /// Returns the gradient ∇F.
    fn gradient(&self, x: DVec3) -> DVec3 {
        let local = self.local(x);
        local.across * (2.0 * self.spread(&local)) + self.axis * local.steep
    }

    /// Returns ∂F/∂ρ² at a fixed position along the axis.
    fn spread(&self, local: &Local) -> f64 {
        self.form[0] - local.steep * local.departure[1]
    }

    /// Returns Hess F times a vector.
    fn bent(&self, local: &Local, v: DVec3) -> DVec3 {
        let [alpha, beta, ..] = self.form;
        let [_, first, second] = local.departure;
        let along = self.axis.dot(v);
        let outwards = 2.0 * local.across.dot(v);
        let turn = 2.0 * (alpha + beta) * (along - first * outwards);
        (v - self.axis * along) * (2.0 * self.spread(local))
            - local.across * (2.0 * (local.steep * second * outwards + turn * first))
            + self.axis * turn
    }

    /// Returns the unit normal ∇F/|∇F| at a point, and its derivatives with respect to the
    /// position.
    pub(super) fn normal(&self, x: DVec3) -> (DVec3, DMat3) {
        let (gradient, local) = (self.gradient(x), self.local(x));
        let per = gradient.length_recip();
        let normal = gradient * per;
        let column = |axis| self.bent(&local, axis).reject_from_normalized(normal) * per;
        let [a, b, c] = DVec3::AXES.map(column);
        (normal, DMat3::from_cols(a, b, c))
    }

    /// Returns the distance of a point from the axis.
    pub(super) fn distance_from_axis(&self, x: DVec3) -> f64 {
        (x - self.point).reject_from_normalized(self.axis).length()
    }

    /// Estimates the largest distance of the surface from the origin, which scales the round-off of
    /// points on it.
    pub(super) fn extent(&self) -> f64 {
        let [alpha, _, _, delta] = self.form;
        let radius = if alpha == 0.0 {
            0.0
        } else {
            (delta / alpha).abs().sqrt()
        };
        self.point.length() + radius
    }

    /// Returns the displacement of the surface at a point for a change of its parameters.
    pub fn displacement(&self, x: DVec3, change: &QuadricDerivative) -> Displacement {
        let gradient = self.gradient(x);
        let per = gradient.length_recip();
        let (mut value, mut turn) = (0.0, DVec3::ZERO);
        for (part, amount) in self.parts(x).iter().zip(change) {
            value += part.value * amount;
            turn += part.gradient * *amount;
        }
        Displacement {
            offset: -value * per,
            turn: turn.reject_from_normalized(gradient * per) * per,
        }
    }

    /// Adds the derivative with respect to the parameters, given the derivative with respect to the
    /// displacement at a point: the transpose of [`Quadric::displacement`].
    pub(super) fn add_derivative(
        &self,
        x: DVec3,
        by: SurfaceDerivative,
        into: &mut QuadricDerivative,
    ) {
        let gradient = self.gradient(x);
        let per = gradient.length_recip();
        // Compute the derivatives with respect to F and ∇F at the point.
        let value = -by.offset * per;
        // Planted error "derivatives by surfaces whose normals do not turn", found by morgana-eikonal/eikonal::adjoint::surfaces::rays_through_sequences_of_surfaces:
        // let slope = 0.0 * by.turn.reject_from_normalized(gradient * per) * per;
        let slope = by.turn.reject_from_normalized(gradient * per) * per;
        for (sum, part) in into.iter_mut().zip(self.parts(x)) {
            *sum += part.value * value + part.gradient.dot(slope);
        }
    }

    /// Returns the derivatives of F and ∇F at a point with respect to each parameter.
    fn parts(&self, x: DVec3) -> [Part; 10 + DEPARTURES] {
        let [alpha, beta, ..] = self.form;
        let local = self.local(x);
        let Local {
            d, z, across, w, ..
        } = local;
        let [_, first, second] = local.departure;
        let (steep, spread) = (local.steep, self.spread(&local));
        let gradient = self.gradient(x);
        let u = across.length_squared();
        // ∇u and ∇w.
        let (outwards, upwards) = (2.0 * across, self.axis - across * (2.0 * first));
        let of_point = |axis: DVec3| Part {
            value: -gradient.dot(axis),
            gradient: -self.bent(&local, axis),
        };
        // A change of the axis changes z by δz, u by −2z δz, and the plane across it.
        let of_axis = |axis: DVec3| {
            let dz = d.dot(axis);
            let (du, dw) = (-2.0 * z * dz, dz * (1.0 + 2.0 * z * first));
            let turn = 2.0 * (alpha + beta) * dw;
            Part {
                value: alpha * du + steep * dw,
                gradient: axis * (steep - 2.0 * spread * z)
                    + self.axis * (turn - 2.0 * spread * dz)
                    - outwards * (turn * first + steep * second * du),
            }
        };
        let part = |value: f64, gradient: DVec3| Part { value, gradient };
        let of_form = [
            part(u + w * w, outwards + upwards * (2.0 * w)),
            part(w * w, upwards * (2.0 * w)),
            part(w, upwards),
            part(1.0, DVec3::ZERO),
        ];
        let of_departure = |j: i32| {
            let (power, slope) = (u.powi(j), f64::from(j) * u.powi(j - 1));
            let turn = upwards * (2.0 * (alpha + beta) * power) + outwards * (steep * slope);
            part(-steep * power, -turn)
        };
        let parts = DVec3::AXES.map(of_point).into_iter();
        let parts = parts.chain(DVec3::AXES.map(of_axis)).chain(of_form);
        let mut parts = parts.chain((1..).map(of_departure));
        std::array::from_fn(|_| parts.next().unwrap_or(part(0.0, DVec3::ZERO)))
    }
}

/// Derivatives of F and ∇F at a point with respect to a parameter.
#[derive(Clone, Copy)]
struct Part {
    value: f64,
    gradient: DVec3,
}

/// Returns the root of a function that changes its sign between two arguments, to round-off: the
/// regula falsi in the variant of Illinois, with bisections where it is slow.
fn root(
    [mut low, mut high]: [f64; 2],
    [mut below, mut above]: [f64; 2],
    f: impl Fn(f64) -> f64,
) -> f64 {
    let (mut last, mut kept_high) = (low, None);
    for i in 0..MAX_ITERATIONS {
        let secant = high - above * (high - low) / (above - below);
        let is_slow = i % 4 == 3 || !(secant > low && secant < high);
        let next = if is_slow { 0.5 * (low + high) } else { secant };
        let value = f(next);
        if value == 0.0 || (next - last).abs() <= f64::EPSILON * next {
            return next;
        }
        last = next;
        // Halve the value of an end that stays twice.
        if (value < 0.0) == (below < 0.0) {
            (low, below) = (next, value);
            if kept_high.replace(true) == Some(true) {
                above *= 0.5;
            }
        } else {
            (high, above) = (next, value);
            if kept_high.replace(false) == Some(false) {
                below *= 0.5;
            }
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asphere() -> Quadric {
        Quadric {
            point: DVec3::new(0.1, -0.2, 0.3),
            axis: DVec3::new(0.2, -0.1, 1.0).normalize(),
            form: [0.7, -0.3, -2.0, 0.0],
            departure: [0.2, -0.1, 0.05, 0.02, -0.03, 0.01, 0.02, -0.01],
        }
    }

    /// Returns F at a point.
    fn value(of: &Quadric, x: DVec3) -> f64 {
        let [alpha, beta, gamma, delta] = of.form;
        let Local { across, w, .. } = of.local(x);
        alpha * (across.length_squared() + w * w) + beta * w * w + gamma * w + delta
    }

    fn with(of: &Quadric, change: &QuadricDerivative, step: f64) -> Quadric {
        let vector = |at: usize| DVec3::from_slice(&change[at..]) * step;
        Quadric {
            point: of.point + vector(0),
            axis: of.axis + vector(3),
            form: std::array::from_fn(|i| of.form[i] + change[6 + i] * step),
            departure: std::array::from_fn(|i| of.departure[i] + change[10 + i] * step),
        }
    }

    /// Compares ∇F, Hess F and the derivatives with respect to all parameters with differences.
    #[test]
    fn derivatives_are_limits_of_differences() {
        let (surface, step) = (asphere(), 1e-5);
        for x in [DVec3::new(0.5, 0.4, 0.2), DVec3::new(-0.6, 0.7, 0.9)] {
            let gradient = |of: &Quadric, x: DVec3| of.gradient(x);
            for axis in DVec3::AXES {
                let [low, high] = [x - axis * step, x + axis * step];
                let slope = (value(&surface, high) - value(&surface, low)) / (2.0 * step);
                assert!((slope - gradient(&surface, x).dot(axis)).abs() < 1e-8);
                let turn = (gradient(&surface, high) - gradient(&surface, low)) / (2.0 * step);
                let bent = surface.bent(&surface.local(x), axis);
                assert!((turn - bent).length() < 1e-7, "{turn} {bent}");
            }
            for (i, part) in surface.parts(x).iter().enumerate() {
                let mut change = [0.0; 10 + DEPARTURES];
                change[i] = 1.0;
                if (3..6).contains(&i) {
                    // Axes stay unit vectors.
                    let turn = DVec3::AXES[i - 3].reject_from_normalized(surface.axis);
                    change[3..6].copy_from_slice(&turn.to_array());
                }
                let [low, high] = [-step, step].map(|step| with(&surface, &change, step));
                let found = (value(&high, x) - value(&low, x)) / (2.0 * step);
                let turn = (high.gradient(x) - low.gradient(x)) / (2.0 * step);
                let sum = |of: fn(&Part) -> DVec3| -> DVec3 {
                    let parts = surface.parts(x);
                    parts
                        .iter()
                        .zip(change)
                        .map(|(part, by)| of(part) * by)
                        .sum()
                };
                let expected = [sum(|part| DVec3::X * part.value).x, part.value];
                let expected = expected[usize::from(!(3..6).contains(&i))];
                assert!((found - expected).abs() < 1e-8, "{i}: {found} {expected}");
                let gradient = sum(|part| part.gradient);
                assert!((turn - gradient).length() < 1e-7, "{i}: {turn} {gradient}");
            }
        }
    }

    /// Rays along the axis, oblique rays, and rays from far away meet the asphere where F = 0, and
    /// rays beyond its rim miss it.
    #[test]
    fn rays_meet_aspheres() {
        let surface = asphere();
        let arc = |x: DVec3, v: DVec3, length: f64| Arc::straight(x, v.normalize(), length, 1.0);
        let tip = surface.point + DVec3::new(0.3, 0.2, 0.1);
        for direction in [
            surface.axis,
            DVec3::new(0.5, 0.3, 1.0),
            DVec3::new(-0.4, 0.0, 0.8),
        ] {
            for far in [2.0, 1e4] {
                let arc = arc(tip - direction.normalize() * far, direction, far + 1.0);
                let theta = surface.first(&arc).unwrap();
                let x = arc.position(theta);
                assert!(value(&surface, x).abs() < 1e-12 * far, "{x}");
                assert!((theta * (far + 1.0) - far).abs() < 1.0);
            }
        }
        let side = surface.axis.any_orthonormal_vector();
        let start = surface.point + side * 3.0 - surface.axis * 2.0;
        assert_eq!(surface.first(&arc(start, surface.axis, 4.0)), None);
    }
}
