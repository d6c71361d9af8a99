//! Readings of meters.

use super::grid::{Coordinates, MeterGrid};
use super::layout::{CellLayout, Cells};
use super::tally::Tally;
use crate::Bins;
use crate::frequency_domain::{FrequencyDomain, PARTS, Phasor};
use crate::sidebands::Sidebands;
use crate::sparse::Sparse;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::Range;

/// Approximate number of slots that are read before their sums are freed.
const SLOTS_AT_ONCE: usize = 1 << 12;

/// Axis of an array of bins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReadingAxis {
    /// Name of the axis: `x`, `y`, `z`, `r`, `opl`, `cosine`, `side`, `part`, `u`, `v`, `order`,
    /// `delay`, `stokes`, `frequency`.
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

    /// Creates an axis of numbered items.
    pub(super) fn numbers(name: &'static str, count: usize) -> Self {
        let max = count as f64;
        ReadingAxis::new(
            name,
            &Bins {
                min: 0.0,
                max,
                count,
            },
        )
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
    /// Cells of the meter that hold the sums.
    pub cells: Cells,
    /// Measures of cells, such as volumes, along the fastest axes; they repeat along the other
    /// axes.
    pub measures: Vec<f64>,
    /// Cells of values that are not negative, if the quantity has values of either sign: its errors
    /// are reliable where the errors of these cells are. They repeat along the slower axes.
    pub unsigned: Option<Cells>,
    pub value: Value,
}

/// Value that is read from the cells of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Value {
    /// Mean of the scores in a cell.
    Mean,
    /// Amplitude of [modulated light](FrequencyDomain), whose parts are in cells at this distance.
    Amplitude(usize),
    /// Phase of modulated light, whose parts are in cells at this distance.
    Phase(usize),
}

impl Quantity {
    /// Returns the quantities of sidebands and correlations with the given names; `self` must be
    /// the first of the parts.
    pub(super) fn of_parts(self, sidebands: &Sidebands, names: [&'static str; 2]) -> Vec<Self> {
        let orders = ReadingAxis::new("order", &sidebands.order_bins());
        let delays = sidebands.delay_bins();
        let delays = delays.map(|bins| ReadingAxis::new("delay", &bins));
        let first_delay = orders.len();
        let parts = [(Some(orders), 0), (delays, first_delay)];
        let quantity = |(name, (axis, first)): (_, (Option<ReadingAxis>, usize))| {
            let axis = axis?;
            let cells = Cells {
                parts: axis.len(),
                ..self.cells.moved(first)
            };
            let mut axes = vec![axis];
            axes.extend_from_slice(&self.axes);
            Some(Quantity {
                name,
                axes,
                cells,
                measures: self.measures.clone(),
                unsigned: None,
                value: Value::Mean,
            })
        };
        names.into_iter().zip(parts).filter_map(quantity).collect()
    }

    /// Returns the quantities of modulated light with the given names: the in-phase and quadrature
    /// parts, amplitude and phase. `self` must be the first of the parts; `unmodulated` are the
    /// cells of all light.
    pub(super) fn of_frequencies(
        self,
        domain: &FrequencyDomain,
        names: [&'static str; 4],
        unmodulated: Cells,
    ) -> [Self; 4] {
        let count = domain.hertz().len();
        let [in_phase, quadrature, amplitude, phase] = names;
        let quantity = |name, place, value, measures: &[f64]| {
            let mut axes = vec![ReadingAxis::numbers("frequency", count)];
            axes.extend_from_slice(&self.axes);
            Quantity {
                name,
                axes,
                cells: Cells {
                    parts: count,
                    ..self.cells.moved(place * count)
                },
                measures: measures.to_vec(),
                unsigned: Some(unmodulated),
                value,
            }
        };
        [
            quantity(in_phase, 0, Value::Mean, &self.measures),
            quantity(quadrature, 1, Value::Mean, &self.measures),
            quantity(amplitude, 0, Value::Amplitude(count), &self.measures),
            quantity(phase, 0, Value::Phase(count), &self.measures),
        ]
    }

    /// Returns true if the quantity is a sum of scores.
    pub(super) fn is_linear(&self) -> bool {
        self.value == Value::Mean
    }

    /// Returns the distance in cells between the parts that the quantity is read from; 0 if it is a
    /// sum of scores.
    pub(super) fn offset(&self) -> usize {
        self.value.offset()
    }

    /// Returns the measure of a bin, such as its volume.
    pub(super) fn measure(&self, bin: usize) -> f64 {
        self.measures[bin % self.measures.len()]
    }

    /// Returns the divisor of the value that is read from the sums of a bin.
    pub(super) fn divisor(&self, bin: usize) -> f64 {
        match self.value {
            Value::Mean | Value::Amplitude(_) => self.measure(bin),
            Value::Phase(_) => 1.0,
        }
    }

    /// Returns the derivatives of a bin's value, times its divisor, by the means of its cells.
    /// `parts` yields the means of the in-phase and the quadrature part.
    pub(super) fn derivatives(&self, parts: impl Fn() -> [f64; 2]) -> [f64; 2] {
        match self.value {
            Value::Mean => [1.0, 0.0],
            Value::Amplitude(_) => Phasor::amplitude_derivatives(parts()),
            Value::Phase(_) => Phasor::phase_derivatives(parts()),
        }
    }

    /// Creates an empty reading.
    fn unlit(&self, tally: &Tally, channels: usize) -> Reading {
        let bins = self.cells.count() * channels;
        let error = match self.value {
            Value::Phase(_) => f64::INFINITY,
            Value::Mean | Value::Amplitude(_) => tally.error_of_nothing(),
        };
        Reading {
            name: self.name.into(),
            axes: self.axes.clone(),
            mean: Sparse::new(bins, 0.0),
            error: Sparse::new(bins, error),
            effective: Sparse::new(bins, 0.0),
            few: Sparse::new(bins, false),
        }
    }
}

/// Reads the quantities of a meter from its part of a tally. Sums are freed while they are read, so
/// that readings take their place in memory.
pub(super) fn read(
    quantities: &[Quantity],
    layout: &CellLayout,
    mut part: TallyPart,
) -> Vec<Reading> {
    let empty = quantities
        .iter()
        .map(|quantity| quantity.unlit(part.tally, part.channels));
    let mut readings: Vec<Reading> = empty.collect();
    part.read(0..layout.totals, quantities, &mut readings);
    let bins_at_once = (SLOTS_AT_ONCE / (layout.values * part.channels)).max(1);
    let cells = layout.totals..layout.cells();
    for first in cells.clone().step_by(bins_at_once * layout.values) {
        let end = cells.end.min(first + bins_at_once * layout.values);
        part.read(first..end, quantities, &mut readings);
    }
    readings
}

/// Value of a bin.
struct Found {
    mean: f64,
    error: f64,
    /// True if the value has no meaning, whatever its error.
    is_unknown: bool,
}

impl Value {
    /// Returns the distance in cells between the parts of a value.
    fn offset(self) -> usize {
        match self {
            Value::Mean => 0,
            Value::Amplitude(distance) | Value::Phase(distance) => distance,
        }
    }

    /// Reads the value whose first part is in a slot.
    fn read(self, tally: &Tally, slot: usize, channels: usize) -> Found {
        if self == Value::Mean {
            return Found {
                mean: tally.mean(slot),
                error: tally.error(slot),
                is_unknown: false,
            };
        }
        let slots: [usize; PARTS] =
            std::array::from_fn(|part| slot + part * self.offset() * channels);
        let variances = slots.map(|slot| tally.error(slot).powi(2));
        let phasor = Phasor::of(slots.map(|slot| tally.mean(slot)), variances);
        let [mean, error] = match self {
            Value::Phase(_) => phasor.phase,
            Value::Mean | Value::Amplitude(_) => phasor.amplitude,
        };
        Found {
            mean,
            error,
            is_unknown: phasor.is_unknown(),
        }
    }
}

/// Slots of one meter in a tally.
pub(super) struct TallyPart<'t> {
    pub tally: &'t mut Tally,
    /// First slot of the meter.
    pub first: usize,
    pub channels: usize,
}

impl TallyPart<'_> {
    /// Reads the quantities in a range of cells, which holds all values of its bins, and frees the
    /// sums.
    fn read(&mut self, cells: Range<usize>, quantities: &[Quantity], readings: &mut [Reading]) {
        let (first, channels) = (self.first, self.channels);
        let slots = first + cells.start * channels..first + cells.end * channels;
        for slot in self.tally.lit(slots.clone()) {
            let (cell, channel) = ((slot - first) / channels, (slot - first) % channels);
            for (quantity, reading) in quantities.iter().zip(&mut *readings) {
                if let Some(index) = quantity.cells.index(cell) {
                    self.read_bin(quantity, index, channel, reading);
                }
            }
        }
        self.tally.clear(slots);
    }

    /// Reads the value of a quantity in a bin.
    fn read_bin(&self, quantity: &Quantity, index: usize, channel: usize, reading: &mut Reading) {
        let slot = |cell: usize| self.first + cell * self.channels + channel;
        let own = slot(quantity.cells.cell(index));
        let found = quantity.value.read(self.tally, own, self.channels);
        // Where the quantity has several parts, all of them repeat the same unsigned cells.
        let unsigned = quantity.unsigned;
        let reliable = unsigned.map_or(own, |cells| slot(cells.cell(index % cells.bins)));
        let divisor = quantity.divisor(index);
        let i = index * self.channels + channel;
        *reading.mean.get_mut(i) = found.mean / divisor;
        *reading.error.get_mut(i) = found.error / divisor;
        *reading.effective.get_mut(i) = self.tally.effective(reliable);
        *reading.few.get_mut(i) = found.is_unknown || self.tally.few(reliable);
    }
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
