//! Tables for sampling light that varies over the unit square.

use crate::sampling::{DistributionError, Grid2};

/// Number of cells along each side of the table.
const CELLS: usize = 128;
/// Number of points along each side of a cell at which the light is evaluated.
const POINTS: usize = 4;

/// Fraction of the samples that is uniform. It covers bright spots that the points of the table may
/// have missed.
const UNIFORM_FRACTION: f64 = 0.1;

/// Creates a density over the unit square roughly proportional to `light`, which is finite and ≥ 0.
pub(super) fn sampling_table(light: impl Fn([f64; 2]) -> f64) -> Result<Grid2, DistributionError> {
    let fine = CELLS * POINTS;
    let at = |k: usize| (k as f64 + 0.5) / fine as f64;
    let mut cells = vec![0.0; CELLS * CELLS];
    for y in 0..fine {
        for x in 0..fine {
            cells[y / POINTS * CELLS + x / POINTS] += light([at(x), at(y)]);
        }
    }
    let mean = cells.iter().sum::<f64>() / cells.len() as f64;
    // Make the density of a black light uniform.
    let even = if mean > 0.0 {
        UNIFORM_FRACTION * mean
    } else {
        1.0
    };
    cells
        .iter_mut()
        .for_each(|c| *c = (1.0 - UNIFORM_FRACTION) * *c + even);
    Grid2::new(CELLS, CELLS, &cells)
}
