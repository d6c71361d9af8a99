//! Tables for sampling light that varies over the unit square.

use crate::sampling::{DistributionError, Grid2};

/// Cells along each side of the table, and points along each side of a cell at which it is made.
const CELLS: usize = 128;
const POINTS: usize = 4;

/// Share of the samples that is spread evenly, whatever the table says: its points may have missed something bright.
const EVENLY: f64 = 0.1;

/// A density over the unit square roughly in proportion to `light`, which is finite and ≥ 0.
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
    // A black light has no preferences.
    let even = if mean > 0.0 { EVENLY * mean } else { 1.0 };
    cells
        .iter_mut()
        .for_each(|c| *c = (1.0 - EVENLY) * *c + even);
    Grid2::new(CELLS, CELLS, &cells)
}
