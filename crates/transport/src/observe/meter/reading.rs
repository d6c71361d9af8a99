//! Readings of meters.

use super::grid::{Coordinates, MeterGrid};
use super::tally::Tally;
use crate::Bins;
use crate::sidebands::Sidebands;
use crate::sparse::Sparse;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Number of slots that are read before their sums are freed.
const SLOTS_AT_ONCE: usize = 1 << 12;

/// Axis of an array of bins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReadingAxis {
    /// Name of the axis: `x`, `y`, `z`, `r`, `opl`, `cosine`, `side`, `part`, `u`, `v`, `order`,
    /// `delay`, `stokes`.
    pub name: Cow<'static, str>,
    /// Edges of the bins, one more than the number of bins.
    pub edges: Vec<f64>,
}

impl ReadingAxis {
    /// Creates an axis of equal bins.
    pub fn new(name: &'static str, bins: &Bins) -> Self {
        ReadingAxis {
            name: name.into(),
            edges: bins.edges(),
        }
    }

    pub(super) fn optical_length(bins: &Bins) -> Self {
        ReadingAxis::new("opl", bins)
    }

    /// Returns the axes of a grid, the last one varying fastest. Positions are world coordinates if
    /// the grid is neither rotated nor sheared. Otherwise they are lengths from its corner, or from
    /// its centre.
    pub(super) fn of_grid(grid: &MeterGrid) -> Vec<Self> {
        let (matrix, origin) = (grid.to_world().matrix3, grid.to_world().translation);
        let upright = (0..3).all(|i| {
            let side = matrix.col(i);
            side[i] > 0.0 && side.length() == side[i]
        });
        let axis = |name, i: usize, moved: bool| {
            let start = if upright && moved { origin[i] } else { 0.0 };
            ReadingAxis::new(
                name,
                &Bins {
                    min: start,
                    max: start + matrix.col(i).length(),
                    count: grid.size()[i],
                },
            )
        };
        match grid.coordinates() {
            Coordinates::Cartesian => {
                vec![axis("z", 2, true), axis("y", 1, true), axis("x", 0, true)]
            }
            Coordinates::Cylindrical => vec![axis("z", 2, true), axis("r", 0, false)],
            Coordinates::Spherical => vec![axis("r", 0, false)],
        }
    }

    /// Returns the number of bins.
    pub fn len(&self) -> usize {
        self.edges.len() - 1
    }

    /// Returns true if there are no bins, which never happens.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Array of sums over bins, with the divisor of each sum.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Quantity {
    pub name: &'static str,
    pub axes: Vec<ReadingAxis>,
    /// Index of the quantity's first cell among the cells of the meter.
    pub first: usize,
    /// Measures of cells, such as volumes, along the fastest axes; they repeat along the other
    /// axes.
    pub measures: Vec<f64>,
    /// Number of leading cells whose values are not negative, if the other values have either sign.
    /// The errors of the other cells are reliable where the errors of the leading cells are.
    pub signed_after: Option<usize>,
}

impl Quantity {
    /// Returns the number of bins.
    pub(super) fn cells(&self) -> usize {
        self.axes
            .iter()
            .fold(1, |n, axis| n.saturating_mul(axis.len()))
    }

    /// Returns the quantities of sidebands and correlations with the given names; `self` must be
    /// the first of the parts.
    pub(super) fn of_parts(self, sidebands: &Sidebands, names: [&'static str; 2]) -> Vec<Self> {
        let cells = self.cells();
        let orders = ReadingAxis::new("order", &sidebands.order_bins());
        let delays = sidebands.delay_bins();
        let delays = delays.map(|bins| ReadingAxis::new("delay", &bins));
        let first_delay = self.first + orders.len() * cells;
        let parts = [(Some(orders), self.first), (delays, first_delay)];
        let quantity = |(name, (axis, first)): (_, (Option<ReadingAxis>, _))| {
            let mut axes = vec![axis?];
            axes.extend_from_slice(&self.axes);
            Some(Quantity {
                name,
                axes,
                first,
                measures: self.measures.clone(),
                signed_after: None,
            })
        };
        names.into_iter().zip(parts).filter_map(quantity).collect()
    }

    /// Reads the quantity from the meter's part of a tally. If `clear` is set, it frees the sums
    /// on the way.
    pub(super) fn read(&self, part: &mut TallyPart, clear: bool) -> Reading {
        let TallyPart {
            tally,
            first,
            channels,
        } = part;
        let channels = *channels;
        let bins = self.cells() * channels;
        let start = *first + self.first * channels;
        let mut reading = Reading {
            name: self.name.into(),
            axes: self.axes.clone(),
            mean: Sparse::new(bins, 0.0),
            error: Sparse::new(bins, tally.error_of_nothing()),
            effective: Sparse::new(bins, 0.0),
            few: Sparse::new(bins, false),
        };
        let unsigned = self.signed_after.map_or(bins, |cells| cells * channels);
        let (mut from, end) = (start, start + bins);
        while from < end {
            let to = (from + 1).next_multiple_of(SLOTS_AT_ONCE).min(end);
            for slot in tally.lit(from..to) {
                let i = slot - start;
                let measure = self.measures[i / channels % self.measures.len()];
                *reading.mean.get_mut(i) = tally.mean(slot) / measure;
                *reading.error.get_mut(i) = tally.error(slot) / measure;
                *reading.effective.get_mut(i) = tally.effective(slot);
                *reading.few.get_mut(i) = if i < unsigned {
                    tally.few(slot)
                } else {
                    reading.few.get(i % unsigned)
                };
            }
            if clear {
                tally.clear(from..to);
            }
            from = to;
        }
        reading
    }
}

/// Slots of one meter in a tally.
pub(super) struct TallyPart<'t> {
    pub tally: &'t mut Tally,
    /// First slot of the meter.
    pub first: usize,
    pub channels: usize,
}

/// Array that a meter has measured. Bins take memory only near those that light has reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Name of the quantity: `fluence`, `absorbed`, `power`, `irradiance`, ...
    pub name: Cow<'static, str>,
    /// Axes, the slowest first. The channel varies fastest, after the last axis.
    pub axes: Vec<ReadingAxis>,
    /// Mean of each bin and channel.
    pub mean: Sparse<f64>,
    /// Standard errors of the means.
    pub error: Sparse<f64>,
    /// Effective number of particles behind each mean: see
    /// [`Moments::effective`](crate::moments::Moments::effective).
    pub effective: Sparse<f64>,
    /// True where the error is unreliable: see [`Moments::few`](crate::moments::Moments::few).
    pub few: Sparse<bool>,
}

impl Reading {
    /// Returns the bytes of the values of `bins` bins and channels, once light has reached all of
    /// them.
    pub(super) fn memory(bins: usize) -> usize {
        let numbers = Sparse::<f64>::memory(bins).saturating_mul(3);
        numbers.saturating_add(Sparse::<bool>::memory(bins))
    }
}
