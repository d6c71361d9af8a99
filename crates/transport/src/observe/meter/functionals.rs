//! Linear functionals of readings, whose derivatives are computed: one weighted sum over all
//! readings, or each bin of one reading.

use super::{Meter, Setup};
use crate::Spectrum;

/// Linear functionals of the scores in the cells of all meters. A cell belongs to at most one of
/// them.
pub(crate) struct Functionals {
    /// Weight of each slot.
    weights: Vec<f64>,
    channels: usize,
    rows: Rows,
}

/// Assignment of cells to functionals.
enum Rows {
    /// All cells belong to a single functional.
    One,
    /// Each cell of a reading has its own functional.
    Each { first: usize, count: usize },
}

impl Functionals {
    /// Returns the number of functionals.
    pub(crate) fn count(&self) -> usize {
        match self.rows {
            Rows::One => 1,
            Rows::Each { count, .. } => count,
        }
    }

    /// Returns the index of a cell's functional, and its weights by channel; `None` if the cell
    /// belongs to none.
    pub(super) fn of_cell(&self, cell: usize) -> Option<(usize, Spectrum)> {
        let row = match self.rows {
            Rows::One => 0,
            Rows::Each { first, count } => cell.checked_sub(first).filter(|row| *row < count)?,
        };
        let mut weights = Spectrum::ZERO;
        let slots = &self.weights[cell * self.channels..][..self.channels];
        weights.0[..self.channels].copy_from_slice(slots);
        (!weights.is_zero()).then_some((row, weights))
    }
}

impl Setup<'_> {
    /// Creates the functional Σ weight × reading. Weights are given for each meter and each of its
    /// [readings](Meter::readings), in the layout of its means with `all` channels. The setup's
    /// channels start at `first_channel`. An empty list leaves the reading out.
    pub(crate) fn weighted(
        &self,
        weights: &[Vec<Vec<f64>>],
        first_channel: usize,
        all: usize,
    ) -> Functionals {
        let mut slots = vec![0.0; self.slots()];
        let mut first = 0;
        for (meter, weights) in self.meters.iter().zip(weights) {
            for (quantity, weights) in meter.quantities().iter().zip(weights) {
                for (cell, weights) in weights.chunks(all).enumerate() {
                    let measure = quantity.measures[cell % quantity.measures.len()];
                    for c in 0..self.channels {
                        let slot = first + (quantity.first + cell) * self.channels + c;
                        slots[slot] += weights[first_channel + c] / measure;
                    }
                }
            }
            first += meter.cells() * self.channels;
        }
        Functionals {
            weights: slots,
            channels: self.channels,
            rows: Rows::One,
        }
    }

    /// Creates one functional for each bin of a meter's reading, channel by channel.
    pub(crate) fn each_bin(&self, meter: usize, reading: usize) -> Functionals {
        let before: usize = self.meters[..meter].iter().map(Meter::cells).sum();
        let quantity = &self.meters[meter].quantities()[reading];
        let (first, count) = (before + quantity.first, quantity.cells());
        let mut weights = vec![0.0; self.slots()];
        let slots = weights[first * self.channels..].chunks_mut(self.channels);
        for (cell, slots) in slots.take(count).enumerate() {
            // Planted error "rows of Jacobians without the measure of their bins", found by morgana-transport/transport::meters::derivatives::derivatives_of_fluence_are_differences:
            // slots.fill(1.0); let _ = cell;
            slots.fill(1.0 / quantity.measures[cell % quantity.measures.len()]);
        }
        Functionals {
            weights,
            channels: self.channels,
            rows: Rows::Each { first, count },
        }
    }
}
