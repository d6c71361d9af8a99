//! The published method to connect two points (Pediredla et al., "Path Tracing Estimators for
//! Refractive Radiative Transfer", ACM TOG 39(6), 2020). It minimises the squared miss over the
//! direction by a quasi-Newton method, from random directions, along rays of a fixed step.

use glam::{DMat2, DVec2, DVec3};
use morgana_eikonal::Field;
use morgana_eikonal::ray::perpendicular_basis;

/// Work of a search.
#[derive(Clone, Copy, Default)]
pub struct Effort {
    pub shots: u64,
    pub evaluations: u64,
}

/// Parameters of the published method: step and length of rays, and the accepted miss.
#[derive(Clone, Copy)]
pub struct Method {
    /// Arc length of a step.
    pub step: f64,
    /// Longest ray.
    pub longest: f64,
    /// Accepted miss, relative to the distance.
    pub tolerance: f64,
}

/// Maximum number of rays traced in one minimisation.
const MAX_SHOTS: u64 = 60;

impl Method {
    /// Minimises the miss from a start direction. Returns the final direction if the ray then
    /// arrives.
    pub fn connect(
        &self,
        field: &Field,
        [x, y]: [DVec3; 2],
        direction: DVec3,
        effort: &mut Effort,
    ) -> Option<DVec3> {
        let goal = (self.tolerance * x.distance(y)).powi(2);
        let basis = perpendicular_basis(direction);
        let most = effort.shots + MAX_SHOTS;
        let mut shoot = |at: DVec2| self.miss(field, [x, y], (direction, basis), at, effort);
        let (mut at, mut inverse) = (DVec2::ZERO, DMat2::IDENTITY);
        let (mut cost, mut slope, mut shots) = shoot(at);
        let first = 0.2 / slope.length().max(1e-300);
        inverse *= first;
        while cost > goal {
            let mut step = inverse * -slope;
            if step.dot(slope) >= 0.0 {
                inverse = DMat2::IDENTITY * first;
                step = -slope * first;
            }
            let mut scale = 1.0;
            // Halve the step until Armijo's rule accepts it.
            let (next, next_cost, next_slope) = loop {
                if shots >= most || scale < 1e-8 {
                    return None;
                }
                let next = at + step * scale;
                let (c, s, count) = shoot(next);
                shots = count;
                if c <= cost + 1e-4 * scale * step.dot(slope) {
                    break (next, c, s);
                }
                scale *= 0.5;
            };
            inverse = updated(inverse, next - at, next_slope - slope);
            (at, cost, slope) = (next, next_cost, next_slope);
        }
        Some((direction + basis[0] * at.x + basis[1] * at.y).normalize())
    }

    /// Returns the squared miss at the closest approach of a ray, its derivative, and the number of
    /// rays traced. Two coordinates give the direction of the ray.
    fn miss(
        &self,
        field: &Field,
        [x, y]: [DVec3; 2],
        (axis, basis): (DVec3, [DVec3; 2]),
        at: DVec2,
        effort: &mut Effort,
    ) -> (f64, DVec2, u64) {
        effort.shots += 1;
        let raw = axis + basis[0] * at.x + basis[1] * at.y;
        let d = raw.normalize();
        let across = |t: DVec3| (t - d * d.dot(t)) / raw.length();
        let mut jet = field.jet(x);
        let n = jet.n2.sqrt();
        let (mut x, mut v) = (x, d * n);
        let (mut dx, mut dv) = ([DVec3::ZERO; 2], basis.map(|t| across(t) * n));
        let mut length = 0.0;
        while (y - x).dot(v) > 0.0 && length < self.longest {
            // Advance the ray and its tangents by Störmer's method; the last step ends at the
            // closest approach.
            let left = (y - x).dot(v) / v.length_squared();
            let h = (self.step / v.length()).min(left.max(1e-9));
            v += jet.grad * (0.25 * h);
            x += v * h;
            for (dx, dv) in dx.iter_mut().zip(&mut dv) {
                *dv += jet.hess * *dx * (0.25 * h);
                *dx += *dv * h;
            }
            jet = field.jet(x);
            effort.evaluations += 1;
            v += jet.grad * (0.25 * h);
            for (dx, dv) in dx.iter().zip(&mut dv) {
                *dv += jet.hess * *dx * (0.25 * h);
            }
            length += h * v.length();
            if left <= 1e-9 {
                break;
            }
        }
        let miss = x - y;
        let slope = DVec2::new(miss.dot(dx[0]), miss.dot(dx[1])) * 2.0;
        (miss.length_squared(), slope, effort.shots)
    }
}

/// Returns the inverse Hessian after a BFGS update, for a step and the change of the slope over it.
fn updated(inverse: DMat2, step: DVec2, change: DVec2) -> DMat2 {
    let curvature = step.dot(change);
    if curvature <= 1e-300 {
        return inverse;
    }
    let outer = |a: DVec2, b: DVec2| DMat2::from_cols(a * b.x, a * b.y);
    let left = DMat2::IDENTITY - outer(step, change) * (1.0 / curvature);
    left * inverse * left.transpose() + outer(step, step) * (1.0 / curvature)
}
