//! Scores of walks through voxels. The scores in a voxel's cell are added up until the particle
//! reaches another voxel or gate (docs/theory.md#walks-through-cells).

use super::Meter;
use super::fluence::{Estimator, FluenceMeter};
use super::tally::Scores;
use crate::frequency_domain::FrequencyDomain;
use crate::path::{CellDetail, CellRun};
use crate::scene::CellVolume;
use smallvec::{SmallVec, smallvec};

/// Fluence meter, with the scores of a particle since it entered its current voxel and gate.
#[derive(Clone, Debug)]
pub(super) struct VoxelScore<'m> {
    meter: &'m FluenceMeter,
    /// First slot of the meter in a tally of one channel.
    first: usize,
    /// Index of the voxel; `slot` is the slot of its fluence, if the particle is in a gate.
    voxel: usize,
    slot: Option<usize>,
    /// Optical path lengths at the start and end of the gate.
    gate: [f64; 2],
    /// Integral ∫ power ds in the voxel and gate.
    fluence: f64,
    /// Absorption coefficient.
    absorption: f64,
    /// Parts of modulated fluence.
    modulated: SmallVec<[f64; 6]>,
}

/// Returns the flights through a volume of cells that meters need to see: all of them if a meter
/// keeps records, observes the faces of the volume or more than track lengths.
pub(super) fn detail_in(meters: &[Meter], volume: &CellVolume) -> CellDetail {
    let of_meter = |meter: &Meter| match meter {
        Meter::Fluence(meter) => meter.detail_in(volume),
        Meter::Irradiance(meter) => {
            let sees_none = meter.most_records.is_none() && !meter.measures_faces_of(volume);
            if sees_none {
                CellDetail::Cells
            } else {
                CellDetail::Edges
            }
        }
    };
    let details = meters.iter().map(of_meter);
    details.min().unwrap_or(CellDetail::Cells)
}

impl FluenceMeter {
    /// Returns the flights through a volume of cells that the meter needs to see.
    fn detail_in(&self, volume: &CellVolume) -> CellDetail {
        if self.estimator != Estimator::TrackLength || self.sidebands.is_some() {
            return CellDetail::Edges;
        }
        match volume {
            CellVolume::Voxels(voxels) if self.grid.is_voxels_of(voxels) => CellDetail::Cells,
            _ => CellDetail::Runs,
        }
    }

    /// Returns the gate of light that continues from an optical path length, and the lengths at the
    /// gate's start and end. Before or after all gates the gate is `None`, and the lengths are
    /// the ends of this range.
    fn gate_from(&self, optical_length: f64) -> (Option<usize>, [f64; 2]) {
        let always = [f64::NEG_INFINITY, f64::INFINITY];
        let Some(bins) = &self.optical_length else {
            return (Some(0), always);
        };
        let edge = |i: usize| bins.min + bins.width() * i as f64;
        if optical_length < bins.min {
            return (None, [always[0], bins.min]);
        }
        let position = ((optical_length - bins.min) / bins.width()) as usize;
        // Rounding may put the length into the next gate.
        let bin = position + usize::from(optical_length >= edge(position.saturating_add(1)));
        if bin >= bins.count {
            return (None, [edge(bins.count), always[1]]);
        }
        (Some(bin), [edge(bin), edge(bin + 1)])
    }
}

impl<'m> VoxelScore<'m> {
    /// Creates empty scores for each fluence meter; the setup must have one channel.
    pub(super) fn of(meters: &'m [Meter]) -> Vec<Self> {
        let mut first = 0;
        let score = |meter: &'m Meter| {
            let at = first;
            first += meter.cells();
            match meter {
                Meter::Fluence(meter) => Some(VoxelScore::new(meter, at)),
                Meter::Irradiance(_) => None,
            }
        };
        meters.iter().filter_map(score).collect()
    }

    fn new(meter: &'m FluenceMeter, first: usize) -> Self {
        let frequencies = meter.frequency_domain.as_ref();
        VoxelScore {
            meter,
            first,
            voxel: usize::MAX,
            slot: None,
            gate: [0.0; 2],
            fluence: 0.0,
            absorption: 0.0,
            modulated: smallvec![0.0; frequencies.map_or(0, FrequencyDomain::parts)],
        }
    }

    /// Scores a flight within a voxel.
    #[inline]
    pub(super) fn fly(&mut self, voxel: usize, flight: &CellRun, scores: &mut Scores) {
        let (begin, end) = (flight.optical_length, flight.length_after());
        let same_gate = begin >= self.gate[0] && end <= self.gate[1];
        if self.voxel == voxel && same_gate {
            let power = flight.power[flight.channel];
            self.add(power * flight.length, [begin, end]);
        } else {
            self.begin(voxel, flight, scores);
        }
    }

    /// Scores a flight in a new voxel or gate.
    fn begin(&mut self, voxel: usize, flight: &CellRun, scores: &mut Scores) {
        let (begin, end) = (flight.optical_length, flight.length_after());
        let (meter, power) = (self.meter, flight.power[flight.channel]);
        let mut from = begin;
        loop {
            self.end(scores);
            let (gate, ends) = meter.gate_from(from);
            let to = end.min(ends[1]);
            let share = if end > begin {
                // Planted error "flights through several gates scored whole in each", found by morgana-io/io::cell_walks::walks_through_cells_agree_with_walks_by_edges:
                // 1.0
                (to - from) / (end - begin)
            } else {
                1.0
            };
            self.voxel = voxel;
            self.slot =
                gate.map(|gate| self.first + (gate * meter.grid.cells() + voxel) * meter.values());
            self.gate = ends;
            self.add(power * flight.length * share, [from, to]);
            self.absorption = flight.matter.absorption[flight.channel];
            if end <= to {
                return;
            }
            from = to;
        }
    }

    /// Adds fluence between two optical path lengths to the scores in the voxel.
    #[inline]
    fn add(&mut self, fluence: f64, optical_lengths: [f64; 2]) {
        self.fluence += fluence;
        if let Some(domain) = &self.meter.frequency_domain {
            domain.add_between(optical_lengths, fluence, &mut self.modulated);
        }
    }

    /// Adds the scores in the last voxel to the task's scores.
    #[inline]
    pub(super) fn end(&mut self, scores: &mut Scores) {
        if let Some(slot) = self.slot {
            let values = [self.fluence, self.fluence * self.absorption];
            if self.modulated.is_empty() {
                scores.add_row(slot, 1, &values);
            } else {
                let mut row: SmallVec<[f64; 8]> = SmallVec::from_slice(&values);
                row.extend_from_slice(&self.modulated);
                scores.add_row(slot, 1, &row);
            }
        }
        self.slot = None;
        self.voxel = usize::MAX;
        self.fluence = 0.0;
        self.modulated.fill(0.0);
    }
}
