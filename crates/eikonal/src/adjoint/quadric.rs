//! Surfaces of the second degree, with derivatives with respect to their parameters
//! (docs/theory.md#derivatives-of-rays).

use super::reverse::SurfaceDerivative;
use crate::interface::Displacement;
use crate::ray::Arc;
use crate::ray::bernstein::{first_root, height, product};
use glam::{DMat3, DVec3};

/// Maximum number of roots of a polynomial of degree ten.
const MAX_ROOTS: usize = 10;

/// Zero set of F = α|d|² + βz² + γz + δ, with d = x − `point` and z = `axis`·d: planes, spheres,
/// cylinders, conics of revolution. If γ is not zero, only the sheet through `point` counts, on
/// which F is monotonic along the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// Point of the axis.
    pub point: DVec3,
    /// Unit vector along the axis.
    pub axis: DVec3,
    /// Coefficients α, β, γ, δ.
    pub form: [f64; 4],
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

/// Derivatives with respect to the point, the axis and the form of a [`Quadric`].
pub type QuadricDerivative = [f64; 10];

impl Quadric {
    /// Creates the plane through `point` with the unit normal `normal`.
    pub fn plane(point: DVec3, normal: DVec3) -> Self {
        Quadric {
            point,
            axis: normal,
            form: [0.0, 0.0, 1.0, 0.0],
        }
    }

    /// Returns the θ in (0, 1] at which an arc first meets the surface.
    pub(super) fn first(&self, arc: &Arc) -> Option<f64> {
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

    /// Returns true if a point lies on the sheet of the quadric that belongs to the surface.
    fn holds(&self, x: DVec3) -> bool {
        let [alpha, beta, gamma, _] = self.form;
        let z = self.axis.dot(x - self.point);
        gamma == 0.0 || (2.0 * (alpha + beta) * z + gamma) * gamma > 0.0
    }

    /// Returns the gradient ∇F.
    fn gradient(&self, x: DVec3) -> DVec3 {
        let [alpha, beta, gamma, _] = self.form;
        let d = x - self.point;
        d * (2.0 * alpha) + self.axis * (2.0 * beta * self.axis.dot(d) + gamma)
    }

    /// Returns Hess F times a vector.
    fn bent(&self, v: DVec3) -> DVec3 {
        let [alpha, beta, ..] = self.form;
        v * (2.0 * alpha) + self.axis * (2.0 * beta * self.axis.dot(v))
    }

    /// Returns the unit normal ∇F/|∇F| at a point, and its derivatives with respect to the
    /// position.
    pub(super) fn normal(&self, x: DVec3) -> (DVec3, DMat3) {
        let gradient = self.gradient(x);
        let per = gradient.length_recip();
        let normal = gradient * per;
        let column = |axis| self.bent(axis).reject_from_normalized(normal) * per;
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
        let [_, beta, gamma, _] = self.form;
        let [point, axis] = [&change[..3], &change[3..6]].map(DVec3::from_slice);
        let [of_alpha, of_beta, of_gamma, of_delta] = [6, 7, 8, 9].map(|i| change[i]);
        let d = x - self.point;
        let z = self.axis.dot(d);
        let gradient = self.gradient(x);
        let per = gradient.length_recip();
        let steep = 2.0 * beta * z + gamma;
        let value = -gradient.dot(point) + steep * d.dot(axis);
        let value = value + of_alpha * d.length_squared() + of_beta * z * z;
        let value = value + of_gamma * z + of_delta;
        let turn = -self.bent(point) + axis * steep + d * (2.0 * of_alpha);
        let along = 2.0 * beta * axis.dot(d) + 2.0 * z * of_beta + of_gamma;
        let turn = turn + self.axis * along;
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
        let [_, beta, gamma, _] = self.form;
        let d = x - self.point;
        let z = self.axis.dot(d);
        let gradient = self.gradient(x);
        let per = gradient.length_recip();
        // Compute the derivatives with respect to F and ∇F at the point.
        let value = -by.offset * per;
        // Planted error "derivatives by surfaces whose normals do not turn", found by morgana-eikonal/eikonal::adjoint::surfaces::rays_through_sequences_of_surfaces:
        // let slope = 0.0 * by.turn.reject_from_normalized(gradient * per) * per;
        let slope = by.turn.reject_from_normalized(gradient * per) * per;
        let along = self.axis.dot(slope);
        let steep = 2.0 * beta * z + gamma;
        let point = -gradient * value - self.bent(slope);
        let axis = d * (value * steep + 2.0 * beta * along) + slope * steep;
        let form = [
            value * d.length_squared() + 2.0 * slope.dot(d),
            value * z * z + 2.0 * z * along,
            value * z + along,
            value,
        ];
        let all = point
            .to_array()
            .into_iter()
            .chain(axis.to_array())
            .chain(form);
        into.iter_mut().zip(all).for_each(|(sum, by)| *sum += by);
    }
}
