//! Fluence rate and absorbed power in the cells of a grid.
//!
//! A particle carries power, and what it adds to ∫ Φ dV over a cell is its power times the arc length
//! that it flies there (track-length estimator), or its power over the extinction for each collision
//! there (collision estimator). No index enters: Φ = ∫ L dω is the power that crosses a small ball over
//! the area of its cross-section, whatever the index (docs/theory.md#meters). Arcs are cut where they pass from cell
//! to cell, so the parts have the length of the whole.

use super::flight::{Collision, Flight};
use super::grid::MeterGrid;
use super::reading::{Quantity, ReadingAxis};
use super::tally::Scores;
use crate::path::FreeFlightEvent;
use crate::sampling::Sampler;
use crate::{Bins, Spectrum};
use eikonal::ray::Arc;

/// How fluence is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// By the way that particles fly.
    TrackLength,
    /// By their collisions; blind where nothing attenuates.
    Collision,
}

/// Measures ∫ Φ dV and ∫ μ_a Φ dV.
#[derive(Clone, Debug)]
pub struct FluenceMeter {
    /// Cells.
    pub grid: MeterGrid,
    /// Estimator.
    pub estimator: Estimator,
    /// Bins of the optical path length from the emitter, if light is told apart by it.
    pub optical_length: Option<Bins>,
}

/// Storage for the cuts of one arc.
pub(super) type Cuts = Vec<f64>;

impl FluenceMeter {
    /// Bins of optical length times cells.
    fn cells(&self) -> usize {
        let bins = self.optical_length.map_or(1, |bins| bins.count);
        bins.saturating_mul(self.grid.cells())
    }

    /// Number of cells of both quantities.
    pub(super) fn slots(&self) -> usize {
        self.cells().saturating_mul(2)
    }

    /// What is measured, in the order of slots.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let axes = self
            .optical_length
            .map(|bins| ReadingAxis::optical_length(&bins));
        let axes: Vec<ReadingAxis> = axes
            .into_iter()
            .chain(ReadingAxis::of_grid(&self.grid))
            .collect();
        let volumes: Vec<f64> = (0..self.grid.cells())
            .map(|c| self.grid.volume(c))
            .collect();
        let quantity = |(name, first)| Quantity {
            name,
            axes: axes.clone(),
            first,
            measures: volumes.clone(),
        };
        [("fluence", 0), ("absorbed", self.cells())]
            .map(quantity)
            .into()
    }

    /// Bin and cell of a point, as a slot without channels.
    fn locate(&self, x: glam::DVec3, optical_length: f64) -> Option<usize> {
        let bin = match &self.optical_length {
            None => 0,
            Some(bins) => bins.index(optical_length)?,
        };
        Some(bin * self.grid.cells() + self.grid.cell(x)?)
    }

    fn score(&self, cell: usize, [fluence, absorbed]: [Spectrum; 2], scores: &mut Slots) {
        scores.add(cell, fluence);
        scores.add(self.cells() + cell, absorbed);
    }

    /// Takes note of a stretch of a particle's way.
    pub(super) fn fly(
        &self,
        flight: &Flight,
        scores: &mut Slots,
        cuts: &mut Cuts,
        sampler: &mut Sampler,
    ) {
        if self.estimator == Estimator::Collision {
            return;
        }
        let stretch = Stretch {
            arc: &flight.span.arc,
            theta_end: flight.theta_end,
            optical_length: flight.optical_length,
        };
        // Score w ∫ ds of each piece, eq. (track lengths and collisions).
        let uniform = flight.uniform();
        self.pieces(&stretch, cuts, |cell, [from, to]| {
            let values = match uniform {
                Some([power, absorption]) => {
                    let fluence = power * (to - from);
                    [fluence, fluence * absorption]
                }
                None => at_random(flight, [from, to], sampler),
            };
            self.score(cell, values, scores);
        });
    }

    /// Takes note of a flight from one collision to the next, and of the collision at its end.
    pub(super) fn fly_freely(&self, event: &FreeFlightEvent, scores: &mut Slots, cuts: &mut Cuts) {
        let (power, flight) = (event.ray.throughput, event.flight);
        match self.estimator {
            Estimator::TrackLength => {
                let mut gone = 0.0;
                for leg in &flight.legs {
                    let start = flight.start + flight.direction * gone;
                    let arc = Arc::line(start, flight.direction * flight.n, leg.length / flight.n);
                    let stretch = Stretch {
                        arc: &arc,
                        theta_end: 1.0,
                        optical_length: event.ray.optical_length + flight.n * gone,
                    };
                    self.pieces(&stretch, cuts, |cell, [from, to]| {
                        let fluence = power * (to - from);
                        self.score(cell, [fluence, fluence * leg.absorption], scores);
                    });
                    gone += leg.length;
                }
            }
            Estimator::Collision => {
                let last = flight.last();
                if let Some(cell) = self.locate(flight.end(), event.optical_length) {
                    let fluence = power / last.extinction;
                    self.score(cell, [fluence, fluence * last.absorption], scores);
                }
            }
        }
    }

    /// Cuts a stretch where it passes from cell to cell, and from gate to gate: the cell of each piece, and the arc lengths between which
    /// it lies.
    #[inline]
    fn pieces(&self, stretch: &Stretch, cuts: &mut Cuts, mut see: impl FnMut(usize, [f64; 2])) {
        let Stretch { arc, theta_end, .. } = *stretch;
        if self.optical_length.is_none()
            && arc.is_straight()
            && let Some(cell) = self
                .grid
                .cell_of_line([arc.start(), arc.position(theta_end)])
        {
            return see(cell, [0.0, arc.arc_length(theta_end)]);
        }
        cuts.clear();
        self.grid.cut(arc, theta_end, cuts);
        if cuts.is_empty() && self.grid.cell(arc.position(0.5 * theta_end)).is_none() {
            return;
        }
        self.cut_by_length(stretch, cuts);
        cuts.push(theta_end);
        cuts.sort_unstable_by(f64::total_cmp);
        // A piece is in the cell of its middle.
        let (mut from, mut before) = (0.0, 0.0);
        for &to in cuts.iter() {
            let length = arc.arc_length(to);
            let middle = 0.5 * (from + to);
            let optical_length = match self.optical_length {
                None => 0.0,
                Some(_) => stretch.optical_length + arc.optical_length(middle),
            };
            if let Some(cell) = self.locate(arc.position(middle), optical_length) {
                see(cell, [before, length]);
            }
            (from, before) = (to, length);
        }
    }

    /// Adds the places where the optical path length passes from bin to bin.
    fn cut_by_length(&self, stretch: &Stretch, cuts: &mut Cuts) {
        let Some(bins) = &self.optical_length else {
            return;
        };
        let (arc, start) = (stretch.arc, stretch.optical_length);
        let end = start + arc.optical_length(stretch.theta_end);
        let edges = bins.edges_between(start, end);
        let thetas = edges.map(|edge| arc.theta_at_optical_length(edge - start));
        cuts.extend(thetas.filter(|theta| *theta < stretch.theta_end));
    }

    /// Takes note of a collision.
    pub(super) fn collide(&self, collision: &Collision, scores: &mut Slots) {
        if self.estimator == Estimator::TrackLength {
            return;
        }
        // Score w/σ_t, eq. (track lengths and collisions).
        if let Some(cell) = self.locate(collision.point.x, collision.optical_length) {
            self.score(cell, [collision.path, collision.absorbed()], scores);
        }
    }
}

/// A part of an arc, from θ = 0 on.
#[derive(Clone, Copy, Debug)]
struct Stretch<'a> {
    arc: &'a Arc,
    theta_end: f64,
    /// Optical path length from the emitter to its start.
    optical_length: f64,
}

/// ∫ power ds and ∫ μ_a power ds from one arc length to another, both taken at one point drawn at random, which is unbiased.
fn at_random(flight: &Flight, [from, to]: [f64; 2], sampler: &mut Sampler) -> [Spectrum; 2] {
    let length = to - from;
    let s = from + length * sampler.next_1d();
    let theta = flight.span.arc.theta_at_length(s).min(flight.theta_end);
    let fluence = flight.power_at(theta) * length;
    [fluence, fluence * flight.absorption_at(theta)]
}

/// The slots of one meter: cells times channels.
#[derive(Debug)]
pub(super) struct Slots<'a> {
    pub scores: &'a mut Scores,
    pub first: usize,
    pub channels: usize,
}

impl Slots<'_> {
    /// Adds a value to a cell, channel by channel.
    pub(super) fn add(&mut self, cell: usize, value: Spectrum) {
        for c in 0..self.channels {
            self.scores
                .add(self.first + cell * self.channels + c, value[c]);
        }
    }
}
