//! What is read off a meter.

use super::grid::{Coordinates, MeterGrid};
use super::tally::Tally;
use crate::Bins;
use crate::sidebands::Sidebands;
use crate::sparse::Sparse;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Slots that are read before their sums are forgotten.
const SLOTS_AT_ONCE: usize = 1 << 12;

/// One axis of an array of bins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReadingAxis {
    /// Its name: `x`, `y`, `z`, `r`, `opl`, `cosine`, `side`, `part`, `u`, `v`, `order`, `delay`, `stokes`.
    pub name: Cow<'static, str>,
    /// The ends of its bins, one more than there are bins.
    pub edges: Vec<f64>,
}

impl ReadingAxis {
    /// An axis of equal bins.
    pub fn new(name: &'static str, bins: &Bins) -> Self {
        ReadingAxis {
            name: name.into(),
            edges: bins.edges(),
        }
    }

    pub(super) fn optical_length(bins: &Bins) -> Self {
        ReadingAxis::new("opl", bins)
    }

    /// The axes of a grid, the last one running fastest. Positions are those of the world if the grid
    /// is neither turned nor sheared, and else lengths from its corner, or from its centre.
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

    /// Number of bins.
    pub fn len(&self) -> usize {
        self.edges.len() - 1
    }

    /// Whether there are none; never.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// An array of sums over bins, and what each is to be divided by.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Quantity {
    pub name: &'static str,
    pub axes: Vec<ReadingAxis>,
    /// The first of its cells among those of the meter.
    pub first: usize,
    /// Measures of cells, such as volumes: those of the fastest axes, repeated over the others.
    pub measures: Vec<f64>,
    /// If values have either sign: the number of its first cells, whose values are not negative. The errors of the other cells are to be trusted
    /// where those of the first ones are.
    pub signed_after: Option<usize>,
}

impl Quantity {
    /// Number of bins.
    pub(super) fn cells(&self) -> usize {
        self.axes
            .iter()
            .fold(1, |n, axis| n.saturating_mul(axis.len()))
    }

    /// Its sidebands and correlations under such names, if it is the first of the parts.
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

    /// Reads it off the meter's part of a tally. Its sums are forgotten on the way if nobody else reads them.
    pub(super) fn read(&self, part: &mut TallyPart, forget: bool) -> Reading {
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
            if forget {
                tally.forget(from..to);
            }
            from = to;
        }
        reading
    }
}

/// The slots of one meter in a tally.
pub(super) struct TallyPart<'t> {
    pub tally: &'t mut Tally,
    /// The first of the slots.
    pub first: usize,
    pub channels: usize,
}

/// An array that a meter has measured. Bins take memory only near those that light has reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// `fluence`, `absorbed`, `power`, `irradiance`, ...
    pub name: Cow<'static, str>,
    /// Its axes, the slowest first. Channels run fastest of all, after the last axis.
    pub axes: Vec<ReadingAxis>,
    /// Means for each bin and channel.
    pub mean: Sparse<f64>,
    /// Standard errors of the means.
    pub error: Sparse<f64>,
    /// Effective numbers of particles from which each comes: see [`Moments::effective`](crate::moments::Moments::effective).
    pub effective: Sparse<f64>,
    /// Where the error is not to be trusted: see [`Moments::few`](crate::moments::Moments::few).
    pub few: Sparse<bool>,
}

impl Reading {
    /// Bytes that the values of `bins` bins and channels take once light has reached all of them.
    pub(super) fn memory(bins: usize) -> usize {
        let numbers = Sparse::<f64>::memory(bins).saturating_mul(3);
        numbers.saturating_add(Sparse::<bool>::memory(bins))
    }
}
