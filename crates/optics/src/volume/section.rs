//! Integrals of the values of a grid along straight lines, exact to rounding. The grid ends at its
//! cube.
//!
//! Along a line inside a cell, trilinear interpolation gives a polynomial of degree three at most.
//! Gauss's rule with two nodes integrates it exactly.
//!
//! Theory: docs/theory.md#free-flight.

use super::cells::Cells;
use super::grid::VolumeGrid;
use crate::Spectrum;
use eikonal::ray::Arc;
use glam::DVec3;

/// Nodes of Gauss–Legendre quadrature on [0, 1]; the weights are equal.
const NODES: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Maximum number of Newton steps for finding a place in a cell. Each step doubles the number of
/// correct digits.
const MAX_STEPS: usize = 20;

/// Grid along the straight line over θ ∈ [0, 1].
#[derive(Clone, Debug)]
pub struct Section<'a> {
    grid: &'a VolumeGrid,
    /// Start and extent of the line, in units of cells.
    start: DVec3,
    step: DVec3,
    /// Factor of the values.
    scale: f64,
    /// Product of `scale` and the length of the line.
    factor: f64,
    /// Part of the line in the cube of the grid.
    part: [f64; 2],
    /// Places up to which the integral is known, with the integral, in order; possibly empty.
    known: Vec<(f64, Spectrum)>,
}

impl<'a> Section<'a> {
    /// Creates the section of a grid, with values multiplied by `scale`, along a straight arc.
    pub fn new(grid: &'a VolumeGrid, scale: f64, arc: &Arc) -> Self {
        let start = grid.in_cells(arc.start());
        Section {
            grid,
            start,
            step: grid.in_cells(arc.end()) - start,
            scale,
            factor: scale * arc.arc_length(1.0),
            part: grid.straight_part(arc),
            known: Vec::new(),
        }
    }

    /// Returns the integrand per unit length at a point of the line.
    pub(crate) fn value(&self, x: DVec3) -> Spectrum {
        self.grid.within(x) * self.scale
    }

    /// Tabulates the integral up to every cell before θ = `end`, to speed up many later queries.
    pub(crate) fn tabulate(&mut self, end: f64) {
        let mut known = Vec::new();
        match self.grid.channels() {
            1 => {
                let keep = |theta, [sum]: [f64; 1]| known.push((theta, Spectrum::splat(sum)));
                self.march([0.0, end], 0, f64::INFINITY, keep);
            }
            _ => {
                let keep = |theta, sum| known.push((theta, Spectrum(sum)));
                self.march([0.0, end], 0, f64::INFINITY, keep);
            }
        }
        self.known = known;
    }

    /// Returns the integral over length from θ = 0 to `end`.
    pub(crate) fn integral(&self, end: f64) -> Spectrum {
        let before = self.known.partition_point(|(theta, _)| *theta <= end);
        let (from, sum) = match before {
            0 => (0.0, Spectrum::ZERO),
            n => self.known[n - 1],
        };
        sum + self.until([from, end], 0, f64::INFINITY).1
    }

    /// Calls `see` with each voxel that contributes along the line up to θ = `end`, and the
    /// integral of its weight over length. `Section::integral` is the sum of these integrals times
    /// the samples times `scale`. A voxel may be reported several times.
    pub fn weights(&self, end: f64, mut see: impl FnMut(usize, f64)) {
        let length = self.factor / self.scale;
        let range = [self.part[0], end.min(self.part[1])];
        for (cell, [from, to]) in Cells::new(self.grid, [self.start, self.step], range) {
            let voxels = self.grid.corner_voxels(cell);
            if self.grid.is_flat() {
                see(voxels[0], (to - from) * length);
                continue;
            }
            let origin = self.start - DVec3::from(cell.map(|i| i as f64));
            let [a, b] = NODES.map(|node| origin + self.step * (from + (to - from) * node));
            // Compute the weights of the four edges along x at both nodes.
            let half = 0.5 * (to - from) * length;
            let edges = |t: DVec3| {
                let [near, far] = [half * (1.0 - t.z), half * t.z];
                [near * (1.0 - t.y), near * t.y, far * (1.0 - t.y), far * t.y]
            };
            let (at_a, at_b) = (edges(a), edges(b));
            for edge in 0..4 {
                let (both, right) = (at_a[edge] + at_b[edge], at_a[edge] * a.x + at_b[edge] * b.x);
                see(voxels[2 * edge], both - right);
                see(voxels[2 * edge + 1], right);
            }
        }
    }

    /// Finds where the integral of a channel reaches `target` before θ = `end`, if anywhere. Also
    /// returns the integral up to this place, or up to the end.
    pub(crate) fn reach(&self, end: f64, channel: usize, target: f64) -> (Option<f64>, Spectrum) {
        self.until([0.0, end], channel, target)
    }

    fn until(&self, range: [f64; 2], channel: usize, target: f64) -> (Option<f64>, Spectrum) {
        match self.grid.channels() {
            1 => {
                let (theta, [sum]) = self.march(range, 0, target, |_, _| {});
                (theta, Spectrum::splat(sum))
            }
            _ => {
                let (theta, sum) = self.march(range, channel, target, |_, _| {});
                (theta, Spectrum(sum))
            }
        }
    }

    /// Traverses the cells in a range of θ, and calls `passed` with each end of a cell and the
    /// integral up to it.
    #[inline]
    fn march<const N: usize>(
        &self,
        range: [f64; 2],
        channel: usize,
        target: f64,
        mut passed: impl FnMut(f64, [f64; N]),
    ) -> (Option<f64>, [f64; N]) {
        if self.grid.is_flat() {
            return self.march_flat(range, channel, target, passed);
        }
        let mut sum = [0.0; N];
        let range = [range[0].max(self.part[0]), range[1].min(self.part[1])];
        for (cell, range) in Cells::new(self.grid, [self.start, self.step], range) {
            let piece = Piece {
                section: self,
                corners: self.grid.corners(cell),
                origin: self.start - DVec3::from(cell.map(|i| i as f64)),
            };
            let added = add(sum, piece.integral(range));
            if added[channel] >= target {
                let theta = piece.invert(range, channel, target - sum[channel]);
                return (Some(theta), add(sum, piece.integral([range[0], theta])));
            }
            sum = added;
            passed(range[1], sum);
        }
        (None, sum)
    }
}

impl Section<'_> {
    /// Traverses the cells like [`Section::march`], for values that are constant in each cell.
    #[inline]
    fn march_flat<const N: usize>(
        &self,
        range: [f64; 2],
        channel: usize,
        target: f64,
        mut passed: impl FnMut(f64, [f64; N]),
    ) -> (Option<f64>, [f64; N]) {
        let mut sum = [0.0; N];
        let range = [range[0].max(self.part[0]), range[1].min(self.part[1])];
        for (cell, [from, to]) in Cells::new(self.grid, [self.start, self.step], range) {
            let rate = self.grid.flat::<N>(cell).map(|value| value * self.factor);
            let up_to = |theta: f64| std::array::from_fn(|c| sum[c] + rate[c] * (theta - from));
            let after: [f64; N] = up_to(to);
            if after[channel] >= target {
                let theta = from + (target - sum[channel]) / rate[channel];
                let theta = theta.clamp(from, to);
                return (Some(theta), up_to(theta));
            }
            sum = after;
            passed(to, sum);
        }
        (None, sum)
    }
}

fn add<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|c| a[c] + b[c])
}

/// Part of a line within a cell.
struct Piece<'a, const N: usize> {
    section: &'a Section<'a>,
    /// Samples at the corners of the cell, x fastest.
    corners: [[f64; N]; 8],
    /// Start of the line, relative to the first corner of the cell.
    origin: DVec3,
}

impl<const N: usize> Piece<'_, N> {
    /// Returns the integrand per unit of θ.
    #[inline]
    fn value(&self, theta: f64) -> [f64; N] {
        let t = self.origin + self.section.step * theta;
        let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
        std::array::from_fn(|c| {
            let row = |i: usize| lerp(self.corners[i][c], self.corners[i + 1][c], t.x);
            let plane = |i: usize| lerp(row(i), row(i + 2), t.y);
            lerp(plane(0), plane(4), t.z) * self.section.factor
        })
    }

    #[inline]
    fn integral(&self, [from, to]: [f64; 2]) -> [f64; N] {
        let width = to - from;
        let [a, b] = NODES.map(|node| self.value(from + width * node));
        std::array::from_fn(|c| 0.5 * width * (a[c] + b[c]))
    }

    /// Finds where the integral of a channel from the start of the piece reaches `target`. It must
    /// do so within the piece.
    fn invert(&self, [from, to]: [f64; 2], channel: usize, target: f64) -> f64 {
        let (mut low, mut high) = (from, to);
        let mut theta = low;
        for _ in 0..MAX_STEPS {
            let excess = self.integral([from, theta])[channel] - target;
            if excess < 0.0 {
                low = theta
            } else {
                high = theta
            }
            let newton = theta - excess / self.value(theta)[channel];
            let next = if newton >= low && newton <= high {
                newton
            } else {
                0.5 * (low + high)
            };
            let change = (next - theta).abs();
            theta = next;
            if change <= 1e-15 * to {
                break;
            }
        }
        theta
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::{GridFilter, GridSamples};
    use super::*;
    use eikonal::field::Placement;
    use glam::{DAffine3, DMat3};

    /// Returns numbers in [0, 1).
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1u64;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Creates a sheared grid of 5 × 4 × 1 samples.
    fn grid(channels: usize, filter: GridFilter, placement: Placement) -> VolumeGrid {
        let mut next = numbers();
        let data = (0..20 * channels).map(|_| next() as f32).collect();
        let columns = [[1.0, 0.1, 0.0], [0.0, 0.8, 0.2], [0.0, 0.0, 0.5]];
        let to_world = DAffine3::from_mat3_translation(
            DMat3::from_cols_array_2d(&columns),
            DVec3::new(-0.4, -0.3, -0.2),
        );
        let samples = GridSamples {
            size: [5, 4, 1],
            channels,
            data,
        };
        VolumeGrid::new(samples, to_world, placement, filter, [0.0, 1.0]).unwrap()
    }

    /// Returns lines through and past the grid, some along an axis, some starting in a plane
    /// between cells.
    fn lines() -> impl Iterator<Item = Arc> {
        let mut next = numbers();
        let mut point = move || DVec3::new(next(), next(), next()) * 2.0 - 0.9;
        (0..300).map(move |i| {
            let mut x = point();
            let mut v = (0.5 * point() - x) * 0.8;
            match i % 6 {
                0 => v = DVec3::X,
                1 => v = -DVec3::Y,
                2 => x = DVec3::new(-0.4, -0.3, -0.2),
                _ => {}
            }
            Arc::line(x, v, 1.7)
        })
    }

    fn every_grid() -> impl Iterator<Item = VolumeGrid> {
        let placements = [Placement::Centers, Placement::Nodes];
        let filters = [GridFilter::Trilinear, GridFilter::Nearest];
        [1, 3].into_iter().flat_map(move |channels| {
            let pairs = filters
                .into_iter()
                .flat_map(move |f| placements.map(|p| (f, p)));
            pairs.map(move |(filter, placement)| grid(channels, filter, placement))
        })
    }

    /// Compares with the midpoint rule. For the nearest sample, its error is a jump within one
    /// step.
    #[test]
    fn integrals_are_those_of_the_values() {
        const STEPS: usize = 4000;
        for grid in every_grid() {
            for line in lines() {
                let section = Section::new(&grid, 2.0, &line);
                let end = 0.9;
                let width = end / STEPS as f64;
                let values =
                    (0..STEPS).map(|i| section.value(line.position((i as f64 + 0.5) * width)));
                let sum = values.fold(Spectrum::ZERO, |a, b| a + b);
                let sum = sum * (width * line.arc_length(1.0));
                let found = section.integral(end);
                let error = (sum - found).map(f64::abs).max();
                // Count the jumps: at both ends of the grid, and for nearest samples between all
                // samples.
                let jumps = match grid.planes()[0][0] {
                    0 => 2.0,
                    _ => 14.0,
                };
                let tolerance = 1e-5 + 2.0 * jumps * width * line.arc_length(1.0);
                assert!(error < tolerance, "{error} {line:?} {grid:?}");
            }
        }
    }

    /// Tests that the weights of voxels, times their samples, add up to the integral, and to the
    /// value at a point.
    #[test]
    fn weights_times_samples_are_values_and_integrals() {
        for grid in every_grid().filter(|grid| grid.channels() == 1) {
            let [nx, ny, _] = grid.size();
            let sample = |i: usize| grid.sample_at([i % nx, i / nx % ny, i / nx / ny])[0];
            for line in lines() {
                let (mut integral, mut value) = (0.0, 0.0);
                let section = Section::new(&grid, 2.0, &line);
                section.weights(0.9, |voxel, length| {
                    integral += 2.0 * sample(voxel) * length
                });
                assert!((integral - section.integral(0.9)[0]).abs() < 1e-13);
                grid.weights(line.position(0.4), |voxel, weight| {
                    value += sample(voxel) * weight
                });
                assert!((value - grid.at(line.position(0.4))[0]).abs() < 1e-13);
            }
        }
    }

    /// Tests that the integral over a grid of ones is the length of the line in the cube.
    #[test]
    fn the_grid_ends_at_its_cube() {
        let (mut through, mut past) = (0, 0);
        for placement in [Placement::Centers, Placement::Nodes] {
            let mut grid = grid(1, GridFilter::Trilinear, placement);
            grid.fill(1.0);
            for line in lines() {
                // The pieces are so short that the ends do not matter.
                const STEPS: usize = 20_000;
                let place = |i: usize| line.position((i as f64 + 0.5) / STEPS as f64);
                let inside = (0..STEPS)
                    .filter(|i| grid.within(place(*i))[0] > 0.0)
                    .count();
                let length = line.arc_length(1.0) * inside as f64 / STEPS as f64;
                let found = Section::new(&grid, 1.0, &line).integral(1.0)[0];
                assert!(
                    (found - length).abs() < 3e-4 * line.arc_length(1.0),
                    "{found} {length}"
                );
                let outside = inside < STEPS;
                through += u32::from(inside > 0 && outside);
                past += u32::from(inside == 0);
            }
        }
        assert!(through > 100 && past > 50, "{through} {past}");
    }

    /// Tests that bent arcs are cut at the cube.
    #[test]
    fn bent_arcs_are_cut_at_the_cube() {
        let mut grid = grid(1, GridFilter::Trilinear, Placement::Centers);
        grid.fill(1.0);
        let mut next = numbers();
        let mut point = move || DVec3::new(next(), next(), next()) * 2.0 - 0.9;
        let mut several = 0;
        for _ in 0..300 {
            let x = point();
            let (v, a) = ((0.5 * point() - x) * 6.0, point() * 8.0 + 4.0 * x);
            let arc = Arc::hermite([x, v, a], [x + v + 0.5 * a, v + a, a], 1.0);
            let parts = grid.bent_parts(&arc, 0.9);
            several += u32::from(parts.len() > 1);
            const STEPS: usize = 4000;
            for i in 0..STEPS {
                let theta = 0.9 * (i as f64 + 0.5) / STEPS as f64;
                let inside = grid.within(arc.position(theta))[0] > 0.0;
                let known = parts.iter().any(|[a, b]| *a <= theta && theta <= *b);
                assert!(inside == known, "{theta} {parts:?}");
            }
        }
        assert!(several > 0, "{several}");
    }

    #[test]
    fn the_integral_up_to_where_it_reaches_a_target_is_the_target() {
        let mut found = 0;
        for grid in every_grid() {
            for line in lines() {
                let mut section = Section::new(&grid, 2.0, &line);
                let (theta, up_to) = section.reach(1.0, 0, 0.15);
                let whole = section.integral(1.0);
                assert_eq!(theta.is_some(), whole[0] >= 0.15);
                let Some(theta) = theta else {
                    assert_eq!(up_to, whole);
                    continue;
                };
                found += 1;
                let again = section.integral(theta);
                assert!((up_to[0] - 0.15).abs() < 1e-13, "{up_to:?}");
                assert!((up_to - again).map(f64::abs).max() < 1e-13);
                section.tabulate(0.9);
                let known = section.integral(theta);
                assert!((up_to - known).map(f64::abs).max() < 1e-13);
            }
        }
        assert!(found > 400, "{found}");
    }
}
