//! Linear functionals of readings, whose derivatives are computed: one weighted sum over all
//! readings, or each bin of one reading. Amplitudes and phases are linear near measured values.

use super::layout::Cells;
use super::reading::{Quantity, Reading};
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
    /// Each bin of a reading has its own functional. `distance` is the distance of its second cell
    /// from its first, 0 if it has one cell.
    Each { cells: Cells, distance: usize },
}

impl Functionals {
    /// Returns the number of functionals.
    pub(crate) fn count(&self) -> usize {
        match self.rows {
            Rows::One => 1,
            Rows::Each { cells, .. } => cells.count(),
        }
    }

    /// Returns the index of a cell's functional, and its weights by channel; `None` if the cell
    /// belongs to none.
    pub(super) fn of_cell(&self, cell: usize) -> Option<(usize, Spectrum)> {
        let row = match self.rows {
            Rows::One => 0,
            Rows::Each { cells, distance } => {
                let second = || cells.moved(distance).index(cell);
                cells.index(cell).or_else(second)?
            }
        };
        let mut weights = Spectrum::ZERO;
        let slots = &self.weights[cell * self.channels..][..self.channels];
        weights.0[..self.channels].copy_from_slice(slots);
        (!weights.is_zero()).then_some((row, weights))
    }
}

/// Measured readings, near which amplitudes and phases are linear.
#[derive(Clone, Copy)]
pub(crate) struct Near<'a> {
    /// Readings of each meter, with all channels; `None` if only sums of scores are wanted.
    pub readings: Option<&'a [Vec<Reading>]>,
    /// First channel of the setup.
    pub first_channel: usize,
    /// Number of all channels.
    pub channels: usize,
}

/// Reading of a meter as a linear function of the cells of all meters.
struct Linear<'a> {
    quantity: Quantity,
    /// Cells of the quantity among the cells of all meters.
    cells: Cells,
    /// Readings of the in-phase and the quadrature part, for amplitudes and phases.
    parts: Option<[&'a Reading; 2]>,
    near: Near<'a>,
}

impl Linear<'_> {
    /// Calls `see` with each cell of a bin, and the derivative of the bin's value in a channel by
    /// the mean of this cell.
    fn derivatives(&self, bin: usize, channel: usize, mut see: impl FnMut(usize, f64)) {
        let quantity = &self.quantity;
        let slot = bin * self.near.channels + self.near.first_channel + channel;
        let mean = |part: &Reading| part.mean[slot] * quantity.measure(bin);
        let parts = || self.parts.map_or([0.0; 2], |parts| parts.map(mean));
        let by = quantity.derivatives(parts);
        let (cell, distance) = (self.cells.cell(bin), quantity.offset());
        see(cell, by[0] / quantity.divisor(bin));
        if distance > 0 {
            see(cell + distance, by[1] / quantity.divisor(bin));
        }
    }
}

impl Setup<'_> {
    /// Creates the functional Σ weight × reading. Weights are given for each meter and each of its
    /// [readings](Meter::readings), in the layout of its means. An empty list leaves the reading
    /// out.
    pub(crate) fn weighted(&self, weights: &[Vec<Vec<f64>>], near: Near) -> Functionals {
        let mut slots = vec![0.0; self.slots()];
        for (meter, weights) in weights.iter().enumerate() {
            for (reading, weights) in weights.iter().enumerate() {
                let linear = self.linear(meter, reading, near);
                for (bin, weights) in weights.chunks(near.channels).enumerate() {
                    for c in 0..self.channels {
                        let weight = weights[near.first_channel + c];
                        linear.derivatives(bin, c, |cell, derivative| {
                            slots[cell * self.channels + c] += weight * derivative;
                        });
                    }
                }
            }
        }
        Functionals {
            weights: slots,
            channels: self.channels,
            rows: Rows::One,
        }
    }

    /// Creates one functional for each bin of a meter's reading, channel by channel.
    pub(crate) fn each_bin(&self, meter: usize, reading: usize, near: Near) -> Functionals {
        let linear = self.linear(meter, reading, near);
        let mut weights = vec![0.0; self.slots()];
        for bin in 0..linear.cells.count() {
            for c in 0..self.channels {
                linear.derivatives(bin, c, |cell, derivative| {
                    // Planted error "rows of Jacobians without the measure of their bins", found by morgana-transport/transport::meters::derivatives::derivatives_of_fluence_are_differences:
                    // weights[cell * self.channels + c] = derivative.signum();
                    weights[cell * self.channels + c] = derivative;
                });
            }
        }
        Functionals {
            weights,
            channels: self.channels,
            rows: Rows::Each {
                cells: linear.cells,
                distance: linear.quantity.offset(),
            },
        }
    }

    fn linear<'n>(&self, meter: usize, reading: usize, near: Near<'n>) -> Linear<'n> {
        let before: usize = self.meters[..meter].iter().map(Meter::cells).sum();
        let mut quantities = self.meters[meter].quantities();
        let of = |readings: &'n [Vec<Reading>]| {
            let own = &quantities[reading];
            [own.cells, own.cells.moved(own.offset())].map(|cells| {
                let mut all = quantities.iter().zip(&readings[meter]);
                all.find(|(q, _)| q.is_linear() && q.cells == cells)
            })
        };
        let parts = match near.readings.map(of) {
            Some([Some((_, in_phase)), Some((_, quadrature))]) => Some([in_phase, quadrature]),
            _ => None,
        };
        let quantity = quantities.swap_remove(reading);
        Linear {
            cells: quantity.cells.moved(before),
            quantity,
            parts,
            near,
        }
    }
}
