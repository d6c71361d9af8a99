//! How something that has no size stands in the scene: a rotation, perhaps with a mirror.
//!
//! Images of the sky, projectors and photometric files can only be turned. Transforms in files are
//! seldom exact rotations: exporters round their numbers. A direction that such a matrix maps is a
//! little longer or shorter than one, and a connection along it ends beside its vertex. So all
//! directions of these emitters go through an [`Orientation`], which keeps lengths by construction.

use eikonal::bounds::symmetric_eigenvalues;
use glam::{DMat3, DVec3};

/// Steps of the polar iteration; near a rotation it needs four, and doubles its digits each time.
const MOST_STEPS: usize = 60;
/// A step that changes less than this was the last.
const SETTLED: f64 = 1e-14;

/// An orthogonal map from local directions to the world, mirrors included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation(DMat3);

impl Orientation {
    /// Local axes are those of the world.
    pub const IDENTITY: Orientation = Orientation(DMat3::IDENTITY);

    /// The orthogonal map that is nearest to `linear` up to a uniform positive scale (its polar
    /// factor), and how far that is: the largest relative error of a length, 0 for a rotation or
    /// a mirror of any size. `None` for a map that is singular or not finite.
    pub fn nearest(linear: DMat3) -> Option<(Self, f64)> {
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

    /// A local unit direction in the world, of unit length.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        // Planted error "directions of turned skies a little too long", found by morgana-transport/transport::orientation::directions_have_unit_length_there_and_back:
        // self.0 * local * (1.0 + 1e-7)
        (self.0 * local).normalize()
    }

    /// A unit direction of the world in local coordinates, of unit length.
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        (self.0.transpose() * world).normalize()
    }
}

/// The orthogonal factor of a regular matrix: the limit of X → (X + X⁻ᵀ)/2 [Higham 1986].
fn polar(matrix: DMat3) -> Option<DMat3> {
    let mut x = matrix;
    for _ in 0..MOST_STEPS {
        let next = (x + x.inverse().transpose()) * 0.5;
        if !next.is_finite() {
            return None;
        }
        if next.abs_diff_eq(x, SETTLED) {
            return Some(next);
        }
        x = next;
    }
    None
}
