//! Scores of walks through voxels: what a particle leaves in the cell of the voxel that it is in is added up until it gets to another voxel
//! or gate (docs/theory.md#walks-through-voxels).

use super::fluence::{Estimator, FluenceMeter, Slots};
use crate::path::VoxelFlight;
use crate::scene::VoxelVolume;

/// What a particle has left for one meter since it came to a voxel and gate.
#[derive(Clone, Copy, Debug)]
pub(super) struct VoxelScore {
    /// The voxel, and the cell of fluence, if it is in a gate.
    voxel: usize,
    cell: Option<usize>,
    /// Optical path lengths between which the gate lies.
    gate: [f64; 2],
    /// ∫ power ds.
    fluence: f64,
    /// Absorption coefficient.
    absorption: f64,
}

impl Default for VoxelScore {
    fn default() -> Self {
        VoxelScore {
            voxel: usize::MAX,
            cell: None,
            gate: [0.0; 2],
            fluence: 0.0,
            absorption: 0.0,
        }
    }
}

impl FluenceMeter {
    /// Whether its cells are the voxels of a volume, in which it counts the ways that particles fly.
    pub(super) fn counts_voxels(&self, volume: &VoxelVolume) -> bool {
        self.estimator == Estimator::TrackLength && self.grid.is_voxels_of(volume)
    }

    /// Takes note of a flight within a voxel.
    #[inline]
    pub(super) fn fly_in_voxel(
        &self,
        flight: &VoxelFlight,
        score: &mut VoxelScore,
        slots: &mut Slots,
    ) {
        let (begin, power) = (flight.optical_length, flight.power);
        let end = begin + flight.matter.n * flight.length;
        let same_gate = begin >= score.gate[0] && end <= score.gate[1];
        if score.voxel != flight.voxel || !same_gate {
            self.begin_in_voxel(flight, score, slots, [begin, end]);
            return;
        }
        score.fluence += power * flight.length;
    }

    /// The same where the voxel or the gate is another than before.
    fn begin_in_voxel(
        &self,
        flight: &VoxelFlight,
        score: &mut VoxelScore,
        slots: &mut Slots,
        [begin, end]: [f64; 2],
    ) {
        let mut from = begin;
        loop {
            self.end_in_voxel(score, slots);
            let (bin, gate) = self.gate_from(from);
            let to = end.min(gate[1]);
            let share = if end > begin {
                (to - from) / (end - begin)
            } else {
                1.0
            };
            *score = VoxelScore {
                voxel: flight.voxel,
                cell: bin.map(|bin| bin * self.grid.cells() + flight.voxel),
                gate,
                fluence: flight.power * flight.length * share,
                absorption: flight.matter.absorption[flight.channel],
            };
            if end <= to {
                return;
            }
            from = to;
        }
    }

    /// Adds what has been left in the last voxel.
    #[inline]
    pub(super) fn end_in_voxel(&self, score: &mut VoxelScore, slots: &mut Slots) {
        let VoxelScore {
            cell,
            fluence,
            absorption,
            ..
        } = std::mem::take(score);
        if let Some(cell) = cell {
            self.score_one(cell, [fluence, fluence * absorption], slots);
        }
    }

    /// The gate in which light is that goes on from an optical path length, and the lengths between which it, or the time before or
    /// after all gates, lies.
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
        // By rounding it may be in the gate beyond.
        let bin = if optical_length >= edge(position + 1) {
            position + 1
        } else {
            position
        };
        if bin >= bins.count {
            return (None, [edge(bins.count), always[1]]);
        }
        (Some(bin), [edge(bin), edge(bin + 1)])
    }
}
