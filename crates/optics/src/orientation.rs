//! Orientation of objects without a size: a rotation, possibly with a mirror.
//!
//! Images of the sky, projectors and photometric files have an orientation but no size. Transforms
//! in files are seldom exact rotations, because exporters round their numbers. A direction mapped
//! by a rounded matrix does not have unit length, and a connection along it misses its vertex.
//! Therefore, all directions of these emitters go through an [`Orientation`], which preserves
//! lengths by construction.

use eikonal::bounds::symmetric_eigenvalues;
use glam::{DMat3, DVec3};

/// Maximum number of polar iterations. Near a rotation four suffice; each doubles the number of
/// correct digits.
const MAX_STEPS: usize = 60;
/// Largest change of an entry in the last step of the polar iteration.
const MAX_LAST_CHANGE: f64 = 1e-14;

/// Orthogonal map from local directions to the world; mirrors are allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation(DMat3);

impl Orientation {
    /// The orientation whose local axes are the axes of the world.
    pub const IDENTITY: Orientation = Orientation(DMat3::IDENTITY);

    /// Returns the orthogonal map nearest to `linear` up to a uniform positive scale (its polar
    /// factor), and the error. The error is the largest relative error of a length: 0 for a
    /// rotation or a mirror of any size. Returns `None` if `linear` is singular or not finite.
    pub fn nearest(linear: DMat3) -> Option<(Self, f64)> {
        // Normalise to entries of at most one, then to a determinant of ±1.
        let largest = linear
            .to_cols_array()
            .into_iter()
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        let unit = linear * largest.recip();
        let scale = unit.determinant().abs().cbrt();
        if !(unit.is_finite() && scale > f64::EPSILON) {
            return None;
        }
        let unit = unit * scale.recip();
        // Split off the rotation; the eigenvalues of the rest are relative lengths.
        let turn = polar(unit)?;
        let stretch = turn.transpose() * unit;
        let stretches = symmetric_eigenvalues((stretch + stretch.transpose()) * 0.5);
        let mean = stretches.iter().sum::<f64>() / 3.0;
        let error = |s: &f64| (s / mean - 1.0).abs();
        Some((
            Orientation(turn),
            stretches.iter().map(error).fold(0.0, f64::max),
        ))
    }

    /// Maps a local unit direction to the world; the result has unit length.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        // Planted error "directions of turned skies a little too long", found by morgana-transport/transport::orientation::directions_have_unit_length_there_and_back:
        // self.0 * local * (1.0 + 1e-7)
        (self.0 * local).normalize()
    }

    /// Maps a unit direction of the world to local coordinates; the result has unit length.
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        (self.0.transpose() * world).normalize()
    }
}

/// Computes the orthogonal factor of a regular matrix: the limit of X → (X + X⁻ᵀ)/2 [Higham 1986].
fn polar(matrix: DMat3) -> Option<DMat3> {
    let mut x = matrix;
    for _ in 0..MAX_STEPS {
        let next = (x + x.inverse().transpose()) * 0.5;
        if !next.is_finite() {
            return None;
        }
        if next.abs_diff_eq(x, MAX_LAST_CHANGE) {
            return Some(next);
        }
        x = next;
    }
    None
}
