//! Spatial derivatives of the values of a grid.

use super::grid::{GridFilter, VolumeGrid};
use crate::Spectrum;
use glam::DVec3;

impl VolumeGrid {
    /// Returns true if values are continuous within the cube: always, except with the
    /// nearest-sample filter.
    pub fn is_continuous(&self) -> bool {
        self.filter() == GridFilter::Trilinear
    }

    /// Returns true if the outermost samples are all zero, so that values do not jump where the
    /// cube ends.
    pub fn is_dark_around(&self) -> bool {
        let [x, y, z] = self.size();
        let places = (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])));
        let is_outer = |place: &[usize; 3]| {
            (0..3).any(|axis| [0, self.size()[axis] - 1].contains(&place[axis]))
        };
        places
            .filter(is_outer)
            .all(|place| self.sample_at(place).is_zero())
    }

    /// Returns the gradient of Σ weight × [value](VolumeGrid::at) over the channels, at a world
    /// position of a continuous grid. It is exact within cells.
    pub fn gradient(&self, x: DVec3, weights: Spectrum) -> DVec3 {
        let place = self.to_samples.transform_point3(x);
        let last = DVec3::from_array(self.size().map(|n| (n - 1) as f64));
        let inside = place.clamp(DVec3::ZERO, last);
        let t = inside - inside.floor();
        let corners = self.corners::<{ Spectrum::CHANNELS }>(inside.as_ivec3().to_array());
        // A single channel stands for all spectral channels.
        let all = self.channels() == 1;
        let of = |samples: &[f64; Spectrum::CHANNELS]| {
            let samples = if all {
                [samples[0]; Spectrum::CHANNELS]
            } else {
                *samples
            };
            (Spectrum(samples) * weights).sum()
        };
        let values = corners.each_ref().map(of);
        let along = |axis: usize| {
            if place[axis] != inside[axis] {
                return 0.0;
            }
            let share = |i: usize, of: usize| match (of == axis, i >> of & 1) {
                (true, 0) => -1.0,
                (true, _) => 1.0,
                (false, 0) => 1.0 - t[of],
                (false, _) => t[of],
            };
            let each = values.iter().enumerate();
            each.map(|(i, value)| value * share(i, 0) * share(i, 1) * share(i, 2))
                .sum()
        };
        let slopes = DVec3::new(along(0), along(1), along(2));
        self.to_samples.matrix3.transpose() * slopes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::GridSamples;
    use eikonal::field::Placement;
    use glam::DAffine3;

    /// Creates a rotated box of samples.
    fn grid(channels: usize, outer: f32) -> VolumeGrid {
        let size = [4, 3, 5];
        let count = 60 * channels;
        let inner = |i: usize| {
            let voxel = i / channels;
            let place = [voxel % 4, voxel / 4 % 3, voxel / 12];
            (0..3).all(|axis| place[axis] > 0 && place[axis] < size[axis] - 1)
        };
        let value = |i: usize| {
            if inner(i) {
                1.0 + (i * 7 % 11) as f32
            } else {
                outer * (1.0 + (i * 5 % 7) as f32)
            }
        };
        let to_world =
            DAffine3::from_rotation_z(0.4) * DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.5));
        let samples = GridSamples {
            size,
            channels,
            data: (0..count).map(value).collect(),
        };
        VolumeGrid::new(
            samples,
            to_world,
            Placement::Centers,
            GridFilter::Trilinear,
            [0.0, 100.0],
        )
        .unwrap()
    }

    #[test]
    fn gradients_are_differences() {
        for channels in [1, 3] {
            let grid = grid(channels, 1.0);
            let weights = Spectrum([0.5, -1.0, 2.0, 0.0]);
            for i in 0..200 {
                let u = [0.013_167_9, 0.171_317_3, 0.711_719_7]
                    .map(|step| 1.2 * (0.37 + step * f64::from(i)).fract() - 0.1);
                let x = grid.to_world().transform_point3(u.into());
                let found = grid.gradient(x, weights);
                for axis in 0..3 {
                    let h = DVec3::AXES[axis] * 1e-6;
                    let at = |x| (grid.at(x) * weights).sum();
                    let exact = (at(x + h) - at(x - h)) / 2e-6;
                    assert!(
                        (found[axis] - exact).abs() < 1e-7,
                        "{channels} {i} {axis}: {} {exact}",
                        found[axis]
                    );
                }
            }
        }
    }

    #[test]
    fn grids_are_dark_around_if_their_outermost_samples_are_zero() {
        assert!(grid(2, 0.0).is_dark_around());
        assert!(!grid(2, 1.0).is_dark_around());
    }
}
