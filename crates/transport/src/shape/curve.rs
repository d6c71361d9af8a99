//! An arc in the local coordinates of a shape.

use super::line;
use super::placement::Placement;
use super::sweep::Sweep;
use eikonal::Aabb;
use eikonal::ray::Arc;
use eikonal::ray::bernstein::{evaluate, first_root, height, product, restrict};
use glam::DVec3;

/// Growth of the box that an arc is clipped to: the cut ends lie well away from the surface.
const MARGIN: f64 = 0.1;

/// The local coordinates of a line are exact to this fraction of its length, of an arc cut out of
/// a longer one to this fraction of its control points.
const CUT_NOISE: f64 = 64.0 * f64::EPSILON;

/// The part of an arc that comes near a shape, as a curve over u ∈ [0, 1].
pub(super) struct Curve {
    points: Points,
    theta: [f64; 2],
    /// Bound of the error of the coordinates at u = 0 and u = 1.
    noise: [f64; 2],
}

enum Points {
    Line([DVec3; 2]),
    Arc([DVec3; 6]),
}

/// A function of u whose roots are intersections, in Bernstein form.
pub(super) struct Function {
    coefficients: Coefficients,
    noise: [f64; 2],
}

enum Coefficients {
    Linear([f64; 2]),
    Quadratic([f64; 3]),
    Quintic([f64; 6]),
    Decic([f64; 11]),
}

impl Curve {
    /// The part of θ ∈ [theta[0], theta[1]] within and around the local box `bounds`.
    pub fn new(arc: &Arc, theta: [f64; 2], placement: &Placement, bounds: &Aabb) -> Option<Self> {
        Curve::leaving(arc, theta, placement, bounds, |_| false)
    }

    /// As [`Curve::new`]; `None` also if the whole arc lies well within a convex shape, so that it
    /// cannot meet its surface: a curve lies in the convex hull of its control points.
    pub fn leaving(
        arc: &Arc,
        theta: [f64; 2],
        placement: &Placement,
        bounds: &Aabb,
        within: impl Fn(DVec3) -> bool,
    ) -> Option<Self> {
        let range = [theta[0].max(0.0), theta[1].min(1.0)];
        let near = bounds.grown(MARGIN);
        if arc.is_straight() {
            let ends = [placement.local(arc.start()), placement.local(arc.end())];
            if ends.into_iter().all(&within) {
                return None;
            }
            let theta = Sweep::new(&ends).clip(&near, range)?;
            let length = (ends[1] - ends[0]).length();
            let points = Points::Line(theta.map(|t| on_line(&ends, t)));
            return Some(Curve::cut(points, theta, placement, length));
        }
        let control = arc.control().map(|p| placement.local(p));
        if control.into_iter().all(within) {
            return None;
        }
        let theta = Sweep::new(&control).clip(&near, range)?;
        let size = control.iter().fold(0.0, |m: f64, p| m.max(p.length()));
        let points = Points::Arc(restrict(&control, theta[0], theta[1]));
        Some(Curve::cut(points, theta, placement, size))
    }

    fn cut(points: Points, theta: [f64; 2], placement: &Placement, size: f64) -> Self {
        let cut = |whole: bool| if whole { 0.0 } else { CUT_NOISE * size };
        let noise = [cut(theta[0] == 0.0), cut(theta[1] == 1.0)];
        Curve {
            points,
            theta,
            noise: noise.map(|n| n + placement.noise()),
        }
    }

    /// The parameter θ of the arc at `u` > 0.
    pub fn theta(&self, u: f64) -> f64 {
        let [a, b] = self.theta;
        let theta = if u == 1.0 { b } else { a + (b - a) * u };
        theta.max(a.next_up())
    }

    /// Local position at `u`.
    pub fn position(&self, u: f64) -> DVec3 {
        match &self.points {
            Points::Line(p) => on_line(p, u),
            Points::Arc(p) => evaluate(p, u).0,
        }
    }

    /// Coordinate `axis`, minus `at`.
    pub fn plane(&self, axis: usize, at: f64) -> Function {
        Function {
            coefficients: match &self.points {
                Points::Line(c) => Coefficients::Linear(c.map(|p| p[axis] - at)),
                Points::Arc(c) => Coefficients::Quintic(c.map(|p| p[axis] - at)),
            },
            noise: self.noise,
        }
    }

    /// x² + y² + z² − 1, the coordinates being those that `axes` selects.
    pub fn radial(&self, axes: &[DVec3]) -> Function {
        Function {
            coefficients: match &self.points {
                Points::Line(c) => Coefficients::Quadratic(sphere(c, axes)),
                Points::Arc(c) => Coefficients::Decic(sphere(c, axes)),
            },
            // d(r²) = 2r dr with r near 1.
            noise: self.noise.map(|n| 4.0 * n),
        }
    }

    /// The first root of `f` in (0, until] at whose position `accept` holds.
    pub fn first(&self, f: &Function, until: f64, accept: impl Fn(DVec3) -> bool) -> Option<f64> {
        let mut from = 0.0;
        // There are at most ten roots.
        for _ in 0..10 {
            from = f.root(from, until)?;
            if accept(self.position(from)) {
                return Some(from);
            }
        }
        None
    }
}

impl Function {
    fn root(&self, from: f64, to: f64) -> Option<f64> {
        match &self.coefficients {
            Coefficients::Linear(c) => line::linear(c, [from, to], self.noise),
            Coefficients::Quadratic(c) => line::quadratic(c, [from, to], self.noise),
            Coefficients::Quintic(c) => first_root(c, from, to, self.noise),
            Coefficients::Decic(c) => first_root(c, from, to, self.noise),
        }
    }
}

/// The point of a segment at `t`, exact at both ends.
fn on_line(ends: &[DVec3; 2], t: f64) -> DVec3 {
    if t == 1.0 {
        ends[1]
    } else {
        ends[0] + (ends[1] - ends[0]) * t
    }
}

/// Σ (aₖ·x)² − 1 along a Bézier curve.
fn sphere<const K: usize, const M: usize>(control: &[DVec3; K], axes: &[DVec3]) -> [f64; M] {
    let mut sum = [-1.0; M];
    for &axis in axes {
        let h = height(control, DVec3::ZERO, axis);
        let square: [f64; M] = product(&h, &h);
        sum = std::array::from_fn(|i| sum[i] + square[i]);
    }
    sum
}
