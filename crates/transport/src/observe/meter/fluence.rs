//! Fluence rate and absorbed power in the cells of a grid.
//!
//! A particle carries power. It adds to ∫ Φ dV over a cell its power times the arc length within
//! the cell (track-length estimator). Or it adds its power over the extinction for each collision
//! in the cell (collision estimator). The index does not enter: Φ = ∫ L dω is the power that
//! crosses a small ball over the area of the ball's cross-section, for any index
//! (docs/theory.md#meters). Arcs are cut where they pass from cell to cell, so the lengths of the
//! pieces add up to the whole.

use super::dwell::Dwell;
use super::flight::{Collision, Flight, FreeFlightLeg};
use super::grid::{Coordinates, MeterGrid};
use super::layout::CellLayout;
use super::reading::{Quantity, ReadingAxis, Value};
use super::tagging::Tagging;
use super::tally::Scores;
use crate::frequency_domain::{Factors, FrequencyDomain};
use crate::path::FreeFlightEvent;
use crate::sampling::Sampler;
use crate::sidebands::Sidebands;
use crate::{Bins, Spectrum};
use eikonal::ray::{Arc, LengthAlong};
use glam::{DVec2, DVec3};
use smallvec::{SmallVec, smallvec};

/// Estimator of fluence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// Estimator that scores the lengths of flights.
    TrackLength,
    /// Estimator that scores collisions. It finds no fluence where nothing attenuates.
    Collision,
}

/// Meter of ∫ Φ dV and ∫ μ_a Φ dV.
#[derive(Clone, Debug)]
pub struct FluenceMeter {
    /// Cells of space.
    pub grid: MeterGrid,
    /// Estimator of fluence.
    pub estimator: Estimator,
    /// Bins of the optical path length from the emitter, if the meter separates light by this
    /// length.
    pub optical_length: Option<Bins>,
    /// Weight windows divide and terminate particles, so that late bins of optical length are as
    /// accurate as early ones.
    pub weight_windows: bool,
    /// Sidebands into which the meter separates fluence by the phase shift from sound; `None` if it
    /// does not.
    pub sidebands: Option<Sidebands>,
    /// Frequencies at which the meter measures modulated fluence; `None` if it does not.
    pub frequency_domain: Option<FrequencyDomain>,
}

/// Cuts of one arc; storage that is reused.
pub(super) type Cuts = Vec<f64>;

impl FluenceMeter {
    /// Returns the order of cells. Bins are cells of the grid in gates of optical length; the grid's
    /// cells vary fastest.
    pub(super) fn layout(&self) -> CellLayout {
        let gates = self.optical_length.map_or(1, |gates| gates.count);
        CellLayout {
            totals: 0,
            bins: gates.saturating_mul(self.grid.cells()),
            values: self.values(),
        }
    }

    /// Returns the number of values of a bin.
    #[inline]
    pub(super) fn values(&self) -> usize {
        self.values_at_once() + self.sidebands.map_or(0, |sidebands| sidebands.parts())
    }

    /// Returns the number of values that a bin always receives together: fluence, absorbed power,
    /// and the parts of modulated fluence.
    #[inline]
    pub(super) fn values_at_once(&self) -> usize {
        let frequencies = self.frequency_domain.as_ref();
        2 + frequencies.map_or(0, FrequencyDomain::parts)
    }

    /// Returns the quantities, in the order of slots.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let axes = self
            .optical_length
            .map(|bins| ReadingAxis::optical_length(&bins));
        let axes: Vec<ReadingAxis> = axes
            .into_iter()
            .chain(ReadingAxis::of_grid(&self.grid))
            .collect();
        let different = match self.grid.coordinates() {
            Coordinates::Cartesian => 1,
            Coordinates::Cylindrical | Coordinates::Spherical => self.grid.cells(),
        };
        let volumes: Vec<f64> = (0..different).map(|c| self.grid.volume(c)).collect();
        let layout = self.layout();
        let quantity = |name, value| Quantity {
            name,
            axes: axes.clone(),
            cells: layout.part(value, 1),
            measures: volumes.clone(),
            unsigned: None,
            value: Value::Mean,
        };
        let mut quantities = vec![quantity("fluence", 0), quantity("absorbed", 1)];
        if let Some(domain) = &self.frequency_domain {
            let names = [
                "fluence_in_phase",
                "fluence_quadrature",
                "fluence_amplitude",
                "fluence_phase",
            ];
            let unmodulated = layout.part(0, 1);
            quantities.extend(quantity("fluence", 2).of_frequencies(domain, names, unmodulated));
        }
        if let Some(sidebands) = &self.sidebands {
            let names = ["fluence_sidebands", "fluence_correlation"];
            let parts = quantity("fluence", self.values_at_once());
            quantities.extend(parts.of_parts(sidebands, names));
        }
        quantities
    }

    /// Returns the index of the bin at a point.
    fn locate(&self, x: DVec3, optical_length: f64) -> Option<usize> {
        let gate = match &self.optical_length {
            None => 0,
            Some(gates) => gates.index(optical_length)?,
        };
        Some(gate * self.grid.cells() + self.grid.cell(x)?)
    }

    /// Adds fluence and absorbed power to a bin. `factors` computes the factors of the parts of
    /// modulated fluence.
    #[inline]
    fn score(
        &self,
        bin: usize,
        [fluence, absorbed]: [Spectrum; 2],
        factors: impl FnOnce(&FrequencyDomain) -> Factors,
        slots: &mut Slots,
    ) {
        let cell = bin * self.values();
        let Some(domain) = &self.frequency_domain else {
            for c in 0..slots.channels {
                slots.add_row(cell, c, &[fluence[c], absorbed[c]]);
            }
            return;
        };
        let factors = factors(domain);
        for c in 0..slots.channels {
            let mut row: SmallVec<[f64; 8]> = smallvec![fluence[c], absorbed[c]];
            row.extend(factors.iter().map(|factor| fluence[c] * factor));
            slots.add_row(cell, c, &row);
        }
    }

    /// Adds the parts of the fluence in a bin. `modulation` computes the fluence's modulation from
    /// the random number `u` in [0, 1).
    #[inline]
    fn score_parts(
        &self,
        bin: usize,
        fluence: Spectrum,
        u: f64,
        modulation: impl FnOnce(f64) -> DVec2,
        (dwell, slots): (&mut Option<Dwell>, &mut Slots),
    ) {
        match dwell {
            Some(dwell) if dwell.continues(bin, slots.channels) => {
                dwell.add(fluence, u, modulation)
            }
            _ => {
                let next = Dwell::new(bin, fluence, modulation(u));
                if let Some(last) = dwell.replace(next) {
                    self.score_dwell(&last, slots);
                }
            }
        }
    }

    /// Adds the parts of the fluence in the particle's last cell.
    pub(super) fn end_dwell(&self, scoring: &mut Scoring) {
        if let Some(last) = scoring.dwell.take() {
            self.score_dwell(&last, &mut scoring.slots);
        }
    }

    fn score_dwell(&self, dwell: &Dwell, slots: &mut Slots) {
        if let Some(sidebands) = &self.sidebands {
            let first = dwell.bin * self.values() + self.values_at_once();
            slots.add_parts(first, dwell.fluence, &sidebands.shares(dwell.modulation));
        }
    }

    /// Returns `tagging` if fluence is separated by modulation.
    fn tagged<'t>(&self, tagging: Option<&'t Tagging>) -> Option<&'t Tagging> {
        tagging.filter(|_| self.sidebands.is_some())
    }

    /// Scores a flight along an arc.
    pub(super) fn fly(&self, flight: &Flight, scoring: &mut Scoring) {
        if self.estimator == Estimator::Collision {
            return;
        }
        let tagged = self.tagged(scoring.tagging);
        let Scoring {
            slots,
            cuts,
            sampler,
            dwell,
            ..
        } = scoring;
        // Score w ∫ ds of each piece, eq. (track lengths and collisions).
        let (uniform, segment) = (flight.uniform(), Segment::of(flight));
        self.pieces(&segment, cuts, |bin, piece| {
            let (theta, values) = match uniform {
                Some([power, absorption]) => {
                    let fluence = power * piece.length();
                    (None, [fluence, fluence * absorption])
                }
                None => {
                    let (theta, fluence) = piece.power(flight, sampler);
                    let absorbed = fluence * flight.absorption_at(theta);
                    (Some(theta), [fluence, absorbed])
                }
            };
            let factors = |domain: &FrequencyDomain| match theta {
                Some(theta) => domain.factors(segment.optical_length_at(theta)),
                None => piece.factors(&segment, domain, sampler),
            };
            self.score(bin, values, factors, slots);
            if let Some(tagging) = tagged {
                let place = |u| theta.unwrap_or_else(|| piece.place(&flight.span.arc, u));
                let modulation = |u| tagging.until(place(u));
                let u = sampler.next_1d();
                self.score_parts(bin, values[0], u, modulation, (dwell, slots));
            }
        });
    }

    /// Cuts a flight where it passes from cell to cell, and from gate to gate. Calls `see` with the
    /// cell of each piece, and the piece.
    pub(super) fn pieces_of(
        &self,
        flight: &Flight,
        cuts: &mut Cuts,
        see: impl FnMut(usize, Piece),
    ) {
        self.pieces(&Segment::of(flight), cuts, see);
    }

    /// Scores a leg of a free flight.
    #[inline]
    pub(super) fn fly_freely(&self, free: &FreeFlightLeg, scoring: &mut Scoring) {
        if self.estimator == Estimator::Collision {
            return;
        }
        let tagged = self.tagged(scoring.tagging);
        let Scoring {
            slots,
            cuts,
            sampler,
            dwell,
            ..
        } = scoring;
        let leg = free.leg;
        let segment = Segment {
            arc: &leg.arc,
            theta_end: leg.theta_end,
            // Planted error "gates of free flights by a wrong optical length", found by morgana-io/io::fluorescence::an_infinite_medium_fluoresces_as_in_closed_form:
            // optical_length: free.optical_length - leg.optical_length(),
            optical_length: free.optical_length,
            lengths: Some(leg.lengths),
        };
        self.pieces(&segment, cuts, |bin, piece| {
            let fluence = free.power * piece.length();
            let values = [fluence, fluence * leg.matter.absorption];
            let factors = |domain: &FrequencyDomain| piece.factors(&segment, domain, sampler);
            self.score(bin, values, factors, slots);
            if let Some(tagging) = tagged {
                let modulation = |u| tagging.until(piece.place(&leg.arc, u));
                let u = sampler.next_1d();
                self.score_parts(bin, fluence, u, modulation, (dwell, slots));
            }
        });
    }

    /// Scores the collision at the end of a free flight.
    #[inline]
    pub(super) fn collide_freely(&self, event: &FreeFlightEvent, scoring: &mut Scoring) {
        if self.estimator == Estimator::TrackLength {
            return;
        }
        let (power, flight) = (event.ray.throughput, event.flight);
        let matter = flight.matter();
        if let Some(bin) = self.locate(flight.end, event.optical_length) {
            let fluence = power / matter.extinction[flight.channel];
            let values = [fluence, fluence * matter.absorption];
            self.score_collision(bin, values, event.optical_length, scoring);
        }
    }

    /// Cuts an arc where it passes from cell to cell, and from gate to gate. Calls `see` with the
    /// cell of each piece, and the piece.
    #[inline(never)]
    fn pieces(&self, segment: &Segment, cuts: &mut Cuts, mut see: impl FnMut(usize, Piece)) {
        let Segment { arc, theta_end, .. } = *segment;
        if arc.is_straight() {
            let [length, gain] = arc.lengths(theta_end);
            let line = Line {
                ends: [arc.start(), arc.position(theta_end)],
                length,
                optical_length: [segment.optical_length, segment.optical_length + gain],
                theta_end,
            };
            if self.pieces_of_line(&line, &mut see).is_some() {
                return;
            }
        }
        let lengths = segment.lengths_along();
        if self.pieces_of_curve(segment, &lengths, &mut see).is_some() {
            return;
        }
        cuts.clear();
        self.grid.cut(arc, theta_end, cuts);
        if cuts.is_empty() && self.grid.cell(arc.position(0.5 * theta_end)).is_none() {
            return;
        }
        self.cut_by_length(segment, cuts);
        cuts.push(theta_end);
        cuts.sort_unstable_by(f64::total_cmp);
        // Find the cell of each piece by its midpoint.
        let (mut from, mut before) = (0.0, 0.0);
        for &to in cuts.iter() {
            let length = lengths[0].at(to);
            let middle = 0.5 * (from + to);
            let optical_length = segment.optical_length + lengths[1].at(middle);
            if let Some(bin) = self.locate(arc.position(middle), optical_length) {
                // Planted error "fluence of particles weighted by n²", found by morgana-transport/transport::meters::closed_forms::fluence_in_a_furnace_is_that_of_the_index_squared:
                // let n2 = arc.velocity(0.0).length_squared(); let (theta, lengths) = ([from, to], [before * n2, length * n2]);
                let (theta, lengths) = ([from, to], [before, length]);
                see(bin, Piece { theta, lengths });
            }
            (from, before) = (to, length);
        }
    }

    /// Cuts a straight line of uniform index, like [`pieces`](Self::pieces). Returns `None` if the
    /// grid is not Cartesian.
    #[inline]
    fn pieces_of_line(&self, line: &Line, mut see: impl FnMut(usize, Piece)) -> Option<()> {
        let piece = |shares: [f64; 2]| Piece {
            theta: shares.map(|share| share * line.theta_end),
            lengths: shares.map(|share| share * line.length),
        };
        let Some(bins) = &self.optical_length else {
            return self
                .grid
                .along_line(line.ends, |cell, shares| see(cell, piece(shares)));
        };
        let [first, last] = line.optical_length;
        let optical = |share: f64| first + (last - first) * share;
        self.grid.along_line(line.ends, |cell, [from, to]| {
            let share = |edge: f64| ((edge - first) / (last - first)).clamp(from, to);
            let edges = bins.edges_between(optical(from), optical(to));
            let mut before = from;
            for after in edges.map(share).chain([to]) {
                if let Some(bin) = bins.index(optical(0.5 * (before + after))) {
                    see(bin * self.grid.cells() + cell, piece([before, after]));
                }
                before = after;
            }
        })
    }

    /// Cuts a curved arc, like [`pieces`](Self::pieces). Returns `None` unless the arc runs through
    /// a Cartesian grid almost straight.
    #[inline]
    fn pieces_of_curve(
        &self,
        segment: &Segment,
        [lengths, optical_lengths]: &[LengthAlong; 2],
        mut see: impl FnMut(usize, Piece),
    ) -> Option<()> {
        let piece = |theta: [f64; 2]| Piece {
            theta,
            lengths: theta.map(|theta| lengths.at(theta)),
        };
        let (arc, theta_end) = (segment.arc, segment.theta_end);
        let Some(bins) = &self.optical_length else {
            return self
                .grid
                .along_curve(arc, theta_end, |cell, theta| see(cell, piece(theta)));
        };
        let first = segment.optical_length;
        let optical = |theta: f64| first + optical_lengths.at(theta);
        self.grid.along_curve(arc, theta_end, |cell, [from, to]| {
            let edges = bins.edges_between(optical(from), optical(to));
            let mut before = from;
            let edges = edges.map(|edge| arc.theta_at_optical_length(edge - first).clamp(from, to));
            for after in edges.chain([to]) {
                if let Some(bin) = bins.index(optical(0.5 * (before + after))) {
                    see(bin * self.grid.cells() + cell, piece([before, after]));
                }
                before = after;
            }
        })
    }

    /// Adds the values of θ at which the optical path length passes from bin to bin.
    fn cut_by_length(&self, segment: &Segment, cuts: &mut Cuts) {
        let Some(bins) = &self.optical_length else {
            return;
        };
        let (arc, start) = (segment.arc, segment.optical_length);
        let end = start + arc.optical_length(segment.theta_end);
        let edges = bins.edges_between(start, end);
        let thetas = edges.map(|edge| arc.theta_at_optical_length(edge - start));
        cuts.extend(thetas.filter(|theta| *theta < segment.theta_end));
    }

    /// Scores a collision.
    pub(super) fn collide(&self, collision: &Collision, scoring: &mut Scoring) {
        if self.estimator == Estimator::TrackLength {
            return;
        }
        // Score w/σ_t, eq. (track lengths and collisions).
        if let Some(bin) = self.bin_of(collision) {
            let values = [collision.path, collision.absorbed()];
            self.score_collision(bin, values, collision.optical_length, scoring);
        }
    }

    fn score_collision(
        &self,
        bin: usize,
        values: [Spectrum; 2],
        optical_length: f64,
        scoring: &mut Scoring,
    ) {
        let factors = |domain: &FrequencyDomain| domain.factors(optical_length);
        self.score(bin, values, factors, &mut scoring.slots);
        if let Some(tagging) = self.tagged(scoring.tagging) {
            let Scoring {
                slots,
                sampler,
                dwell,
                ..
            } = scoring;
            let modulation = |_| tagging.path().total();
            let u = sampler.next_1d();
            self.score_parts(bin, values[0], u, modulation, (dwell, slots));
        }
    }

    /// Returns the bin of a collision.
    pub(super) fn bin_of(&self, collision: &Collision) -> Option<usize> {
        self.locate(collision.point.x, collision.optical_length)
    }
}

/// Part of an arc, from θ = 0 on.
#[derive(Clone, Copy, Debug)]
struct Segment<'a> {
    arc: &'a Arc,
    theta_end: f64,
    /// Optical path length from the emitter to the start of the arc.
    optical_length: f64,
    /// Arc length and optical path length along the arc, if they are known.
    lengths: Option<[LengthAlong; 2]>,
}

impl<'a> Segment<'a> {
    fn of(flight: &Flight<'a>) -> Self {
        Segment {
            arc: &flight.span.arc,
            theta_end: flight.theta_end,
            optical_length: flight.optical_length,
            lengths: None,
        }
    }

    /// Returns arc length and optical path length along the arc.
    fn lengths_along(&self) -> [LengthAlong; 2] {
        self.lengths.unwrap_or_else(|| self.arc.lengths_along())
    }

    /// Returns the optical path length from the emitter to θ.
    fn optical_length_at(&self, theta: f64) -> f64 {
        self.optical_length + self.arc.optical_length(theta)
    }
}

/// Straight line in a region of uniform index.
#[derive(Clone, Copy, Debug)]
struct Line {
    ends: [DVec3; 2],
    length: f64,
    /// Optical path lengths from the emitter to the ends of the line.
    optical_length: [f64; 2],
    /// θ at the end; the start has θ = 0.
    theta_end: f64,
}

/// Part of an arc within a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// θ at the start and the end of the piece.
    theta: [f64; 2],
    /// Arc lengths at the start and the end of the piece.
    lengths: [f64; 2],
}

impl Piece {
    fn length(&self) -> f64 {
        let [from, to] = self.lengths;
        to - from
    }

    /// Samples θ of a point, uniformly in arc length, with a random number `u` in [0, 1).
    fn place(&self, arc: &Arc, u: f64) -> f64 {
        if arc.is_straight() {
            let [from, to] = self.theta;
            return from + (to - from) * u;
        }
        let s = self.lengths[0] + self.length() * u;
        arc.theta_between(self.theta, self.lengths, s)
    }

    /// Returns the factors of the parts of modulated fluence: their means along a straight piece, or
    /// the factors at a sampled point of a curved one.
    fn factors(
        &self,
        segment: &Segment,
        domain: &FrequencyDomain,
        sampler: &mut Sampler,
    ) -> Factors {
        if segment.arc.is_straight() {
            return domain
                .factors_between(self.theta.map(|theta| segment.optical_length_at(theta)));
        }
        // The optical length of a curved arc is not linear in its length.
        let theta = self.place(segment.arc, sampler.next_1d());
        domain.factors(segment.optical_length_at(theta))
    }

    /// Samples a point of a flight's piece. Returns its θ, and an unbiased estimate of ∫ power ds
    /// along the piece.
    pub(super) fn power(&self, flight: &Flight, sampler: &mut Sampler) -> (f64, Spectrum) {
        let theta = self.place(&flight.span.arc, sampler.next_1d());
        (theta, flight.power_at(theta) * self.length())
    }
}

/// Destination of the scores of fluence meters, with the data that scoring needs.
pub(super) struct Scoring<'a> {
    pub slots: Slots<'a>,
    pub cuts: &'a mut Cuts,
    pub sampler: &'a mut Sampler,
    /// Effect of sound on the particle, if a meter measures it.
    pub tagging: Option<&'a Tagging>,
    /// Tagged fluence in the last cell.
    pub dwell: &'a mut Option<Dwell>,
}

/// Slots of one meter: cells times channels.
#[derive(Debug)]
pub(super) struct Slots<'a> {
    pub scores: &'a mut Scores,
    pub first: usize,
    pub channels: usize,
}

impl Slots<'_> {
    /// Adds a value to a cell, channel by channel.
    #[inline]
    pub(super) fn add(&mut self, cell: usize, value: Spectrum) {
        for c in 0..self.channels {
            self.scores
                .add(self.first + cell * self.channels + c, value[c]);
        }
    }

    /// Adds a value, times the fraction of each part, to the cells of its parts, the first of which
    /// is given.
    pub(super) fn add_parts(&mut self, first: usize, value: Spectrum, shares: &[f64]) {
        let parts = |c| shares.iter().map(|share| value[c] * share).collect();
        for c in 0..self.channels {
            let values: SmallVec<[f64; 8]> = parts(c);
            self.add_row(first, c, &values);
        }
    }

    /// Adds values in one channel to the cells from `first` on, which always receive values
    /// together.
    #[inline]
    fn add_row(&mut self, first: usize, channel: usize, values: &[f64]) {
        let slot = self.first + first * self.channels + channel;
        self.scores.add_row(slot, self.channels, values);
    }
}
