//! Linear functionals of readings, which derivatives are those of: one sum over all, or each bin of one reading.

use super::{Meter, Setup};
use crate::Spectrum;

/// Linear functionals of what particles leave in the cells of all meters. A cell counts in one of them at most.
pub(crate) struct Functionals {
    /// For each slot.
    weights: Vec<f64>,
    channels: usize,
    rows: Rows,
}

/// To which functional cells belong.
enum Rows {
    /// All to the only one.
    One,
    /// Those of a reading to one each.
    Each { first: usize, count: usize },
}

impl Functionals {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        match self.rows {
            Rows::One => 1,
            Rows::Each { count, .. } => count,
        }
    }

    /// The number of the functional in which a cell counts, and its weights by channels; `None` if it counts in none.
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
    /// Σ weight × reading. Weights are given for each meter and each of its [readings](Meter::readings), as its means are, for the
    /// channels from `first_channel` on of `all`; an empty one counts nothing.
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

    /// Each bin of a reading of a meter, channel by channel.
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
