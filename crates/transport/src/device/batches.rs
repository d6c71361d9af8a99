//! Batches of particles that a device walks: each is one sample of every mean
//! (docs/theory.md#particles-on-a-device).

use super::hand_over::HandOver;
use super::{BatchSums, Device, DeviceError, DeviceRay, DeviceVolume, DeviceWalk, WalkLimits};
use crate::meter::{Setup, TaskResult, TaskSums};
use crate::path::{BalanceSums, ParticleBalance};
use crate::sampling::Sampler;
use crate::stats::Stats;
use crate::stop::Stop;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Number of batches at which a run aims: their differences tell errors to about 9 %.
const BATCHES: u64 = 64;
/// Smallest number of particles of a batch.
const MIN_BATCH: u64 = 64;
/// Largest number of particles of a batch: its particles take 64 MiB.
const MAX_BATCH: u64 = 1 << 20;
/// Number of particles that determines the size of batches in a run without a known total.
const UNKNOWN_TOTAL: u64 = 1 << 22;
/// Largest relative difference, by rounding, between emitted power and its destinations.
const MAX_IMBALANCE: f64 = 1e-4;
/// Most particles that are emitted before a device walks them.
const MAX_EMITTED: u64 = 1 << 21;
/// Number of values of each bin of the fluence meter: fluence and absorbed power.
const VALUES: usize = 2;

/// Device, and the size of the batches of particles that it walks.
#[derive(Clone, Debug)]
pub struct DeviceRun {
    /// Device.
    pub device: Arc<dyn Device>,
    /// Number of particles of a batch, a power of two from 64 to 2²⁰.
    pub batch: u64,
}

impl DeviceRun {
    /// Chooses the size of batches for a run of `total` particles; `None` if the total is unknown.
    pub fn new(device: Arc<dyn Device>, total: Option<u64>) -> Self {
        let wanted = total.unwrap_or(UNKNOWN_TOTAL) / BATCHES;
        DeviceRun {
            device,
            batch: 1 << wanted.clamp(MIN_BATCH, MAX_BATCH).ilog2(),
        }
    }
}

/// Volume of a group of channels on a device.
#[derive(Debug)]
pub(crate) struct DeviceBatches {
    name: String,
    volume: DeviceVolume,
    walk: Box<dyn DeviceWalk>,
    /// Particles of a batch.
    batch: u64,
}

/// Particles of a batch before the device walks them.
struct EmittedBatch {
    rays: Vec<DeviceRay>,
    /// Power that misses the volume.
    missed: f64,
    /// Power of the rays.
    power: f64,
}

impl DeviceBatches {
    /// Loads the volume of a group.
    pub(crate) fn new(
        setup: &Setup,
        run: &DeviceRun,
        limits: WalkLimits,
    ) -> Result<Self, DeviceError> {
        let volume = DeviceVolume::of(setup.scene(), setup.meters(), setup.channels())?;
        Ok(DeviceBatches {
            name: run.device.name().to_owned(),
            walk: run.device.load(&volume, limits)?,
            volume,
            batch: run.batch,
        })
    }

    /// Follows a range of particles, whose ends are multiples of the size of batches. Returns the
    /// result of each batch.
    pub(crate) fn follow(
        &self,
        setup: &Setup,
        seed: u64,
        particles: Range<u64>,
        stop: &Stop,
    ) -> Result<(Vec<TaskResult>, Stats), DeviceError> {
        let (mut results, mut stats) = (Vec::new(), Stats::default());
        let firsts: Vec<u64> = particles.step_by(self.batch as usize).collect();
        let most = (MAX_EMITTED / self.batch).max(1) as usize;
        for firsts in firsts.chunks(self.walk.max_batches().min(most)) {
            let emit = |(batch, first): (usize, &u64)| self.emit(setup, seed, *first, batch as u32);
            let emitted: Vec<EmittedBatch> = firsts.par_iter().enumerate().map(emit).collect();
            let rays = emitted.iter().flat_map(|batch| &batch.rays);
            let rays: Vec<DeviceRay> = rays.copied().collect();
            let sums = self.walk.walk(&rays, emitted.len(), stop)?;
            if stop.is_raised() {
                break;
            }
            for (emitted, sums) in emitted.iter().zip(&sums) {
                self.check(emitted, sums)?;
                self.count(sums, &mut stats);
            }
            let result = |(emitted, sums)| self.result(setup, emitted, sums);
            results.par_extend(emitted.par_iter().zip(&sums).map(result));
        }
        Ok((results, stats))
    }

    /// Counts the events of a batch.
    fn count(&self, sums: &BatchSums, stats: &mut Stats) {
        stats.paths += self.batch;
        stats.edges += sums.segments;
        stats.in_cells += sums.segments;
        stats.lost += sums.lost_particles;
        stats.over_budget.rays += sums.lost_particles;
    }

    /// Emits the particles of a batch.
    fn emit(&self, setup: &Setup, seed: u64, first: u64, batch: u32) -> EmittedBatch {
        let power = setup.power_of_sources()[0];
        let mut emitted = EmittedBatch {
            rays: Vec::with_capacity(self.batch as usize),
            missed: 0.0,
            power: 0.0,
        };
        for number in first..first + self.batch {
            let mut sampler = Sampler::new(seed, 0, number);
            let Some(ray) = setup.emit(number, &mut sampler) else {
                continue;
            };
            match self.volume.hand_over(&ray.1, power, &mut sampler) {
                HandOver::Miss(weight) => emitted.missed += weight,
                HandOver::Ray(ray) => {
                    emitted.power += f64::from(ray.weight);
                    emitted.rays.push(DeviceRay { batch, ..ray });
                }
            }
        }
        emitted
    }

    /// Checks that all power has arrived somewhere: drivers may end loops without a word.
    fn check(&self, emitted: &EmittedBatch, sums: &BatchSums) -> Result<(), DeviceError> {
        let (emitted, found) = (emitted.power, sums.power());
        // Rounding of single weights adds up with their number only if they are large.
        let scale = emitted + sums.boosted;
        if (found - emitted).abs() <= MAX_IMBALANCE * scale {
            return Ok(());
        }
        Err(DeviceError::LostPower {
            name: self.name.clone(),
            emitted: format!("{emitted:.6e}"),
            found: format!("{found:.6e}"),
        })
    }

    /// Returns the means over the particles of a batch as one sample.
    fn result(&self, setup: &Setup, emitted: &EmittedBatch, sums: &BatchSums) -> TaskResult {
        let power = setup.power_of_sources()[0] / self.batch as f64;
        let value = |i: usize| {
            let (slot, is_absorbed) = (i / VALUES, i % VALUES == 1);
            let fluence = sums.fluence[slot] * self.volume.unit * power;
            // Most voxels of a large volume are dark in a batch.
            if is_absorbed && fluence > 0.0 {
                fluence * self.volume.absorption(slot)
            } else {
                fluence
            }
        };
        let balance = ParticleBalance {
            media: sums.absorbed * power,
            escaped: (sums.escaped + emitted.missed) * power,
            cut: sums.cut * power,
            lost: sums.lost * power,
            ..ParticleBalance::default()
        };
        let mut balances = BalanceSums::default();
        balances.add(&balance, &mut 0);
        TaskResult {
            sums: TaskSums::of_sample(VALUES * sums.fluence.len(), value),
            balance: balances,
            records: Vec::new(),
        }
    }
}
