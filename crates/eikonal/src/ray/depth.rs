//! Optical depth along an arc (docs/theory.md#free-flight).

use super::arc::Arc;
use glam::DVec3;

/// Extinction along one arc, as a function of θ, for `N` spectral channels at once.
///
/// The arc is divided into equal pieces of θ. The depth of each piece follows from Simpson's rule.
/// Within a piece the extinction is linear between its ends, scaled so that it integrates to
/// exactly this depth. Depth and density are thus deterministic and consistent: the density of
/// [`Profile::density`] is the derivative of the depth of [`Profile::depth`]. Distances sampled
/// from it need no correction for quadrature error.
#[derive(Clone, Debug)]
pub struct Profile<const N: usize> {
    /// Extinction per unit of θ at the ends of the pieces.
    ends: Vec<[f64; N]>,
    /// Depth from the first θ to the ends of the pieces.
    depths: Vec<[f64; N]>,
    width: f64,
    /// First and last θ.
    range: [f64; 2],
}

impl<const N: usize> Profile<N> {
    /// Computes the profile of `extinction` (per unit length, at a position) over a range of θ,
    /// with pieces no longer than `spacing`. Outside the range there is no extinction.
    pub fn new(
        arc: &Arc,
        range: [f64; 2],
        spacing: f64,
        extinction: impl Fn(DVec3) -> [f64; N],
    ) -> Self {
        Profile::directed(arc, range, spacing, |x, _| extinction(x))
    }

    /// Computes the profile like [`Profile::new`], of an extinction at a position and along a unit
    /// vector: the direction of the arc.
    pub fn directed(
        arc: &Arc,
        range: [f64; 2],
        spacing: f64,
        extinction: impl Fn(DVec3, DVec3) -> [f64; N],
    ) -> Self {
        let [from, to] = range;
        let length = arc.arc_length(to) - arc.arc_length(from);
        let pieces = (length / spacing).ceil().min(1e6) as usize;
        let pieces = pieces.max(1);
        let width = (to - from) / pieces as f64;
        let rate = |theta: f64| {
            let velocity = arc.velocity(theta);
            let length = velocity.length();
            let speed = length * arc.h();
            extinction(arc.position(theta), velocity / length).map(|sigma| sigma * speed)
        };
        let mut ends = Vec::with_capacity(pieces + 1);
        let mut depths = Vec::with_capacity(pieces + 1);
        ends.push(rate(from));
        depths.push([0.0; N]);
        for i in 0..pieces {
            let middle = rate(from + (i as f64 + 0.5) * width);
            let (start, end) = (ends[i], rate(from + (i + 1) as f64 * width));
            depths.push(std::array::from_fn(|c| {
                depths[i][c] + (start[c] + 4.0 * middle[c] + end[c]) * width / 6.0
            }));
            ends.push(end);
        }
        Profile {
            ends,
            depths,
            width,
            range,
        }
    }

    /// Returns the depth of each channel over the whole profile.
    pub fn total(&self) -> [f64; N] {
        self.depths[self.depths.len() - 1]
    }

    /// Returns the depth of each channel up to `theta`.
    pub fn depth(&self, theta: f64) -> [f64; N] {
        let (i, u) = self.locate(theta);
        std::array::from_fn(|c| self.depths[i][c] + self.piece(i, c).0 * self.part(i, c, u))
    }

    /// Returns the depth per unit of θ of each channel at `theta`: the derivative of
    /// [`Profile::depth`].
    pub fn density(&self, theta: f64) -> [f64; N] {
        if theta < self.range[0] || theta > self.range[1] {
            return [0.0; N];
        }
        let (i, u) = self.locate(theta);
        std::array::from_fn(|c| {
            let (depth, slope) = self.piece(i, c);
            depth * (1.0 + slope * (2.0 * u - 1.0)) / self.width
        })
    }

    /// Returns the θ at which the depth of channel `c` reaches `target`. `None` if it does not do
    /// so within the profile and before an extinction that is NaN.
    pub fn invert(&self, c: usize, target: f64) -> Option<f64> {
        let below = |depth: &[f64; N]| depth[c] < target || depth[c].is_nan();
        let i = self.depths[1..].partition_point(below);
        if i + 1 >= self.depths.len() {
            return None;
        }
        let (depth, slope) = self.piece(i, c);
        let y = ((target - self.depths[i][c]) / depth).clamp(0.0, 1.0);
        // Solve u(1 − k) + k u² = y with k = slope, without cancellation.
        let root = ((1.0 - slope).powi(2) + 4.0 * slope * y).max(0.0).sqrt();
        let u = (2.0 * y / (1.0 - slope + root)).min(1.0);
        let places = i as f64 + if u.is_nan() { 1.0 } else { u };
        Some((self.range[0] + places * self.width).min(self.range[1]))
    }

    fn locate(&self, theta: f64) -> (usize, f64) {
        let position = (theta - self.range[0]) / self.width;
        let i = (position as usize).min(self.ends.len() - 2);
        (i, (position - i as f64).clamp(0.0, 1.0))
    }

    /// Returns the depth of a piece and the relative slope k in [−1, 1] of its linear extinction,
    /// σ(u) ∝ 1 + k(2u − 1).
    fn piece(&self, i: usize, c: usize) -> (f64, f64) {
        let (a, b) = (self.ends[i][c], self.ends[i + 1][c]);
        let slope = if a + b > 0.0 { (b - a) / (a + b) } else { 0.0 };
        (self.depths[i + 1][c] - self.depths[i][c], slope)
    }

    /// Returns the fraction of a piece's depth up to `u`.
    fn part(&self, i: usize, c: usize, u: f64) -> f64 {
        let slope = self.piece(i, c).1;
        u * (1.0 - slope) + slope * u * u
    }
}
