//! First roots along straight lines, in closed form. The rules at the ends of the interval are the
//! rules of [`eikonal::ray::bernstein`].

use super::Intersection;
use super::curve::{Surface, Track};
use super::placement::Placement;
use eikonal::ray::Arc;
use glam::DVec3;

/// Rounding error of a position inside the interval, relative to the length of the line.
const POSITION_ERROR: f64 = 64.0 * f64::EPSILON;

/// Straight arc in the local coordinates of a shape; u is θ.
pub(super) struct Line {
    start: DVec3,
    step: DVec3,
    range: [f64; 2],
    /// Bound of the error of the coordinates at both ends.
    noise: f64,
}

impl Line {
    /// Creates the part of a straight arc with θ ∈ [theta[0], theta[1]].
    #[inline]
    pub(super) fn new(arc: &Arc, theta: [f64; 2], placement: &Placement) -> Self {
        let [start, end] = [arc.start(), arc.end()].map(|p| placement.local(p));
        Line {
            start,
            step: end - start,
            range: [theta[0].max(0.0), theta[1].min(1.0)],
            noise: placement.noise(),
        }
    }
}

impl Line {
    /// Returns the intersection with the cube \[−1, 1\]³, from outside or from within, and the
    /// index of the face. Face 2k (2k + 1) is where coordinate k is −1 (+1). The line is in the
    /// cube while it is in all three slabs, so it cannot slip between two faces.
    #[inline]
    pub(super) fn cube(&self) -> Option<(f64, usize)> {
        let (mut enter, mut leave) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
        for axis in 0..3 {
            let inverse = self.step[axis].recip();
            let ahead = 1f64.copysign(inverse);
            // A line that runs along a face gives NaN, which the comparisons ignore.
            let near = (-ahead - self.start[axis]) * inverse;
            let far = (ahead - self.start[axis]) * inverse;
            if near > enter.0 {
                enter = (near, axis);
            }
            if far < leave.0 {
                leave = (far, axis);
            }
        }
        if enter.0 <= leave.0 {
            self.passes(enter.0, enter.1, -1.0)
                .or_else(|| self.passes(leave.0, leave.1, 1.0))
        } else {
            None
        }
    }

    /// Returns the face across an axis that the line crosses at `u`, against (−1) or along (1) the
    /// normal, if the crossing is in range. A height below the noise counts as zero.
    #[inline]
    fn passes(&self, u: f64, axis: usize, along: f64) -> Option<(f64, usize)> {
        let [from, to] = self.range;
        let out = along.copysign(along * self.step[axis]);
        let passes = self.starts_before(axis, out) && self.ends_beyond(axis, out);
        let face = 2 * axis + usize::from(out > 0.0);
        (passes && from < to).then(|| (u.clamp(from.next_up(), to), face))
    }

    /// Returns true if the range starts before the plane where a coordinate is `at`. A distance
    /// below the noise counts as zero.
    #[inline]
    fn starts_before(&self, axis: usize, at: f64) -> bool {
        self.height(axis, at, self.range[0]) < -self.noise_at(axis, self.range[0])
    }

    /// Returns true if the range ends beyond the plane where a coordinate is `at`, or on the plane
    /// to within the noise.
    #[inline]
    fn ends_beyond(&self, axis: usize, at: f64) -> bool {
        self.height(axis, at, self.range[1]) >= -self.noise_at(axis, self.range[1])
    }

    /// Returns the height over a plane, positive in the direction of the line.
    #[inline]
    fn height(&self, axis: usize, at: f64, u: f64) -> f64 {
        (self.start[axis] + self.step[axis] * u - at) * 1f64.copysign(self.step[axis])
    }

    /// Returns the bound of the error of a coordinate at an end of the range.
    #[inline]
    fn noise_at(&self, axis: usize, u: f64) -> f64 {
        let cut = u > 0.0 && u < 1.0;
        self.noise
            + if cut {
                POSITION_ERROR * self.step[axis].abs()
            } else {
                0.0
            }
    }
}

/// Walks of a line through unit cells. The lowest corner of a cell identifies it.
impl Line {
    /// Returns the cell in which the range starts; on a face, to within the noise, the cell ahead.
    #[inline]
    pub(super) fn first_cell(&self) -> DVec3 {
        let from = self.range[0];
        let place = self.position(from);
        let (mut cell, face) = (place.floor(), place.round());
        for axis in 0..3 {
            let is_close = (place[axis] - face[axis]).abs() <= self.noise_at(axis, from);
            if is_close && self.step[axis] != 0.0 {
                cell[axis] = face[axis] - if self.goes_up(axis) { 0.0 } else { 1.0 };
            }
        }
        cell
    }

    /// Returns true if the coordinate along `axis` increases along the line.
    #[inline]
    pub(super) fn goes_up(&self, axis: usize) -> bool {
        self.step[axis].is_sign_positive()
    }

    /// Returns the parameter where the line enters the box from 0 to `size`, and the axis across
    /// the face crossed there. Returns `None` if the line starts inside or the crossing is out of
    /// range.
    #[inline]
    pub(super) fn enters(&self, size: DVec3) -> Option<(f64, usize)> {
        let (mut enter, mut leave) = ((f64::NEG_INFINITY, 0, 0.0), f64::INFINITY);
        for axis in 0..3 {
            let (mut near, mut far) = (0.0, size[axis]);
            if !self.goes_up(axis) {
                (near, far) = (far, near);
            }
            // A line that runs along a face gives NaN, which the comparisons ignore.
            let [first, last] = [near, far].map(|at| (at - self.start[axis]) / self.step[axis]);
            if first > enter.0 {
                enter = (first, axis, near);
            }
            if last < leave {
                leave = last;
            }
        }
        let (u, axis, at) = enter;
        let enters = u <= leave && self.starts_before(axis, at) && self.ends_beyond(axis, at);
        enters.then_some((u, axis))
    }

    /// Returns the parameter where the line leaves a box that contains it, and the axis across the
    /// face crossed there. Returns `None` if the crossing is out of range.
    #[inline]
    pub(super) fn leaves(&self, low: DVec3, high: DVec3) -> Option<(f64, usize)> {
        let mut first: Option<(f64, usize)> = None;
        for axis in 0..3 {
            let at = if self.goes_up(axis) { high } else { low }[axis];
            if self.step[axis] != 0.0 && self.ends_beyond(axis, at) {
                let u = (at - self.start[axis]) / self.step[axis];
                if first.is_none_or(|(other, _)| u < other) {
                    first = Some((u, axis));
                }
            }
        }
        first.filter(|_| self.range[0] < self.range[1])
    }

    /// Returns the intersection at `u` with the plane where a coordinate is `at`.
    #[inline]
    pub(super) fn intersection(
        &self,
        axis: usize,
        at: f64,
        u: f64,
        primitive: u32,
    ) -> Intersection {
        let [from, to] = self.range;
        let mut local = self.position(u);
        local[axis] = at;
        Intersection {
            theta: u.clamp(from.next_up(), to),
            local,
            primitive,
        }
    }
}

impl Track for Line {
    #[inline]
    fn first(&self, surface: Surface, until: f64, accept: impl Fn(DVec3) -> bool) -> Option<f64> {
        let [from, to] = [self.range[0], self.range[1].min(until)];
        let noise = [self.noise; 2];
        match surface {
            Surface::Plane(axis, at) => {
                let height = self.start[axis] - at;
                let root = linear([height, height + self.step[axis]], [from, to], noise);
                root.filter(|u| accept(self.position(*u)))
            }
            Surface::Radial(axes) => {
                let across = |p: DVec3| if axes == 2 { p.with_z(0.0) } else { p };
                let root = |from| radial(across(self.start), across(self.step), [from, to], noise);
                let first = root(from)?;
                if accept(self.position(first)) {
                    Some(first)
                } else {
                    root(first).filter(|u| accept(self.position(*u)))
                }
            }
        }
    }

    #[inline]
    fn theta(&self, u: f64) -> f64 {
        u
    }

    #[inline]
    fn position(&self, u: f64) -> DVec3 {
        self.start + self.step * u
    }
}

/// Search interval, with the values at its ends. Values that are zero to rounding are stored as
/// zero.
struct Range {
    from: f64,
    to: f64,
    ends: [f64; 2],
}

impl Range {
    /// Creates the interval. `noise` bounds the errors of the values at 0 and 1; `inside` is added
    /// to the bounds elsewhere. Returns `None` if the interval is empty or a bound is not a number.
    #[inline]
    fn new(
        f: impl Fn(f64) -> f64,
        [from, to]: [f64; 2],
        noise: [f64; 2],
        inside: f64,
    ) -> Option<Self> {
        if from.partial_cmp(&to)?.is_ge() {
            return None;
        }
        let at_from = noise[0] + if from > 0.0 { inside } else { 0.0 };
        let at_to = noise[1] + if to < 1.0 { inside } else { 0.0 };
        let zeroed = |value: f64, noise: f64| if value.abs() <= noise { 0.0 } else { value };
        let ends = [zeroed(f(from), at_from), zeroed(f(to), at_to)];
        Some(Range { from, to, ends })
    }

    /// Returns the root `inside` if there is one, else the end of the interval if the end is a
    /// root.
    #[inline]
    fn first(&self, inside: Option<f64>) -> Option<f64> {
        let root = inside.or((self.ends[1] == 0.0).then_some(self.to))?;
        Some(root.clamp(self.from.next_up(), self.to))
    }
}

/// Returns the root in (from, to] of the linear function with values `a` and `b` at 0 and 1.
/// `noise` bounds the errors of these values.
#[inline(always)]
fn linear([a, b]: [f64; 2], range: [f64; 2], noise: [f64; 2]) -> Option<f64> {
    let inside = POSITION_ERROR * (b - a).abs();
    let near = noise[0].max(noise[1]) + inside;
    // Reject lines that stay on one side of the plane, as most lines do.
    let apart = (a > near && b > near) || (a < -near && b < -near);
    let differs = a.abs() > near || b.abs() > near;
    if apart || !differs || near.is_nan() {
        return None;
    }
    let f = |t: f64| a + (b - a) * t;
    let range = Range::new(f, range, noise, inside)?;
    let [a, b] = range.ends;
    let crosses = (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0);
    range.first(crosses.then(|| range.from + (range.to - range.from) * (a / (a - b))))
}

/// Returns the first root in (from, to] of |start + t·step|² − 1. `noise` bounds the errors of
/// positions at 0 and 1.
#[inline]
fn radial(start: DVec3, step: DVec3, range: [f64; 2], noise: [f64; 2]) -> Option<f64> {
    let squared = step.length_squared();
    let nearest = -start.dot(step) / squared;
    // Compute the height at the point nearest to the centre: above zero if the line crosses, below
    // zero if it passes outside. This form loses no digits on long lines.
    let height = 1.0 - (start + step * nearest).length_squared();
    // d(r²) = 2r dr with r near 1.
    let noise = noise.map(|n| 4.0 * n);
    let inside = 4.0 * POSITION_ERROR * squared.sqrt();
    if !(height > -(noise[0].max(noise[1]) + inside) && squared > 0.0) {
        return None;
    }
    let f = |t: f64| (start + step * t).length_squared() - 1.0;
    let range = Range::new(f, range, noise, inside)?;
    let within = |t: &f64| *t > range.from && *t < range.to;
    if range.ends[0] == 0.0 {
        // The start is a root; return the other one.
        return range.first(Some(2.0 * nearest - range.from).filter(within));
    }
    let half = (height.max(0.0) / squared).sqrt();
    let roots = [nearest - half, nearest + half];
    range.first(roots.into_iter().find(within).filter(|_| height > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use eikonal::Aabb;
    use eikonal::ray::bernstein::first_root;
    use glam::DAffine3;

    /// Returns numbers in [−1, 1], some of them zero or close to zero.
    fn numbers() -> impl Iterator<Item = f64> {
        let mut state = 1u64;
        std::iter::from_fn(move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            let uniform = (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
            Some(match state >> 60 {
                0 => 0.0,
                1 => uniform * 1e-16,
                _ => uniform,
            })
        })
    }

    /// Compares the closed form with the general method, to rounding where roots are well
    /// separated.
    fn agree(a: Option<f64>, b: Option<f64>) -> bool {
        match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() < 1e-12,
            (a, b) => a == b,
        }
    }

    #[test]
    fn as_the_general_method() {
        let mut numbers = numbers();
        let mut next = || numbers.next().unwrap();
        let mut found = [0; 2];
        for _ in 0..100_000 {
            let (a, b) = (next().abs(), next().abs());
            let range = if next() > 0.0 {
                [0.0, 1.0]
            } else {
                [a.min(b), a.max(b)]
            };
            let noise = [1e-15, 1e-15];
            let c = [next(), next()];
            let root = linear(c, range, noise);
            assert!(
                agree(root, first_root(&c, range[0], range[1], noise)),
                "{c:?} {range:?}"
            );
            found[0] += u32::from(root.is_some());
            let [start, end] = [0; 2].map(|_| 2.0 * DVec3::new(next(), next(), next()));
            let c = [start.dot(start), start.dot(end), end.dot(end)].map(|square| square - 1.0);
            if (c[1] * c[1] - c[0] * c[2]).abs() < 1e-3 || start.distance(end) < 0.03 {
                continue;
            }
            let root = radial(start, end - start, range, noise);
            assert!(
                agree(root, first_root(&c, range[0], range[1], noise)),
                "{start} {end} {range:?}"
            );
            found[1] += u32::from(root.is_some());
        }
        assert!(found.iter().all(|&n| n > 10_000), "{found:?}");
    }

    /// Compares slabs with the six faces one by one. Lines and ranges start and end anywhere, also
    /// on faces.
    #[test]
    fn the_cube_as_its_faces() {
        let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        let placement = Placement::new(DAffine3::IDENTITY, &bounds).unwrap();
        let mut numbers = numbers();
        let mut next = || numbers.next().unwrap();
        let mut found = 0;
        for i in 0..100_000 {
            let mut ends = [0; 2].map(|_| 1.7 * DVec3::new(next(), next(), next()));
            ends[i % 2][i % 3] = if i % 7 == 0 { 1.0 } else { ends[i % 2][i % 3] };
            let (a, b) = (next().abs(), next().abs());
            let range = match i % 2 {
                0 => [0.0, 1.0],
                _ => [a.min(b), a.max(b)],
            };
            let line = Line::new(
                &Arc::line(ends[0], ends[1] - ends[0], 1.0),
                range,
                &placement,
            );
            let faces = (0..6).filter_map(|face: usize| {
                let (axis, at) = (face / 2, if face.is_multiple_of(2) { -1.0 } else { 1.0 });
                let others = [(axis + 1) % 3, (axis + 2) % 3];
                let inside = |p: DVec3| others.iter().all(|&k| p[k].abs() <= 1.0);
                line.first(Surface::Plane(axis, at), 1.0, inside)
            });
            let nearest = faces.min_by(f64::total_cmp);
            assert!(
                agree(line.cube().map(|(u, _)| u), nearest),
                "{ends:?} {range:?}"
            );
            found += u32::from(nearest.is_some());
        }
        assert!(found > 20_000, "{found}");
    }

    #[test]
    fn no_roots_without_sense() {
        let nan = f64::NAN;
        assert_eq!(linear([nan, 1.0], [0.0, 1.0], [0.0; 2]), None);
        assert_eq!(linear([-1.0, 1.0], [nan, 1.0], [0.0; 2]), None);
        assert_eq!(linear([0.0; 2], [0.0, 1.0], [0.0; 2]), None);
        let whole = |start, step| radial(start, step, [0.0, 1.0], [0.0; 2]);
        assert_eq!(whole(DVec3::NAN, DVec3::X), None);
        assert_eq!(whole(DVec3::X, DVec3::ZERO), None);
    }

    /// Tests that roots are as exact as positions, however far away a line starts.
    #[test]
    fn long_lines() {
        let start = DVec3::new(-1e6, 0.6, 0.0);
        let root = radial(start, DVec3::X * 2e6, [0.0, 1.0], [1e-15; 2]).unwrap();
        assert!((start.x + 2e6 * root + 0.8).abs() < 1e-9);
    }
}
