//! Samples on a regular grid.

use crate::Spectrum;
use eikonal::Aabb;
use eikonal::field::Placement;
use eikonal::ray::Arc;
use eikonal::ray::bernstein::first_root;
use glam::{DAffine3, DVec3};
use smallvec::{SmallVec, smallvec};
use std::sync::Arc as Shared;

use super::error::GridError;
use super::labels::LabelGrid;
use super::lattice::to_samples;

/// Interpolation between samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridFilter {
    /// Linear in each coordinate.
    Trilinear,
    /// Value of the nearest sample.
    Nearest,
}

/// Indices of a cell along each axis.
pub(super) type Cell = [i32; 3];

/// Distance outside the unit cube up to which a point counts as inside; larger than rounding
/// errors.
const EDGE_TOLERANCE: f64 = 1e-9;

/// Length in θ up to which a part of an arc is ignored.
const MIN_PART_LENGTH: f64 = 1e-12;

/// Samples in f32, x fastest, on the unit cube under an affine transform. Outside the cube,
/// [`VolumeGrid::at`] continues the values at the edge, and [`VolumeGrid::within`] returns zero.
#[derive(Clone, Debug)]
pub struct VolumeGrid {
    size: [usize; 3],
    channels: usize,
    values: Values,
    /// Map from world positions to sample indices.
    pub(super) to_samples: DAffine3,
    /// Map from world positions to the unit cube.
    to_unit: DAffine3,
    voxel: f64,
    range: (f64, f64),
    filter: GridFilter,
    placement: Placement,
}

/// Samples of a grid, x fastest, channels interleaved.
#[derive(Clone, Debug)]
enum Values {
    /// A value per sample and channel.
    Each(Vec<f32>),
    /// A value per label and channel; each voxel has a label.
    ByLabel {
        labels: Shared<LabelGrid>,
        values: Vec<f64>,
    },
}

impl Values {
    /// Returns the sample of a channel, given `channels` values per voxel.
    #[inline]
    fn sample(&self, voxel: usize, channels: usize, channel: usize) -> f64 {
        match self {
            Values::Each(data) => f64::from(data[channels * voxel + channel]),
            Values::ByLabel { labels, values } => {
                values[channels * usize::from(labels.labels()[voxel]) + channel]
            }
        }
    }
}

/// Samples on a grid, x fastest, channels interleaved.
#[derive(Clone, Debug)]
pub struct GridSamples {
    /// Number of samples along each axis.
    pub size: [usize; 3],
    /// Number of channels, 1 to 4.
    pub channels: usize,
    /// Values of the samples.
    pub data: Vec<f32>,
}

impl VolumeGrid {
    /// Creates a grid from samples; `to_world` maps the unit cube to the world. Samples at cell
    /// centres repeat the edge in the outer half voxels, as in Mitsuba 3. All samples must lie
    /// between the two `allowed` values.
    ///
    /// # Errors
    /// Fails if there are no samples, no channels or too many, or if the number of values does not
    /// match. Fails if a value lies outside the allowed range, or if the map cannot be inverted.
    pub fn new(
        samples: GridSamples,
        to_world: DAffine3,
        placement: Placement,
        filter: GridFilter,
        allowed: [f64; 2],
    ) -> Result<Self, GridError> {
        let GridSamples {
            size,
            channels,
            data,
        } = samples;
        if size.contains(&0) {
            return Err(GridError::Empty(size[0], size[1], size[2]));
        }
        if channels == 0 || channels > Spectrum::CHANNELS {
            return Err(GridError::Channels(channels));
        }
        let expected = size.iter().product::<usize>() * channels;
        if expected != data.len() {
            return Err(GridError::Length {
                expected,
                found: data.len(),
            });
        }
        let det = to_world.matrix3.determinant();
        if !(det.is_finite() && det != 0.0) {
            return Err(GridError::Singular);
        }
        check_values(size, channels, &data, allowed)?;
        let range = data
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| {
                (a.min(v as f64), b.max(v as f64))
            });
        Ok(VolumeGrid {
            size,
            channels,
            values: Values::Each(data),
            to_samples: to_samples(size, placement) * to_world.inverse(),
            to_unit: to_world.inverse(),
            voxel: voxel(size, to_world),
            range,
            filter,
            placement,
        })
    }

    /// Creates a grid in which each voxel has the value of its label, `values[label]`. Labels
    /// beyond the end of `values` have the last value. Values of labels that no voxel has are
    /// ignored. The first `channels` channels, 1 to 4, are kept.
    ///
    /// # Errors
    /// Fails if there are no values, or if `channels` is not between 1 and 4.
    pub fn by_label(
        labels: Shared<LabelGrid>,
        values: &[Spectrum],
        channels: usize,
    ) -> Result<Self, GridError> {
        if channels == 0 || channels > Spectrum::CHANNELS || values.is_empty() {
            return Err(GridError::Channels(channels));
        }
        let (size, to_world) = (labels.size(), labels.to_world());
        let last = values[values.len() - 1];
        let of = |label: usize| values.get(label).copied().unwrap_or(last);
        let table =
            (0..=usize::from(u8::MAX)).flat_map(|label| of(label).0.into_iter().take(channels));
        let table: Vec<f64> = table.collect();
        let mut used = [false; 256];
        for label in labels.labels() {
            used[usize::from(*label)] = true;
        }
        let used = (0..256).filter(|label| used[*label]);
        let values = || {
            used.clone()
                .flat_map(|label| &table[channels * label..channels * (label + 1)])
        };
        let range = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| {
            (a.min(v), b.max(v))
        });
        Ok(VolumeGrid {
            size,
            channels,
            to_samples: to_samples(size, Placement::Centers) * to_world.inverse(),
            to_unit: to_world.inverse(),
            voxel: voxel(size, to_world),
            range,
            filter: GridFilter::Nearest,
            placement: Placement::Centers,
            values: Values::ByLabel {
                labels,
                values: table,
            },
        })
    }

    /// Replaces all samples by `value`.
    #[cfg(test)]
    pub(super) fn fill(&mut self, value: f32) {
        let count = self.size.iter().product::<usize>() * self.channels;
        self.values = Values::Each(vec![value; count]);
    }

    /// Returns the map from the unit cube to the world.
    pub fn to_world(&self) -> DAffine3 {
        self.to_unit.inverse()
    }

    /// Returns a box around the grid.
    pub fn aabb(&self) -> Aabb {
        let unit = Aabb::new(DVec3::ZERO, DVec3::ONE).corners();
        Aabb::around(unit.map(|p| self.to_world().transform_point3(p)))
    }

    /// Returns the number of samples along each axis.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the interpolation between samples.
    pub fn filter(&self) -> GridFilter {
        self.filter
    }

    /// Returns the position of the samples relative to the cells.
    pub(super) fn placement(&self) -> Placement {
        self.placement
    }

    /// Returns the positions of the samples in the world.
    pub(crate) fn sample_positions(&self) -> impl Iterator<Item = DVec3> {
        let to_world = self.to_samples.inverse();
        let [across, along, up] = self.size;
        (0..across * along * up).map(move |voxel| {
            let place = [
                voxel % across,
                voxel / across % along,
                voxel / (across * along),
            ];
            to_world.transform_point3(DVec3::from_array(place.map(|i| i as f64)))
        })
    }

    /// Returns the sample with indices `i`, `j`, `k` along x, y, z. A single channel stands for all
    /// spectral channels.
    pub fn sample_at(&self, [i, j, k]: [usize; 3]) -> Spectrum {
        let voxel = i + self.size[0] * (j + self.size[1] * k);
        match self.channels {
            1 => Spectrum::splat(self.values.sample(voxel, 1, 0)),
            _ => Spectrum(self.sample(voxel)),
        }
    }

    /// Returns the shortest side of a voxel, in world units.
    pub fn voxel(&self) -> f64 {
        self.voxel
    }

    /// Returns the smallest and largest sample.
    pub fn range(&self) -> (f64, f64) {
        self.range
    }

    /// Returns the smallest and largest sample in the first `used` channels.
    pub fn extremes(&self, used: usize) -> [f64; 2] {
        if self.channels <= used {
            return [self.range.0, self.range.1];
        }
        let mut found = [f64::INFINITY, f64::NEG_INFINITY];
        let voxels = self.size.iter().product();
        for (voxel, channel) in (0..voxels).flat_map(|v| (0..used).map(move |c| (v, c))) {
            let value = self.values.sample(voxel, self.channels, channel);
            found = [found[0].min(value), found[1].max(value)];
        }
        found
    }

    /// Returns the memory of the samples in bytes.
    pub fn memory(&self) -> usize {
        match &self.values {
            Values::Each(data) => data.len() * size_of::<f32>(),
            Values::ByLabel { labels, values } => labels.memory() + values.len() * size_of::<f64>(),
        }
    }

    /// Returns the number of channels of the samples.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Returns the value at a world position. A single channel stands for all spectral channels.
    pub fn at(&self, x: DVec3) -> Spectrum {
        let place = self.to_samples.transform_point3(x).to_array();
        let cells = std::array::from_fn(|axis| self.cell(axis, place[axis]));
        match self.channels {
            1 => Spectrum::splat(self.value(&cells, 0)),
            n => Spectrum(std::array::from_fn(|c| {
                if c < n { self.value(&cells, c) } else { 0.0 }
            })),
        }
    }

    /// Calls `see` with each voxel that contributes to the value at a world position, and its
    /// weight. [`VolumeGrid::at`] is the sum of weights times samples. The weights add up to 1,
    /// also outside the cube.
    pub fn weights(&self, x: DVec3, mut see: impl FnMut(usize, f64)) {
        let place = self.to_samples.transform_point3(x).to_array();
        let cells: [(usize, usize, f64); 3] =
            std::array::from_fn(|axis| self.cell(axis, place[axis]));
        let shares = cells.map(|(a, b, t)| match self.filter {
            GridFilter::Nearest if t < 0.5 => [(a, 1.0), (b, 0.0)],
            GridFilter::Nearest => [(a, 0.0), (b, 1.0)],
            GridFilter::Trilinear => [(a, 1.0 - t), (b, t)],
        });
        for (z, wz) in shares[2] {
            for (y, wy) in shares[1] {
                for (x, wx) in shares[0] {
                    let weight = wx * wy * wz;
                    if weight > 0.0 {
                        see(x + self.size[0] * (y + self.size[1] * z), weight);
                    }
                }
            }
        }
    }

    /// Returns true if a world position is in the cube.
    pub fn contains(&self, x: DVec3) -> bool {
        let place = self.to_unit.transform_point3(x);
        place.min_element() >= -EDGE_TOLERANCE && place.max_element() <= 1.0 + EDGE_TOLERANCE
    }

    /// Returns the value at a world position in the cube, and zero outside.
    pub fn within(&self, x: DVec3) -> Spectrum {
        if self.contains(x) {
            self.at(x)
        } else {
            Spectrum::ZERO
        }
    }

    /// Returns the range of θ in [0, 1] over which a straight arc is in the cube; empty if it
    /// misses the cube.
    pub(super) fn straight_part(&self, arc: &Arc) -> [f64; 2] {
        let start = self.to_unit.transform_point3(arc.start());
        let step = self.to_unit.transform_point3(arc.end()) - start;
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            let planes = [0.0, 1.0].map(|plane| (plane - start[axis]) / step[axis]);
            if step[axis] != 0.0 {
                from = from.max(planes[0].min(planes[1]));
                to = to.min(planes[0].max(planes[1]));
            } else if !(0.0..=1.0).contains(&start[axis]) {
                return [0.0; 2];
            }
        }
        if from < to { [from, to] } else { [0.0; 2] }
    }

    /// Returns the ranges of θ up to `theta_end` over which a bent arc is in the cube.
    pub(crate) fn bent_parts(&self, arc: &Arc, theta_end: f64) -> SmallVec<[[f64; 2]; 1]> {
        // Find the intersections with the planes of the cube.
        let control = arc.control().map(|p| self.to_unit.transform_point3(p));
        let mut places: SmallVec<[f64; 8]> = smallvec![0.0, theta_end];
        for axis in 0..3 {
            for plane in [0.0, 1.0] {
                let height = control.map(|p| p[axis] - plane);
                let mut from = 0.0;
                while let Some(root) = first_root(&height, from, theta_end, [1e-14; 2]) {
                    places.push(root);
                    from = root;
                }
            }
        }
        // Join the intervals whose middles are inside.
        places.sort_by(f64::total_cmp);
        let mut parts: SmallVec<[[f64; 2]; 1]> = SmallVec::new();
        for pair in places.windows(2) {
            let middle = self
                .to_unit
                .transform_point3(arc.position(0.5 * (pair[0] + pair[1])));
            let inside = middle.min_element() >= 0.0 && middle.max_element() <= 1.0;
            if !inside || pair[1] - pair[0] <= MIN_PART_LENGTH {
                continue;
            }
            match parts.last_mut() {
                Some(last) if last[1] == pair[0] => last[1] = pair[1],
                _ => parts.push([pair[0], pair[1]]),
            }
        }
        parts
    }

    /// Converts a world position to units of cells. Cells of trilinear grids lie between samples;
    /// other cells lie around a sample.
    pub(super) fn in_cells(&self, x: DVec3) -> DVec3 {
        let place = self.to_samples.transform_point3(x);
        match self.filter {
            GridFilter::Trilinear => place,
            GridFilter::Nearest => place + 0.5,
        }
    }

    /// Returns the first and last plane between cells across each axis. The outermost cells are
    /// unbounded.
    pub(super) fn planes(&self) -> [[i32; 2]; 3] {
        let first = match self.filter {
            GridFilter::Trilinear => 0,
            GridFilter::Nearest => 1,
        };
        self.size.map(|n| [first, n as i32 - 1])
    }

    /// Returns true if values are constant in each cell.
    pub(super) fn is_flat(&self) -> bool {
        self.filter == GridFilter::Nearest
    }

    /// Returns the value in a cell of a flat grid.
    #[inline]
    pub(super) fn flat<const N: usize>(&self, cell: Cell) -> [f64; N] {
        let [x, y, z]: [usize; 3] = std::array::from_fn(|axis| {
            let last = self.size[axis] as i32 - 1;
            cell[axis].clamp(0, last) as usize
        });
        self.sample(x + self.size[0] * (y + self.size[1] * z))
    }

    /// Returns the samples at the corners of a cell, x fastest. Between them, values are trilinear.
    #[inline]
    pub(super) fn corners<const N: usize>(&self, cell: Cell) -> [[f64; N]; 8] {
        self.corner_voxels(cell).map(|voxel| self.sample(voxel))
    }

    /// Returns the voxels at the corners of a cell, x fastest. In a flat grid, all are equal.
    #[inline]
    pub(super) fn corner_voxels(&self, cell: Cell) -> [usize; 8] {
        let stride = match self.filter {
            GridFilter::Trilinear => 1,
            GridFilter::Nearest => 0,
        };
        let ends: [[usize; 2]; 3] = std::array::from_fn(|axis| {
            let last = self.size[axis] as i32 - 1;
            [cell[axis], cell[axis] + stride].map(|i| i.clamp(0, last) as usize)
        });
        let [xs, ys, zs] = ends;
        std::array::from_fn(|i| {
            let (x, y, z) = (xs[i & 1], ys[i >> 1 & 1], zs[i >> 2]);
            x + self.size[0] * (y + self.size[1] * z)
        })
    }

    /// Returns the sample of a voxel, with zero in missing channels.
    #[inline]
    fn sample<const N: usize>(&self, voxel: usize) -> [f64; N] {
        std::array::from_fn(|c| {
            if c < self.channels {
                self.values.sample(voxel, self.channels, c)
            } else {
                0.0
            }
        })
    }

    /// Returns the value of a channel between the samples of a cell along each axis.
    #[inline]
    fn value(&self, [x, y, z]: &[(usize, usize, f64); 3], channel: usize) -> f64 {
        let sample = |i: usize, j: usize, k: usize| {
            let voxel = i + self.size[0] * (j + self.size[1] * k);
            self.values.sample(voxel, self.channels, channel)
        };
        match self.filter {
            GridFilter::Nearest => {
                let near = |&(a, b, t): &(usize, usize, f64)| if t < 0.5 { a } else { b };
                sample(near(x), near(y), near(z))
            }
            GridFilter::Trilinear => {
                let lerp = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
                let row = |j, k| lerp(sample(x.0, j, k), sample(x.1, j, k), x.2);
                let plane = |k| lerp(row(y.0, k), row(y.1, k), y.2);
                lerp(plane(z.0), plane(z.1), z.2)
            }
        }
    }

    /// Returns the two samples around a place along an axis, and the position between them.
    #[inline]
    fn cell(&self, axis: usize, place: f64) -> (usize, usize, f64) {
        let last = self.size[axis] - 1;
        let place = place.clamp(0.0, last as f64);
        let i = place as usize;
        (i, (i + 1).min(last), place - i as f64)
    }
}

/// Returns the shortest side of a voxel of the unit cube in the world.
fn voxel(size: [usize; 3], to_world: DAffine3) -> f64 {
    let side = |axis: usize| to_world.matrix3.col(axis).length() / size[axis] as f64;
    side(0).min(side(1)).min(side(2))
}

fn check_values(
    size: [usize; 3],
    channels: usize,
    data: &[f32],
    [low, high]: [f64; 2],
) -> Result<(), GridError> {
    let bad = |v: &f32| !((*v as f64) >= low && (*v as f64) <= high && v.is_finite());
    match data.iter().position(bad) {
        None => Ok(()),
        Some(i) => {
            let voxel = i / channels;
            Err(GridError::Value {
                x: voxel % size[0],
                y: voxel / size[0] % size[1],
                z: voxel / size[0] / size[1],
                value: data[i],
                low,
                high,
            })
        }
    }
}
