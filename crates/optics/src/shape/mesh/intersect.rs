//! Intersection of lines and arcs with a mesh.

use super::{Mesh, cross};
use crate::shape::Intersection;
use crate::shape::sweep::Sweep;
use eikonal::ray::Arc;
use eikonal::ray::bernstein::{evaluate, first_root, height, split};
use glam::{DVec3, Vec3Swizzles};

/// Largest deviation of a piece of an arc from its chord, as a fraction of half the size of the
/// mesh. A piece that deviates more is halved before traversal.
const MAX_DEVIATION: f64 = 1.0 / 64.0;

/// Maximum number of times that an arc is halved. Each halving divides the deviation by four.
const MAX_HALVINGS: u32 = 8;

/// Nearest hit so far: θ, triangle, barycentric coordinates.
struct Nearest {
    end: f64,
    hit: Option<(f64, usize, [f64; 3])>,
}

impl Nearest {
    fn offer(&mut self, theta: f64, triangle: usize, w: [f64; 3]) {
        // A hit on a shared edge belongs to the triangle that comes first.
        let nearer = |(t, i, _)| theta < t || (theta == t && triangle < i);
        if theta <= self.end && self.hit.is_none_or(nearer) {
            self.hit = Some((theta, triangle, w));
            self.end = theta;
        }
    }
}

impl Mesh {
    pub(in crate::shape) fn intersect(&self, arc: &Arc, theta: [f64; 2]) -> Option<Intersection> {
        let range = [theta[0].max(0.0), theta[1].min(1.0)];
        let mut nearest = Nearest {
            end: range[1],
            hit: None,
        };
        if arc.is_straight() {
            self.meet_line([arc.start(), arc.end()], range, &mut nearest);
        } else {
            let piece = Piece {
                control: arc.control(),
                theta: [0.0, 1.0],
            };
            self.meet_arc(&piece, range, MAX_HALVINGS, &mut nearest);
        }
        let (theta, triangle, w) = nearest.hit?;
        Some(Intersection {
            theta,
            local: w.into(),
            primitive: triangle as u32,
        })
    }

    fn meet_line(&self, ends: [DVec3; 2], range: [f64; 2], nearest: &mut Nearest) {
        let sweep = self.frame.line(&ends);
        let Some(near) = self.frame.clip(&sweep, range) else {
            return;
        };
        let test = LineTest::of(self, ends, range, near[0]);
        self.tree().visit_clipped(&sweep, near, &mut |i| {
            if let Some((theta, w)) = test.meet(self.triangle(i)) {
                nearest.offer(theta, i, w);
            }
            nearest.end
        });
    }

    /// Returns the intersection of a line with triangle `i`.
    #[inline]
    pub(in crate::shape) fn meet(&self, line: &LineTest, i: usize) -> Option<Intersection> {
        let (theta, w) = line.meet(self.triangle(i))?;
        Some(Intersection {
            theta,
            local: w.into(),
            primitive: i as u32,
        })
    }

    /// Returns the bound of the error of the point at `theta` of a line along `d`.
    fn point_noise(&self, theta: f64, d: DVec3) -> f64 {
        let cut = theta > 0.0 && theta < 1.0;
        self.noise
            + if cut {
                64.0 * f64::EPSILON * d.length()
            } else {
                0.0
            }
    }

    fn meet_arc(&self, piece: &Piece, range: [f64; 2], halvings: u32, nearest: &mut Nearest) {
        let sweep = Sweep::new(&piece.control.map(|p| self.frame.local(p)));
        let (Some(u_min), Some(u_max)) = (piece.u(range[0]), piece.u_end(nearest.end)) else {
            return;
        };
        let Some([u_start, _]) = self.frame.clip(&sweep, [u_min, u_max]) else {
            return;
        };
        // Halve pieces that deviate too much from their chords.
        if sweep.deviation() > MAX_DEVIATION && halvings > 0 {
            for half in piece.halves() {
                self.meet_arc(&half, range, halvings - 1, nearest);
            }
            return;
        }
        self.tree()
            .visit_clipped(&sweep, [u_start, u_max], &mut |i| {
                let until = piece.u_end(nearest.end).unwrap_or(u_min);
                if let Some((u, w)) = self.meet_triangle(&piece.control, i, [u_min, until]) {
                    nearest.offer(piece.at(u).max(range[0].next_up()), i, w);
                }
                piece.u_end(nearest.end).unwrap_or(u_min)
            });
    }

    /// Returns the first crossing of a curve with triangle `i` for u in (range[0], range[1]].
    fn meet_triangle(
        &self,
        control: &[DVec3; 6],
        i: usize,
        range: [f64; 2],
    ) -> Option<(f64, [f64; 3])> {
        let t = self.triangle(i);
        let n = cross(t).normalize();
        let h = height(control, t[0], n);
        let mut from = range[0];
        // A polynomial of degree five has at most five roots.
        for _ in 0..5 {
            from = first_root(&h, from, range[1], [self.noise; 2])?;
            let (p, dp) = evaluate(control, from);
            // At a small angle of incidence, the root and hence the point are less exact.
            let slope = (n.dot(dp) / dp.length()).abs().max(1e-4);
            if let Some(w) = barycentric(t, n, p, self.noise / slope) {
                return Some((from, w));
            }
        }
        None
    }
}

/// Exact test of a line against the triangles of a mesh.
pub(in crate::shape) struct LineTest {
    line: Line,
    /// Parameter at the origin of `line`.
    start: f64,
    range: [f64; 2],
    /// Points at both ends of the range, with bounds of their errors.
    ends: [(DVec3, f64); 2],
}

impl LineTest {
    /// Prepares the test of the line between two points for the triangles of `mesh`, for
    /// parameters in (range[0], range[1]]. Returns `None` if the line misses the box of the mesh.
    #[inline]
    pub(in crate::shape) fn new(mesh: &Mesh, ends: [DVec3; 2], range: [f64; 2]) -> Option<Self> {
        let range = [range[0].max(0.0), range[1].min(1.0)];
        let [start, _] = mesh.frame.clip(&mesh.frame.line(&ends), range)?;
        Some(Self::of(mesh, ends, range, start))
    }

    /// Prepares the test of a line that reaches the mesh at the parameter `start`.
    #[inline]
    fn of(mesh: &Mesh, ends: [DVec3; 2], range: [f64; 2], start: f64) -> Self {
        let d = ends[1] - ends[0];
        LineTest {
            // Start a long line where it reaches the mesh, so that no digits are lost.
            line: Line::new(point(ends, start), d),
            start,
            range,
            ends: range.map(|t| (point(ends, t), mesh.point_noise(t, d))),
        }
    }

    /// Returns the parameter and the barycentric coordinates of the crossing with a triangle of
    /// the mesh.
    #[inline]
    fn meet(&self, triangle: [DVec3; 3]) -> Option<(f64, [f64; 3])> {
        let (theta, w) = self.line.intersect(triangle)?;
        let [from, to] = self.range;
        crosses_plane(triangle, &self.ends)
            .then(|| ((self.start + theta).clamp(from.next_up(), to), w))
    }
}

/// Returns the point of a segment at `t`, exact at both ends.
fn point(ends: [DVec3; 2], t: f64) -> DVec3 {
    if t == 1.0 {
        ends[1]
    } else {
        ends[0] + (ends[1] - ends[0]) * t
    }
}

/// Returns true if a segment with these ends crosses the plane of a triangle: it starts off the
/// plane and ends on it or on the other side. A height below the noise counts as zero, so that
/// consecutive segments agree about their common end.
fn crosses_plane(t: [DVec3; 3], ends: &[(DVec3, f64); 2]) -> bool {
    let n = cross(t).normalize();
    let [start, end] = ends.map(|(p, noise)| {
        let h = n.dot(p - t[0]);
        if h.abs() <= noise { 0.0 } else { h.signum() }
    });
    start != 0.0 && start != end
}

/// Returns the barycentric coordinates of a point in the plane of a triangle. The point may be
/// beyond a side by up to `slack`, so that no curve slips between two triangles at a shared edge.
/// Returns `None` for points further out.
fn barycentric(t: [DVec3; 3], n: DVec3, p: DVec3, slack: f64) -> Option<[f64; 3]> {
    let mut w = [0.0; 3];
    for k in 0..3 {
        let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
        let area = n.dot((b - a).cross(p - a));
        if area < -slack * (b - a).length() {
            return None;
        }
        w[k] = area.max(0.0);
    }
    let sum = w[0] + w[1] + w[2];
    Some(w.map(|x| x / sum))
}

/// Piece of an arc, over [theta[0], theta[1]] of the whole.
struct Piece {
    control: [DVec3; 6],
    theta: [f64; 2],
}

impl Piece {
    fn at(&self, u: f64) -> f64 {
        let [a, b] = self.theta;
        if u == 1.0 { b } else { a + (b - a) * u }
    }

    /// Returns the parameter where the piece enters a range that starts at `theta`, or `None` if
    /// the piece lies before the range.
    fn u(&self, theta: f64) -> Option<f64> {
        let [a, b] = self.theta;
        (theta < b).then(|| ((theta - a) / (b - a)).max(0.0))
    }

    /// Returns the parameter where the piece leaves a range that ends at `theta`, or `None` if the
    /// piece lies beyond the range.
    fn u_end(&self, theta: f64) -> Option<f64> {
        let [a, b] = self.theta;
        (theta > a).then(|| ((theta - a) / (b - a)).min(1.0))
    }

    fn halves(&self) -> [Piece; 2] {
        let (left, right) = split(&self.control, 0.5);
        let [a, b] = self.theta;
        let m = 0.5 * (a + b);
        [(left, [a, m]), (right, [m, b])].map(|(control, theta)| Piece { control, theta })
    }
}

/// Rotates the coordinates of a vector so that `axis` becomes z.
#[inline]
fn rotated(v: DVec3, axis: usize) -> DVec3 {
    match axis {
        0 => v.yzx(),
        1 => v.zxy(),
        _ => v,
    }
}

/// Line prepared for watertight intersection tests (S. Woop, C. Benthin and I. Wald, "Watertight
/// Ray/Triangle Intersection", JCGT 2(1), 2013). Coordinates are sheared so that the line becomes
/// an axis. Two triangles with a common edge compute with equal numbers on which side of the edge
/// the line passes. The line therefore hits at least one of them.
pub(super) struct Line {
    /// Origin, rotated so that the line advances most along z.
    origin: DVec3,
    /// Axis along which the line advances most.
    axis: usize,
    shear: DVec3,
}

impl Line {
    pub(super) fn new(origin: DVec3, d: DVec3) -> Self {
        let axis = d.abs().max_position();
        let [origin, d] = [origin, d].map(|v| rotated(v, axis));
        Line {
            origin,
            axis,
            shear: DVec3::new(d.x, d.y, 1.0) / d.z,
        }
    }

    /// Returns twice the projected areas that the line spans with the three sides, and the
    /// parameters of the corners along the line. The parameters are in units of the vector from
    /// which the line was made.
    #[inline]
    pub(super) fn project(&self, t: [DVec3; 3]) -> ([f64; 3], [f64; 3]) {
        let s = self.shear;
        let [a, b, c] = t.map(|p| {
            let p = rotated(p, self.axis) - self.origin;
            (p.x - s.x * p.z, p.y - s.y * p.z, s.z * p.z)
        });
        let side = |p: (f64, f64, f64), q: (f64, f64, f64)| p.0 * q.1 - p.1 * q.0;
        ([side(c, b), side(a, c), side(b, a)], [a.2, b.2, c.2])
    }

    /// Returns the parameter and the barycentric coordinates of the crossing.
    #[inline]
    fn intersect(&self, t: [DVec3; 3]) -> Option<(f64, [f64; 3])> {
        let (e, z) = self.project(t);
        if e.iter().any(|x| *x < 0.0) && e.iter().any(|x| *x > 0.0) {
            return None;
        }
        let det = e[0] + e[1] + e[2];
        if det == 0.0 || !det.is_finite() {
            return None;
        }
        let w = e.map(|x| x / det);
        Some((w[0] * z[0] + w[1] * z[1] + w[2] * z[2], w))
    }
}
