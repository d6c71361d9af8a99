//! Samples on a regular grid.

use crate::Spectrum;
use glam::{DAffine3, DVec3};

/// Where on the unit cube the samples of a grid sit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// Sample i of N at (i + ½)/N; the outer half voxels repeat the edge (as in Mitsuba 3).
    Centers,
    /// Sample i of N at i/(N − 1): the outermost samples lie on the bounds.
    Nodes,
}

/// How values between samples are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Linear in each coordinate.
    Trilinear,
    /// That of the nearest sample.
    Nearest,
}

/// Why samples do not make a grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A side has no samples.
    #[error("the grid has no samples: its size is {0} × {1} × {2}")]
    Empty(usize, usize, usize),
    /// The number of values does not match the size.
    #[error("expected {expected} values for the grid's size, found {found}")]
    Length {
        /// Product of size and channels.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// Neither one channel nor one per spectral channel.
    #[error("a grid has one channel, or one per spectral channel (at most {max}); found {0}", max = Spectrum::LANES)]
    Channels(usize),
    /// The transform cannot be inverted.
    #[error("the grid's transform is singular: a scale of zero?")]
    Singular,
    /// A sample lies outside the range that makes sense.
    #[error(
        "the sample at voxel ({x}, {y}, {z}) is {value}; expected a finite number {}",
        range(*low, *high)
    )]
    Value {
        /// Voxel index along x.
        x: usize,
        /// Voxel index along y.
        y: usize,
        /// Voxel index along z.
        z: usize,
        /// The sample.
        value: f32,
        /// Least allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
    },
}

/// Samples in f32, x fastest, on the unit cube under an affine transform. Outside the cube the
/// values at its edge are continued.
#[derive(Clone, Debug)]
pub struct Grid {
    size: [usize; 3],
    channels: usize,
    /// Shared by copies of the grid.
    data: Vec<f32>,
    to_local: DAffine3,
    voxel: f64,
    range: (f64, f64),
    placement: Placement,
    filter: Filter,
}

impl Grid {
    /// A grid from samples with x fastest and channels interleaved; `to_world` maps the unit cube to
    /// its place. Samples must lie in `allowed`.
    pub fn new(
        (size, channels, data): ([usize; 3], usize, Vec<f32>),
        to_world: DAffine3,
        placement: Placement,
        filter: Filter,
        allowed: (f64, f64),
    ) -> Result<Self, GridError> {
        if size.contains(&0) {
            return Err(GridError::Empty(size[0], size[1], size[2]));
        }
        if channels == 0 || channels > Spectrum::LANES {
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
        let side = |axis: usize| to_world.matrix3.col(axis).length() / size[axis] as f64;
        Ok(Grid {
            size,
            channels,
            data,
            to_local: to_world.inverse(),
            voxel: side(0).min(side(1)).min(side(2)),
            range,
            placement,
            filter,
        })
    }

    /// Shortest side of a voxel, in world units.
    pub fn voxel(&self) -> f64 {
        self.voxel
    }

    /// Smallest and largest sample.
    pub fn range(&self) -> (f64, f64) {
        self.range
    }

    /// Bytes held by the samples.
    pub fn memory(&self) -> usize {
        self.data.len() * size_of::<f32>()
    }

    /// The value at a world position; one channel serves all spectral channels.
    pub fn at(&self, x: DVec3) -> Spectrum {
        let local = self.to_local.transform_point3(x).to_array();
        let [(i0, i1, u), (j0, j1, v), (k0, k1, w)] =
            std::array::from_fn(|axis| self.cell(axis, local[axis]));
        match self.filter {
            Filter::Nearest => {
                let near = |(a, b, t): (usize, usize, f64)| if t < 0.5 { a } else { b };
                self.sample(near((i0, i1, u)), near((j0, j1, v)), near((k0, k1, w)))
            }
            Filter::Trilinear => {
                let lerp = |a: Spectrum, b: Spectrum, t: f64| a * (1.0 - t) + b * t;
                let row = |j, k| lerp(self.sample(i0, j, k), self.sample(i1, j, k), u);
                let plane = |k| lerp(row(j0, k), row(j1, k), v);
                lerp(plane(k0), plane(k1), w)
            }
        }
    }

    /// The two samples around a coordinate of the unit cube and the position between them.
    fn cell(&self, axis: usize, t: f64) -> (usize, usize, f64) {
        let last = (self.size[axis] - 1) as f64;
        let position = match self.placement {
            Placement::Centers => t * self.size[axis] as f64 - 0.5,
            Placement::Nodes => t * last,
        };
        let position = position.clamp(0.0, last);
        let i = position as usize;
        (i, (i + 1).min(self.size[axis] - 1), position - i as f64)
    }

    fn sample(&self, i: usize, j: usize, k: usize) -> Spectrum {
        let index = self.channels * (i + self.size[0] * (j + self.size[1] * k));
        match self.channels {
            1 => Spectrum::splat(self.data[index] as f64),
            n => Spectrum(std::array::from_fn(|c| {
                if c < n {
                    self.data[index + c] as f64
                } else {
                    0.0
                }
            })),
        }
    }
}

/// In words, for messages.
fn range(low: f64, high: f64) -> String {
    match high < f64::MAX {
        true => format!("in [{low}, {high}]"),
        false => format!("of at least {low}"),
    }
}

fn check_values(
    size: [usize; 3],
    channels: usize,
    data: &[f32],
    (low, high): (f64, f64),
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
