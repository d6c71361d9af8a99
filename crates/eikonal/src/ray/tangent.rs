//! Tangents of a ray: its derivatives with respect to its start (docs/theory.md#tangents).

use crate::field::Field;
use glam::{DMat3, DVec3};

/// Quantity that a ray carries along: nothing, `()`, or two tangent columns, [`Tangents`].
///
/// Rays without tangents need the gradient of n² only; with tangents, the Hessian too.
pub trait Variation: Copy + std::fmt::Debug {
    /// Data of the field that this variation needs at each stage.
    type Local: Copy + std::fmt::Debug;
    /// Returns n², ½∇n² and the local data at `x`.
    fn local(field: &Field, x: DVec3) -> (f64, DVec3, Self::Local);
    /// Adds h·½Hess(n²)·δx to δv.
    fn kick(&mut self, local: &Self::Local, h: f64);
    /// Adds h·δv to δx.
    fn drift(&mut self, h: f64);
    /// Advances over a span `h` in which the index is constant.
    fn straight(&mut self, _local: &Self::Local, h: f64) {
        self.drift(h);
    }
    /// Interpolates the variation at θ between two nodes a span `h` of σ apart, each with its local
    /// data, by the quintic of the positions.
    fn interpolate(
        start: &Self,
        start_local: &Self::Local,
        end: &Self,
        end_local: &Self::Local,
        h: f64,
        theta: f64,
    ) -> Self;
}

impl Variation for () {
    type Local = ();

    fn local(field: &Field, x: DVec3) -> (f64, DVec3, ()) {
        let (n2, grad) = field.gradient(x);
        (n2, grad * 0.5, ())
    }

    fn kick(&mut self, _: &(), _: f64) {}

    fn drift(&mut self, _: f64) {}

    fn interpolate(_: &(), _: &(), _: &(), _: &(), _: f64, _: f64) {}
}

/// Two perturbations (δx, δv) of a ray at equal σ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangents {
    /// Perturbations δx of both columns.
    pub dx: [DVec3; 2],
    /// Perturbations δv of both columns.
    pub dv: [DVec3; 2],
}

impl Tangents {
    /// Returns the unit angular offsets of the direction at a fixed point of index `n`: δx = 0, δv
    /// = n·t. `basis` are unit vectors t perpendicular to the direction.
    pub fn angular(n: f64, basis: [DVec3; 2]) -> Self {
        Tangents {
            dx: [DVec3::ZERO; 2],
            dv: basis.map(|t| t * n),
        }
    }

    /// Returns the unit offsets of the position at a fixed `direction`, as of plane waves: δx = a,
    /// δv = (∇n·a)·direction, for the vectors a of `basis`. `grad_n2` is ∇n² at the start, `n` the
    /// index there.
    pub fn lateral(n: f64, grad_n2: DVec3, direction: DVec3, basis: [DVec3; 2]) -> Self {
        Tangents {
            dx: basis,
            dv: basis.map(|a| direction * (grad_n2.dot(a) / (2.0 * n))),
        }
    }

    /// Returns the signed cross section of the ray tube, δx₁ × δx₂ · v̂ = det Uᵀ[δx₁ δx₂].
    ///
    /// Its magnitude is J for tangents started by [`Tangents::angular`], and A for tangents started
    /// by [`Tangents::lateral`].
    pub fn cross_section(&self, v: DVec3) -> f64 {
        self.dx[0].cross(self.dx[1]).dot(v.normalize())
    }
}

impl Variation for Tangents {
    type Local = DMat3;

    fn local(field: &Field, x: DVec3) -> (f64, DVec3, DMat3) {
        let jet = field.jet(x);
        // Planted error "tangents without the Hessian", found by morgana-eikonal/eikonal::rays::tangents_are_the_derivative_of_the_discrete_map:
        // (jet.n2, jet.grad * 0.5, jet.hess * 0.0)
        (jet.n2, jet.grad * 0.5, jet.hess * 0.5)
    }

    fn kick(&mut self, half_hess: &DMat3, h: f64) {
        let kick = *half_hess * h;
        for (dx, dv) in self.dx.iter().zip(&mut self.dv) {
            *dv += kick * *dx;
        }
    }

    fn drift(&mut self, h: f64) {
        for (dx, dv) in self.dx.iter_mut().zip(&self.dv) {
            *dx += *dv * h;
        }
    }

    fn interpolate(
        start: &Self,
        start_hess: &DMat3,
        end: &Self,
        end_hess: &DMat3,
        h: f64,
        theta: f64,
    ) -> Self {
        let (position, velocity) = quintic(h, theta);
        let sum = |w: [f64; 6], k: usize| {
            (start.dx[k] * w[0] + start.dv[k] * w[1] + *start_hess * start.dx[k] * w[2])
                + (end.dx[k] * w[3] + end.dv[k] * w[4] + *end_hess * end.dx[k] * w[5])
        };
        Tangents {
            dx: [sum(position, 0), sum(position, 1)],
            dv: [sum(velocity, 0), sum(velocity, 1)],
        }
    }
}

/// Returns the weights of position, velocity and acceleration at both ends of a span `h` in the
/// Hermite quintic at θ, and in its derivative.
fn quintic(h: f64, theta: f64) -> ([f64; 6], [f64; 6]) {
    let (t, u) = (theta, 1.0 - theta);
    let (t2, u2) = (t * t, u * u);
    let (t3, u3) = (t2 * t, u2 * u);
    let rise = 30.0 * t2 * u2 / h;
    (
        [
            u3 * (1.0 + t * (3.0 + 6.0 * t)),
            h * t * u3 * (1.0 + 3.0 * t),
            0.5 * h * h * t2 * u3,
            t3 * (1.0 + u * (3.0 + 6.0 * u)),
            -h * u * t3 * (1.0 + 3.0 * u),
            0.5 * h * h * u2 * t3,
        ],
        [
            -rise,
            u2 * (1.0 + t * (2.0 - 15.0 * t)),
            0.5 * h * t * u2 * (2.0 - 5.0 * t),
            rise,
            t2 * (1.0 + u * (2.0 - 15.0 * u)),
            -0.5 * h * u * t2 * (2.0 - 5.0 * u),
        ],
    )
}

/// Returns two unit vectors that form a right-handed basis with the unit vector `w` (Duff et al.,
/// "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
pub fn perpendicular_basis(w: DVec3) -> [DVec3; 2] {
    let sign = 1f64.copysign(w.z);
    let a = -1.0 / (sign + w.z);
    let b = w.x * w.y * a;
    [
        DVec3::new(1.0 + sign * w.x * w.x * a, sign * b, -sign * w.x),
        DVec3::new(b, sign + w.y * w.y * a, -w.y),
    ]
}
