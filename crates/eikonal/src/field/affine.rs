//! Fields that are moved, rotated, scaled or sheared.

use super::error::{FieldError, finite_vector};
use super::{BoundsOf, Field, IndexDerivative, Jet};
use crate::bounds::{Aabb, FieldBounds, symmetric_eigenvalues};
use glam::{DAffine3, DMat3, DVec3};

/// Field n²(x) = f(M x + b), given in local coordinates. M and b are the inverse of the map from
/// local coordinates to the world.
#[derive(Clone, Debug)]
pub struct Affine {
    field: Box<Field>,
    to_local: DAffine3,
    /// Smallest and largest |M u| for unit vectors u.
    stretch: [f64; 2],
}

impl Affine {
    pub(super) fn memory(&self) -> usize {
        self.field.memory()
    }

    /// Creates `field` moved by `to_world`.
    ///
    /// # Errors
    ///
    /// A transform that is not finite, or that cannot be inverted: one that stretches 1e14 times as
    /// much along one direction as along another.
    pub fn new(field: Field, to_world: DAffine3) -> Result<Self, FieldError> {
        finite_vector("translation of the transform", to_world.translation)?;
        let largest = largest_singular_value(to_world.matrix3);
        let to_local = to_world.inverse();
        let smallest = 1.0 / largest_singular_value(to_local.matrix3);
        // Reject worse conditions: they leave no correct digit in the inverse.
        let invertible = to_local.matrix3.is_finite() && smallest > 1e-14 * largest;
        if !invertible {
            let smallest = if smallest.is_nan() { 0.0 } else { smallest };
            return Err(FieldError::SingularTransform { smallest, largest });
        }
        finite_vector("translation of the inverse transform", to_local.translation)?;
        Ok(Affine {
            field: Box::new(field),
            to_local,
            stretch: [1.0 / largest, 1.0 / smallest],
        })
    }

    /// Returns the field in local coordinates.
    pub(super) fn inner(&self) -> &Field {
        &self.field
    }

    /// Returns the map from the world to local coordinates.
    pub(super) fn to_local(&self) -> DAffine3 {
        self.to_local
    }

    /// Returns a point, and a derivative with respect to n² and ∇n² there, in local coordinates.
    pub(super) fn local_derivative(
        &self,
        x: DVec3,
        by: IndexDerivative,
    ) -> (DVec3, IndexDerivative) {
        let gradient = self.to_local.matrix3 * by.gradient;
        (self.local(x), IndexDerivative { gradient, ..by })
    }

    /// Returns the map to the world, its matrix and then its translation, in rows of four.
    pub(super) fn to_world_rows(&self) -> [f64; 12] {
        let to_world = self.to_local.inverse();
        let rows = to_world.matrix3.transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
        rows_of_four(rows, to_world.translation)
    }

    /// Adds derivatives with respect to the map to the world. A change (δA, δt) moves a point with
    /// the local coordinates y by δAy + δt, and turns ∇n² by −(δA M)ᵀ∇n².
    pub(super) fn add_map_derivative(&self, x: DVec3, by: IndexDerivative, into: &mut [f64]) {
        let jet = self.jet(x);
        let moved = -(jet.grad * by.n2 + jet.hess * by.gradient);
        let (y, turned) = (self.local(x), self.to_local.matrix3 * by.gradient);
        // Planted error "transforms of fields that turn no gradients", found by morgana-eikonal/eikonal::adjoint::parameters::fields_by_their_parameters:
        // let row = |i: usize| y * moved[i] - 0.0 * turned * jet.grad[i];
        let row = |i: usize| y * moved[i] - turned * jet.grad[i];
        let rows = rows_of_four([0, 1, 2].map(row), moved);
        into.iter_mut().zip(rows).for_each(|(sum, by)| *sum += by);
    }

    /// Returns another field under this transform.
    pub(super) fn over(&self, field: Field) -> Self {
        Affine {
            field: Box::new(field),
            ..*self
        }
    }

    /// Returns the length in the world of a unit of local length, averaged over directions.
    pub(super) fn mean_scale(&self) -> f64 {
        self.to_local.matrix3.determinant().abs().cbrt().recip()
    }

    fn local(&self, x: DVec3) -> DVec3 {
        self.to_local.transform_point3(x)
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.field.n2(self.local(x))
    }

    /// Returns n² and its gradient, ∇n² = Mᵀ∇f.
    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let (n2, grad) = self.field.gradient(self.local(x));
        (n2, self.to_local.matrix3.transpose() * grad)
    }

    /// Returns the jet, with Hess n² = Mᵀ Hess f M.
    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let local = self.field.jet(self.local(x));
        let m = self.to_local.matrix3;
        Jet {
            n2: local.n2,
            grad: m.transpose() * local.grad,
            hess: m.transpose() * local.hess * m,
        }
    }

    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        self.bounds_by(region, Field::bounds)
    }

    /// Computes bounds from `inner`, the bounds of the field before the map. uᵀMᵀHMu lies between
    /// the extreme eigenvalues of H times |Mu|². The sign of the eigenvalue determines whether the
    /// largest or the smallest |Mu|² is taken.
    pub(super) fn bounds_by(&self, region: &Aabb, inner: BoundsOf) -> FieldBounds {
        let local = inner(&self.field, &self.local_box(region));
        let [small, large] = self.stretch;
        let squared = |against: bool| {
            if against {
                large * large
            } else {
                small * small
            }
        };
        FieldBounds {
            grad_max: local.grad_max * large,
            hess_min: local.hess_min * squared(local.hess_min < 0.0),
            hess_max: local.hess_max * squared(local.hess_max > 0.0),
            ..local
        }
    }

    /// Returns the smallest box in local coordinates around a box in the world.
    fn local_box(&self, region: &Aabb) -> Aabb {
        let rows = self.to_local.matrix3.transpose();
        let [x, y, z] = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| region.project(row));
        let shift = self.to_local.translation;
        Aabb {
            min: DVec3::new(x[0], y[0], z[0]) + shift,
            max: DVec3::new(x[1], y[1], z[1]) + shift,
        }
    }

    /// Returns the length scale, scaled by the direction that the transform stretches least.
    pub(super) fn length_scale(&self, x: DVec3) -> f64 {
        self.field.length_scale(self.local(x)) / self.stretch[1]
    }

    /// Returns the length scale for a velocity, scaled by the direction that the transform
    /// stretches least.
    pub(super) fn step_scale(&self, x: DVec3, v: DVec3) -> f64 {
        let scale = self
            .field
            .step_scale(self.local(x), self.to_local.matrix3 * v);
        scale / self.stretch[1]
    }

    pub(super) fn homogeneous_span(&self, x: DVec3, v: DVec3) -> f64 {
        self.field
            .homogeneous_span(self.local(x), self.to_local.matrix3 * v)
    }

    pub(super) fn resolved_span(&self, x: DVec3, v: DVec3) -> f64 {
        self.field
            .resolved_span(self.local(x), self.to_local.matrix3 * v)
    }

    pub(super) fn is_constant(&self) -> bool {
        self.field.is_constant()
    }
}

fn rows_of_four(rows: [DVec3; 3], last: DVec3) -> [f64; 12] {
    std::array::from_fn(|i| match i % 4 {
        3 => last[i / 4],
        column => rows[i / 4][column],
    })
}

fn largest_singular_value(m: DMat3) -> f64 {
    symmetric_eigenvalues(m.transpose() * m)[2].sqrt()
}
