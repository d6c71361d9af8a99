//! Equirectangular image of radiance, with the interpolation of Mitsuba's `envmap`.
//!
//! A cell lies between two columns and two rows of pixels. In a cell, radiance is linear in
//! longitude and in colatitude θ. Sampling chooses a cell, then a direction in it with a density
//! that is linear in longitude and in cos θ.

use super::ImageError;
use crate::sampling::grid2::PickedCell;
use crate::sampling::{BilinearCell, Grid2};
use crate::{Orientation, Spectrum};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Smallest number of rows: the poles and the equator.
const MIN_HEIGHT: usize = 3;

/// Radiance that is bilinear between the pixels of an image around the scene.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    width: usize,
    height: usize,
    pixels: Vec<Spectrum>,
    orientation: Orientation,
    /// Values of sin² and cos² of half the colatitude of each row of pixels.
    half_angles: Vec<(f64, f64)>,
    /// Distribution over cells, by their integrals summed over the channels.
    distribution: Grid2,
    /// Integral ∫ radiance over all directions, summed over the channels.
    total: f64,
}

/// Cell of the image, and a point in it.
struct Place {
    /// Column and row of the cell: the indices of the pixels at its left and upper corners.
    cell: [usize; 2],
    /// Longitude and colatitude relative to the corner, in cells.
    within: [f64; 2],
    /// Value of sin² of half the colatitude.
    half_sin2: f64,
}

impl EnvironmentMap {
    pub(super) fn new(
        width: usize,
        height: usize,
        mut pixels: Vec<Spectrum>,
        orientation: Orientation,
    ) -> Result<Self, ImageError> {
        if pixels.len() != width * height || pixels.is_empty() {
            return Err(ImageError::Size {
                width,
                height,
                found: pixels.len(),
            });
        }
        let bad = |p: &Spectrum| !(p.is_finite() && p.0.iter().all(|&v| v >= 0.0));
        if let Some(i) = pixels.iter().position(bad) {
            return Err(ImageError::Pixel {
                x: i % width,
                y: i / width,
            });
        }
        // Repeat the last row of low images.
        for _ in height..MIN_HEIGHT {
            pixels.extend_from_within(pixels.len() - width..);
        }
        let height = height.max(MIN_HEIGHT);
        // Integrate the radiance over each cell.
        let sums: Vec<f64> = pixels.iter().map(|p| p.sum()).collect();
        let mut weights = Vec::with_capacity(width * (height - 1));
        for row in 0..height - 1 {
            let [above, below] = row_integrals(row, height);
            let pair = |i: usize| sums[i] + sums[i - i % width + (i + 1) % width];
            let cells = (row * width..(row + 1) * width)
                .map(|i| 0.5 * (above * pair(i) + below * pair(i + width)));
            weights.extend(cells);
        }
        let half_angle = |row: usize| {
            let (sin, cos) = (0.5 * PI * row as f64 / (height - 1) as f64).sin_cos();
            (sin * sin, cos * cos)
        };
        let mut map = EnvironmentMap {
            distribution: Grid2::new(width, height - 1, &weights)?,
            half_angles: (0..height).map(half_angle).collect(),
            total: 0.0,
            width,
            height,
            pixels,
            orientation,
        };
        map.total = map.integral().sum();
        Ok(map)
    }

    /// Finds the cell of a direction. Sines and the arc tangent keep their digits near the poles,
    /// where the cosine loses them.
    fn locate(&self, toward: DVec3) -> Place {
        let d = self.orientation.to_local(toward);
        let sin = d.x.hypot(d.z);
        let half_sin2 = if d.y > 0.0 {
            0.5 * sin * sin / (1.0 + d.y)
        } else {
            0.5 * (1.0 - d.y)
        };
        let (width, rows) = (self.width as f64, (self.height - 1) as f64);
        let x = d.x.atan2(-d.z) / TAU * width - 0.5;
        let y = sin.atan2(d.y) / PI * rows;
        let row = (y as usize).min(self.height - 2);
        Place {
            cell: [
                (x.floor() as i64).rem_euclid(self.width as i64) as usize,
                row,
            ],
            within: [x - x.floor(), y - row as f64],
            half_sin2,
        }
    }

    /// Returns the pixels at the corners of a cell: above and below, left and right.
    fn corners(&self, [column, row]: [usize; 2]) -> [[Spectrum; 2]; 2] {
        let next = (column + 1) % self.width;
        [row, row + 1]
            .map(|row| [column, next].map(|column| self.pixels[row * self.width + column]))
    }

    /// Returns the density within a cell, over longitude and cos θ.
    fn within(&self, cell: [usize; 2]) -> BilinearCell {
        BilinearCell::new(self.corners(cell).map(|row| row.map(|p| p.sum())))
    }

    pub(super) fn radiance(&self, toward: DVec3) -> Spectrum {
        let place = self.locate(toward);
        let [x, y] = place.within;
        let [above, below] = self
            .corners(place.cell)
            .map(|[left, right]| left * (1.0 - x) + right * x);
        above * (1.0 - y) + below * y
    }

    /// Returns the derivative of Σ weight × radiance over the channels with respect to the unit
    /// direction, perpendicular to it. It is exact within cells.
    pub(super) fn gradient(&self, toward: DVec3, weights: Spectrum) -> DVec3 {
        let d = self.orientation.to_local(toward);
        let Place { cell, within, .. } = self.locate(toward);
        let [x, y] = within;
        let corners = self.corners(cell);
        let [[a, b], [c, e]] = corners.map(|row| row.map(|pixel| (pixel * weights).sum()));
        let by_column = (b - a) * (1.0 - y) + (e - c) * y;
        let by_row = (c - a) * (1.0 - x) + (e - b) * x;
        let sin2 = d.x * d.x + d.z * d.z;
        if sin2 == 0.0 {
            return DVec3::ZERO;
        }
        // Longitude is atan2(x, −z), colatitude is acos y.
        let east = DVec3::new(-d.z, 0.0, d.x) / sin2;
        let south = DVec3::new(d.x * d.y, -sin2, d.z * d.y) / sin2.sqrt();
        let (width, rows) = (self.width as f64, (self.height - 1) as f64);
        let local = east * (by_column * width / TAU) + south * (by_row * rows / PI);
        let length = local.length();
        if length > 0.0 {
            self.orientation.to_world(local / length) * length
        } else {
            DVec3::ZERO
        }
    }

    /// Returns the numbers of rows and columns.
    pub(super) fn shape(&self) -> [usize; 2] {
        [self.height, self.width]
    }

    /// Returns the radiances, row by row from the upper pole.
    pub(super) fn pixels(&self) -> &[Spectrum] {
        &self.pixels
    }

    /// Calls `see` with each pixel that contributes in a direction, and its weight.
    pub(super) fn weights(&self, toward: DVec3, mut see: impl FnMut(usize, f64)) {
        let Place {
            cell: [column, row],
            within: [x, y],
            ..
        } = self.locate(toward);
        let next = (column + 1) % self.width;
        for (row, by_row) in [(row, 1.0 - y), (row + 1, y)] {
            for (column, by_column) in [(column, 1.0 - x), (next, x)] {
                see(row * self.width + column, by_row * by_column);
            }
        }
    }

    /// Returns ∫ radiance over all directions, in closed form.
    pub(super) fn integral(&self) -> Spectrum {
        let sums: Vec<Spectrum> = self
            .pixels
            .chunks_exact(self.width)
            .map(|row| row.iter().fold(Spectrum::ZERO, |sum, p| sum + *p))
            .collect();
        let cells = sums.windows(2).enumerate().map(|(row, sums)| {
            let [above, below] = row_integrals(row, self.height);
            sums[0] * above + sums[1] * below
        });
        cells.fold(Spectrum::ZERO, |total, cell| total + cell) * (TAU / self.width as f64)
    }

    /// Returns ∫ radiance over all directions, summed over the channels. Times the density of a
    /// direction, it approximates the radiance from there, summed over the channels.
    pub(super) fn total(&self) -> f64 {
        self.total
    }

    pub(super) fn sample(&self, u: [f64; 2]) -> (DVec3, f64) {
        // Sample a cell, and a point in longitude and cos θ within it.
        let PickedCell { cell, within } = self.distribution.pick(u);
        let [x, z] = self.within(cell).sample(within);
        let [(sin2, cos2), (sin2_below, cos2_below)] =
            [cell[1], cell[1] + 1].map(|row| self.half_angles[row]);
        let half_sin2 = (1.0 - z) * sin2 + z * sin2_below;
        let half_cos2 = (1.0 - z) * cos2 + z * cos2_below;
        let sin = 2.0 * (half_sin2 * half_cos2).sqrt();
        // Convert the point to a direction.
        let longitude = (cell[0] as f64 + 0.5 + x) / self.width as f64 * TAU;
        let (east, south) = longitude.sin_cos();
        let local = DVec3::new(east * sin, half_cos2 - half_sin2, -south * sin);
        let pdf = self.density(cell, [x, z]);
        (self.orientation.to_world(local), pdf)
    }

    pub(super) fn pdf(&self, toward: DVec3) -> f64 {
        let place = self.locate(toward);
        let [above, below] = [place.cell[1], place.cell[1] + 1].map(|row| self.half_angles[row].0);
        let z = ((place.half_sin2 - above) / (below - above)).clamp(0.0, 1.0);
        self.density(place.cell, [place.within[0], z])
    }

    /// Returns the density per steradian at a point of a cell, given in longitude and cos θ.
    fn density(&self, cell: [usize; 2], within: [f64; 2]) -> f64 {
        let [above, below] = [cell[1], cell[1] + 1].map(|row| self.half_angles[row].0);
        let solid_angle = 2.0 * (below - above) * TAU / self.width as f64;
        self.distribution.probability(cell) * self.within(cell).pdf(within) / solid_angle
    }
}

/// Computes ∫ (1 − t) sin θ dθ and ∫ t sin θ dθ from a row of pixels to the next, where t is the
/// distance in rows.
fn row_integrals(row: usize, height: usize) -> [f64; 2] {
    let step = PI / (height - 1) as f64;
    let [(sin, cos), (sin_below, cos_below)] = [row, row + 1].map(|k| (step * k as f64).sin_cos());
    let slope = (sin_below - sin) / step;
    [cos - slope, slope - cos_below]
}
