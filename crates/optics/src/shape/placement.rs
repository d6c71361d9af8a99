//! Placement of an analytic shape: the affine map from its local coordinates to the scene.

use super::ShapeError;
use eikonal::Aabb;
use glam::{DAffine3, DMat3, DVec3};

/// Smallest determinant of an invertible map, relative to the product of the column lengths.
const MIN_DETERMINANT: f64 = 1e-12;

/// Largest relative difference of area elements that count as equal. A rotation written with four
/// digits has errors of up to 1.5e-4 in lengths and twice as much in areas.
const AREA_TOLERANCE: f64 = 5e-4;

/// Invertible affine map with its inverse and derived quantities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    to_world: DAffine3,
    to_local: DAffine3,
    /// |det| of the linear part.
    det: f64,
    /// Bound of the rounding error of local coordinates near the shape.
    noise: f64,
    /// Unit normals of the local axes in the scene, not flipped.
    normals: [DVec3; 3],
    /// Growth factors of area elements across the local axes.
    stretches: [f64; 3],
    /// −1 if the normals are flipped, otherwise 1.
    side: f64,
}

impl Placement {
    /// Creates the placement of a shape that fits in the local box `local`.
    pub(super) fn new(to_world: DAffine3, local: &Aabb) -> Result<Self, ShapeError> {
        if !to_world.is_finite() {
            return Err(ShapeError::NonFiniteTransform);
        }
        let m = to_world.matrix3;
        let det = m.determinant();
        let scale = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        let to_local = to_world.inverse();
        if !(det.abs() > MIN_DETERMINANT * scale && to_local.is_finite()) {
            return Err(ShapeError::SingularTransform { det });
        }
        let mut placement = Placement {
            to_world,
            to_local,
            det: det.abs(),
            noise: 0.0,
            normals: [DVec3::ZERO; 3],
            stretches: [0.0; 3],
            side: 1.0,
        };
        placement.normals = DVec3::AXES.map(|axis| placement.normal(axis));
        placement.stretches = DVec3::AXES.map(|axis| placement.stretch(axis));
        placement.noise = placement.round_off(local);
        Ok(placement)
    }

    /// Returns 8ε times the largest magnitude that occurs when points of the shape are mapped back
    /// to `local`.
    fn round_off(&self, local: &Aabb) -> f64 {
        let world = Aabb::around(local.corners().map(|c| self.point(c)));
        let far = world.min.abs().max(world.max.abs());
        let w = self.to_local.matrix3;
        let terms = w.x_axis.abs() * far.x
            + w.y_axis.abs() * far.y
            + w.z_axis.abs() * far.z
            + self.to_local.translation.abs();
        8.0 * f64::EPSILON * (1.0 + terms.max_element())
    }

    /// Returns a local box around a box of the scene.
    pub(super) fn local_box(&self, world: &Aabb) -> Aabb {
        Aabb::around(world.corners().map(|c| self.local(c)))
    }

    /// Returns the map from local coordinates to the scene.
    pub(super) fn to_world(self) -> DAffine3 {
        self.to_world
    }

    /// Sets whether the normals are reversed.
    pub(crate) fn set_flipped(&mut self, flipped: bool) {
        self.side = if flipped { -1.0 } else { 1.0 };
    }

    /// Returns true if the normals are reversed.
    pub(crate) fn is_flipped(&self) -> bool {
        self.side < 0.0
    }

    /// Returns the map from local coordinates to the scene.
    pub(super) fn map(&self) -> &DAffine3 {
        &self.to_world
    }

    /// Returns the unit normal of the local z axis, not flipped: see [`Placement::normal`].
    pub(super) fn upright_normal(&self) -> DVec3 {
        self.normals[2]
    }

    /// Returns the volume of the image of a unit volume.
    pub(super) fn determinant(&self) -> f64 {
        self.det
    }

    /// Returns the bound of the rounding error of local coordinates near the shape.
    pub(super) fn noise(&self) -> f64 {
        self.noise
    }

    /// Maps a local point to the scene.
    pub(super) fn point(&self, local: DVec3) -> DVec3 {
        self.to_world.transform_point3(local)
    }

    /// Maps a local displacement to the scene.
    pub(super) fn vector(&self, local: DVec3) -> DVec3 {
        self.to_world.transform_vector3(local)
    }

    /// Maps a scene point to local coordinates.
    pub(super) fn local(&self, world: DVec3) -> DVec3 {
        self.to_local.transform_point3(world)
    }

    /// Returns the unit normal in the scene for the local normal `n`. It points to the image of the
    /// side to which `n` points, also under mirror maps, or to the other side if flipped.
    pub(super) fn normal(&self, n: DVec3) -> DVec3 {
        self.covector(n).normalize() * self.side
    }

    /// Returns [`Placement::normal`] of a local axis.
    pub(crate) fn axis_normal(&self, axis: usize) -> DVec3 {
        self.normals[axis] * self.side
    }

    /// Returns the growth factor of an area element with local unit normal `n`: |det M| |M⁻ᵀ n|.
    pub(super) fn stretch(&self, n: DVec3) -> f64 {
        self.det * self.covector(n).length()
    }

    /// Returns [`Placement::stretch`] of a local axis.
    pub(crate) fn axis_stretch(&self, axis: usize) -> f64 {
        self.stretches[axis]
    }

    /// Returns true if area elements with these local unit normals grow equally, up to the rounding
    /// of a transform.
    pub(super) fn is_even(&self, normals: &[DVec3]) -> bool {
        let first = self.stretch(normals[0]);
        let alike = |n: &DVec3| (self.stretch(*n) / first - 1.0).abs() < AREA_TOLERANCE;
        normals.iter().all(alike)
    }

    /// Returns the shape operator of f = 0 at a point where f has local gradient `gradient` and
    /// diagonal local Hessian `hessian`. With N = ∇f/|∇f|, δN = P Hess f P δx / |∇f|, P = I − NNᵀ.
    pub(super) fn shape_operator(&self, gradient: DVec3, hessian: DVec3) -> DMat3 {
        let g = self.covector(gradient);
        let n = g.normalize();
        let p = DMat3::IDENTITY - outer(n);
        let w = self.to_local.matrix3;
        let hess = w.transpose() * DMat3::from_diagonal(hessian) * w;
        p * hess * p * (self.side / g.length())
    }

    /// Returns the box in the scene around the image of a set with local support function `h`: h(d)
    /// = max over the set of d·p.
    pub(super) fn aabb(&self, h: impl Fn(DVec3) -> f64) -> Aabb {
        let rows = self.to_world.matrix3.transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
        let top = DVec3::from_array(rows.map(&h));
        let bottom = DVec3::from_array(rows.map(|r| -h(-r)));
        let t = self.to_world.translation;
        let bounds = Aabb::new(t + bottom, t + top);
        let far = bounds.min.abs().max(bounds.max.abs()).max(t.abs());
        bounds.grown(8.0 * f64::EPSILON * far.max_element())
    }

    fn covector(&self, n: DVec3) -> DVec3 {
        self.to_local.matrix3.transpose() * n
    }
}

/// Returns the matrix n nᵀ.
fn outer(n: DVec3) -> DMat3 {
    DMat3::from_cols(n * n.x, n * n.y, n * n.z)
}
