//! Degrees of freedom of a medium's coefficient: one number, one for each label, or one for each
//! voxel.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use crate::Spectrum;
use crate::medium::Medium;
use crate::phase::Phase;
use crate::volume::{LabelGrid, Section, VolumeGrid, VolumeTexture};
use eikonal::ray::Arc;
use glam::DVec3;
use std::sync::Arc as Shared;

/// Numbers of a coefficient, with their weights at each position.
#[derive(Clone, Debug)]
pub(super) enum Chart {
    /// Uniform coefficient with a single number.
    One,
    /// Label volume with a number for each label.
    Labels {
        labels: Shared<LabelGrid>,
        /// Grid cells of the labels' voxels.
        cells: Shared<VolumeGrid>,
        count: usize,
    },
    /// Grid with a number for each voxel.
    Voxels(Shared<VolumeGrid>),
}

impl Chart {
    /// Returns the chart of a medium's extinction. Absorption and scattering have the same chart.
    pub(super) fn of_extinction(medium: &Medium) -> Self {
        Chart::of(medium, &medium.sigma_t)
    }

    /// Returns the chart of a coefficient with a number for each voxel of labels.
    pub(super) fn of_voxels(labels: &Shared<LabelGrid>) -> Self {
        Chart::Voxels(voxels_of(labels))
    }

    /// Returns the chart of a medium's albedo.
    pub(super) fn of_albedo(medium: &Medium) -> Self {
        Chart::of(medium, &medium.albedo)
    }

    /// Returns the chart of a medium's emission.
    pub(super) fn of_emission(medium: &Medium) -> Self {
        medium
            .emission
            .as_ref()
            .map_or(Chart::One, |emission| Chart::of(medium, emission))
    }

    /// Returns the chart of a medium's mean cosine.
    pub(super) fn of_mean_cosine(medium: &Medium) -> Self {
        match &medium.phase {
            Phase::HenyeyGreensteinGrid(grid) => Chart::Voxels(grid.clone()),
            _ => Chart::of(medium, &VolumeTexture::Uniform(Spectrum::ZERO)),
        }
    }

    fn of(medium: &Medium, values: &VolumeTexture) -> Self {
        if let Some(labels) = &medium.labels {
            let count = labels.list().len();
            let labels = labels.grid().clone();
            return Chart::Labels {
                cells: voxels_of(&labels),
                labels,
                count,
            };
        }
        match values {
            VolumeTexture::Uniform(_) => Chart::One,
            VolumeTexture::Grid(grid) => Chart::Voxels(grid.clone()),
        }
    }

    /// Returns the length along each axis: no axis, labels, or z, y, x.
    pub(super) fn shape(&self) -> Vec<usize> {
        match self {
            Chart::One => Vec::new(),
            Chart::Labels { count, .. } => vec![*count],
            Chart::Voxels(grid) => {
                let [x, y, z] = grid.size();
                vec![z, y, x]
            }
        }
    }

    /// Calls `see` with each number that has a weight at a position, and its weight. Positions
    /// outside a grid's box use its outermost numbers.
    pub(super) fn at(&self, x: DVec3, mut see: impl FnMut(usize, f64)) {
        match self {
            Chart::One => see(0, 1.0),
            Chart::Labels {
                labels,
                cells,
                count,
            } => cells.weights(x, |voxel, weight| {
                see(label(labels, voxel, *count), weight);
            }),
            Chart::Voxels(grid) => grid.weights(x, see),
        }
    }

    /// Calls `see` with each number that has a weight along an arc up to θ, and the integral of its
    /// weight over length. A number may occur several times.
    pub(super) fn along(&self, arc: &Arc, theta: f64, mut see: impl FnMut(usize, f64)) {
        match self {
            // Planted error "derivatives along lengths with an absolute error", found by morgana-io/io::units::derivatives_in_any_unit:
            // Chart::One => see(0, arc.arc_length(theta) + 1e-9),
            Chart::One => see(0, arc.arc_length(theta)),
            Chart::Labels {
                labels,
                cells,
                count,
            } => along(cells, arc, theta, |voxel, length| {
                see(label(labels, voxel, *count), length);
            }),
            Chart::Voxels(grid) => along(grid, arc, theta, see),
        }
    }
}

/// Returns the grid cells of the voxels of labels.
fn voxels_of(labels: &Shared<LabelGrid>) -> Shared<VolumeGrid> {
    let cells = VolumeGrid::by_label(labels.clone(), &[Spectrum::ONE], 1);
    Shared::new(cells.expect("one channel of ones"))
}

/// Returns the number of the label of a voxel.
fn label(labels: &LabelGrid, voxel: usize, count: usize) -> usize {
    usize::from(labels.labels()[voxel]).min(count - 1)
}

/// Visits the voxels along an arc with the integrals of their weights over length. The integrals
/// are exact along straight arcs. Bent arcs are cut into chords of less than half a voxel. Their
/// distance from the arc is less than a sixteenth of a voxel times the angle of the bend.
fn along(grid: &VolumeGrid, arc: &Arc, theta: f64, mut see: impl FnMut(usize, f64)) {
    if arc.is_straight() {
        return Section::new(grid, 1.0, arc).weights(theta, see);
    }
    let pieces = (2.0 * arc.arc_length(theta) / grid.voxel()).ceil().max(1.0);
    let (mut x, mut length) = (arc.start(), 0.0);
    for i in 1..=pieces as usize {
        let at = theta * i as f64 / pieces;
        let (next, until) = (arc.position(at), arc.arc_length(at));
        let chord = Arc::line(x, next - x, 1.0);
        let segment = (until - length) / chord.arc_length(1.0);
        Section::new(grid, 1.0, &chord).weights(1.0, |voxel, part| see(voxel, part * segment));
        (x, length) = (next, until);
    }
}

/// Returns the smallest value of a texture in the first `channels` channels.
pub(super) fn least(values: &VolumeTexture, channels: usize) -> f64 {
    match values {
        VolumeTexture::Uniform(value) => value.0[..channels]
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min),
        VolumeTexture::Grid(grid) => grid.extremes(channels)[0],
    }
}

/// Returns the largest value of a texture in the first `channels` channels.
pub(super) fn largest(values: &VolumeTexture, channels: usize) -> f64 {
    match values {
        VolumeTexture::Uniform(value) => value.0[..channels].iter().copied().fold(0.0, f64::max),
        VolumeTexture::Grid(grid) => grid.extremes(channels)[1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{GridFilter, GridSamples};
    use eikonal::field::Placement;
    use glam::DAffine3;

    fn grid(filter: GridFilter) -> Shared<VolumeGrid> {
        let samples = GridSamples {
            size: [5, 4, 3],
            channels: 1,
            data: (0..60).map(|i| (i * 37 % 11) as f32).collect(),
        };
        let to_world = DAffine3::from_scale(DVec3::new(1.0, 0.8, 0.6));
        Shared::new(
            VolumeGrid::new(samples, to_world, Placement::Centers, filter, [0.0, 11.0]).unwrap(),
        )
    }

    fn bend() -> Arc {
        let [x, v, a] = [[0.1, 0.1, 0.1], [0.9, 0.3, 0.1], [-0.5, 0.4, 0.3]].map(DVec3::from);
        Arc::hermite([x, v, a], [x + v + 0.5 * a, v + a, a], 1.0)
    }

    /// Compares with the integral of the samples' values along a bent arc, by the midpoint rule.
    /// They agree up to the error of the chords.
    #[test]
    fn lengths_along_bent_arcs_add_up_to_the_integral() {
        for filter in [GridFilter::Trilinear, GridFilter::Nearest] {
            let (grid, arc) = (grid(filter), bend());
            let sample = |i: usize| grid.sample_at([i % 5, i / 5 % 4, i / 20])[0];
            let (mut found, mut length) = (0.0, 0.0);
            Chart::Voxels(grid.clone()).along(&arc, 0.8, |voxel, part| {
                found += sample(voxel) * part;
                length += part;
            });
            const STEPS: usize = 100_000;
            let value = |i: usize| {
                let theta = 0.8 * (i as f64 + 0.5) / STEPS as f64;
                grid.within(arc.position(theta))[0] * arc.velocity(theta).length()
            };
            let exact = (0..STEPS).map(value).sum::<f64>() * 0.8 / STEPS as f64;
            assert!((length - arc.arc_length(0.8)).abs() < 1e-9, "{length}");
            assert!((found - exact).abs() < 2e-3 * exact, "{found} {exact}");
        }
    }
}
