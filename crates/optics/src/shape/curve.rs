//! An arc in the local coordinates of a shape (docs/theory.md#dense-output).

use super::placement::Placement;
use super::sweep::Sweep;
use eikonal::Aabb;
use eikonal::ray::Arc;
use eikonal::ray::bernstein::{evaluate, first_root, product, restrict};
use glam::DVec3;

/// Growth of the box to which an arc is clipped. It keeps the cut ends well away from the surface.
const BOX_GROWTH: f64 = 0.1;

/// Error of the local coordinates of an arc cut out of a longer one, relative to its control
/// points.
const CUT_NOISE: f64 = 64.0 * f64::EPSILON;

/// Surface in local coordinates.
#[derive(Clone, Copy)]
pub(super) enum Surface {
    /// Plane on which a coordinate has a value.
    Plane(usize, f64),
    /// Surface x² + y² + z² = 1; only the given number of leading coordinates is used.
    Radial(usize),
}

/// Candidate for an intersection with a shape, in local coordinates over a parameter u: a [`Curve`]
/// or a [`Line`](super::line::Line).
pub(super) trait Track {
    /// Returns the first u up to `until` where the track crosses `surface` at a position that
    /// `accept` accepts.
    fn first(&self, surface: Surface, until: f64, accept: impl Fn(DVec3) -> bool) -> Option<f64>;

    /// Returns the parameter θ of the arc at `u` > 0.
    fn theta(&self, u: f64) -> f64;

    /// Returns the local position at `u`.
    fn position(&self, u: f64) -> DVec3;
}

/// The part of a bent arc that comes near a shape, as a curve over u ∈ [0, 1].
pub(super) struct Curve {
    control: [DVec3; 6],
    theta: [f64; 2],
    /// Bound of the error of the coordinates at u = 0 and u = 1.
    noise: [f64; 2],
}

impl Curve {
    /// Cuts out the part of θ ∈ [theta[0], theta[1]] within and around the local box `bounds`.
    pub(super) fn new(
        arc: &Arc,
        theta: [f64; 2],
        placement: &Placement,
        bounds: &Aabb,
    ) -> Option<Self> {
        Curve::leaving(arc, theta, placement, bounds, |_| false)
    }

    /// Cuts out a part like [`Curve::new`]. Also returns `None` if the whole arc lies well within a
    /// convex shape and so cannot reach its surface. This test is safe because a curve lies in the
    /// convex hull of its control points.
    pub(super) fn leaving(
        arc: &Arc,
        theta: [f64; 2],
        placement: &Placement,
        bounds: &Aabb,
        within: impl Fn(DVec3) -> bool,
    ) -> Option<Self> {
        let range = [theta[0].max(0.0), theta[1].min(1.0)];
        let control = arc.control().map(|p| placement.local(p));
        if control.into_iter().all(within) {
            return None;
        }
        let theta = Sweep::new(&control).clip(&bounds.grown(BOX_GROWTH), range)?;
        let size = control.iter().fold(0.0, |m: f64, p| m.max(p.length()));
        let cut = |whole: bool| if whole { 0.0 } else { CUT_NOISE * size };
        let noise = [cut(theta[0] == 0.0), cut(theta[1] == 1.0)];
        Some(Curve {
            control: restrict(&control, theta[0], theta[1]),
            theta,
            noise: noise.map(|n| n + placement.noise()),
        })
    }
}

impl Track for Curve {
    fn first(&self, surface: Surface, until: f64, accept: impl Fn(DVec3) -> bool) -> Option<f64> {
        match surface {
            Surface::Plane(axis, at) => {
                let height = self.control.map(|p| p[axis] - at);
                first(&height, until, self.noise, |u| accept(self.position(u)))
            }
            Surface::Radial(axes) => {
                // d(r²) = 2r dr with r near 1.
                let (height, noise) = (radial(&self.control, axes), self.noise.map(|n| 4.0 * n));
                first(&height, until, noise, |u| accept(self.position(u)))
            }
        }
    }

    fn theta(&self, u: f64) -> f64 {
        let [a, b] = self.theta;
        let theta = if u == 1.0 { b } else { a + (b - a) * u };
        theta.max(a.next_up())
    }

    fn position(&self, u: f64) -> DVec3 {
        evaluate(&self.control, u).0
    }
}

/// Returns the first root up to `until` that `accept` accepts.
fn first<const N: usize>(
    c: &[f64; N],
    until: f64,
    noise: [f64; 2],
    accept: impl Fn(f64) -> bool,
) -> Option<f64> {
    let mut from = 0.0;
    // A polynomial of degree ten has at most ten roots.
    for _ in 0..10 {
        from = first_root(c, from, until, noise)?;
        if accept(from) {
            return Some(from);
        }
    }
    None
}

/// Computes x² + y² + z² − 1 along a Bézier curve, using the first `axes` coordinates.
fn radial(control: &[DVec3; 6], axes: usize) -> [f64; 11] {
    let mut sum = [-1.0; 11];
    for axis in 0..axes {
        let h = control.map(|p| p[axis]);
        let square: [f64; 11] = product(&h, &h);
        sum = std::array::from_fn(|i| sum[i] + square[i]);
    }
    sum
}
