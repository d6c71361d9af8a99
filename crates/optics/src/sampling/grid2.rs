//! 2-D density on the unit square that is constant on each cell of a regular grid.

use super::cdf::Cdf;
use super::{DistributionError, check_values};

/// Density proportional to the values of the cells of an image. An example is the luminance of an
/// environment map times the solid angle of its pixels. Coordinate x runs along a row, y over the
/// rows.
#[derive(Clone, Debug)]
pub struct Grid2 {
    rows: Cdf,
    /// Distribution along each row; `None` for rows of zeros, which are never sampled.
    columns: Vec<Option<Cdf>>,
    width: usize,
}

impl Grid2 {
    /// Creates the density from `height` rows of `width` cells, finite, ≥ 0 and not all zero.
    ///
    /// # Errors
    /// Fails if there are no cells, or if the number of values does not match. Fails if a value is
    /// negative or not finite, or if the values are all zero or too large to be added.
    pub fn new(width: usize, height: usize, values: &[f64]) -> Result<Self, DistributionError> {
        if width == 0 || height == 0 {
            return Err(DistributionError::Empty);
        }
        if width.checked_mul(height) != Some(values.len()) {
            let expected = width.saturating_mul(height);
            return Err(DistributionError::Length {
                expected,
                got: values.len(),
            });
        }
        check_values(values)?;
        let sums = values
            .chunks_exact(width)
            .map(|row| row.iter().sum::<f64>());
        let rows = Cdf::new(sums)?;
        let columns = values
            .chunks_exact(width)
            .map(|row| Cdf::new(row.iter().copied()).ok())
            .collect();
        Ok(Grid2 {
            rows,
            columns,
            width,
        })
    }

    /// Samples a position in [0, 1)². Returns it with its density.
    pub fn sample(&self, u: [f64; 2]) -> ([f64; 2], f64) {
        let PickedCell {
            cell: [i, j],
            within: [tx, ty],
        } = self.pick(u);
        let height = self.rows.len() as f64;
        let point = [
            (i as f64 + tx) / self.width as f64,
            (j as f64 + ty) / height,
        ];
        (point, self.cell_density([i, j]))
    }

    /// Samples a cell with probability proportional to its value.
    pub(crate) fn pick(&self, u: [f64; 2]) -> PickedCell {
        let (j, ty) = self.rows.locate(u[1]);
        let Some(columns) = &self.columns[j] else {
            unreachable!("rows without weight have probability zero and are never located");
        };
        let (i, tx) = columns.locate(u[0]);
        PickedCell {
            cell: [i, j],
            within: [tx, ty],
        }
    }

    /// Inverts [`Grid2::sample`]: returns the `u` that it maps to a position in [0, 1]². In rows
    /// without weight, which are never sampled, the first component is 0.
    pub fn inverse(&self, p: [f64; 2]) -> [f64; 2] {
        let (i, tx) = split(p[0], self.width);
        let (j, ty) = split(p[1], self.rows.len());
        let along = self.columns[j].as_ref().map_or(0.0, |c| c.unlocate(i, tx));
        [along, self.rows.unlocate(j, ty)]
    }

    /// Returns the normalised density over the unit square; 0 outside.
    pub fn pdf(&self, p: [f64; 2]) -> f64 {
        if !p.iter().all(|c| (0.0..=1.0).contains(c)) {
            return 0.0;
        }
        self.cell_density([split(p[0], self.width).0, split(p[1], self.rows.len()).0])
    }

    /// Returns the mean of the values: their integral over the unit square.
    pub fn integral(&self) -> f64 {
        self.rows.total() / (self.width * self.rows.len()) as f64
    }

    /// Returns the probability of the cell in column `i` and row `j`.
    pub(crate) fn probability(&self, [i, j]: [usize; 2]) -> f64 {
        let across = self.columns[j].as_ref().map_or(0.0, |c| c.probability(i));
        across * self.rows.probability(j)
    }

    fn cell_density(&self, cell: [usize; 2]) -> f64 {
        self.probability(cell) * (self.width * self.rows.len()) as f64
    }
}

/// Sampled cell, and the remaining random numbers.
pub(crate) struct PickedCell {
    /// Column and row of the cell.
    pub cell: [usize; 2],
    /// Remaining random numbers, uniform in [0, 1)².
    pub within: [f64; 2],
}

/// Divides [0, 1] into `n` cells. Returns the cell that contains `x`, and the position in it.
fn split(x: f64, n: usize) -> (usize, f64) {
    let scaled = x.clamp(0.0, 1.0) * n as f64;
    let i = (scaled as usize).min(n - 1);
    (i, scaled - i as f64)
}
