//! Measurements by particles on several threads. Results depend on the seed only
//! (docs/theory.md#meters).

use super::accumulator::{Accumulated, Accumulator, Sampling};
use super::measurement::{MeasureError, MeasureOptions, Measurement, join};
use super::{Handle, seed_of_group};
use crate::device::{DeviceBatches, DeviceError, DeviceRun, WalkLimits};
use crate::meter::{
    Meter, RecordTable, Records, Setup, Tally, TaskResult, Window, with_excitations,
};
use crate::path::{EnergyBalance, Share, Workspace};
use crate::scene::{NO_SCENE, Scene};
use crate::stats::Stats;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::{ControlFlow, Range};
use std::sync::{Arc, OnceLock};

const PARTICLES_PER_TASK: u64 = MeasureOptions::UNIT;
/// Maximum number of tasks whose results are kept until they are added up.
const MAX_TASKS: u64 = 1 << 10;
/// Maximum number of particles of a pass on a device.
const MAX_DEVICE_PASS: u64 = 1 << 22;

/// Measures on the current thread pool. `scenes` holds one scene for each group of channels. The
/// scenes are alike except for their spectra and indices; their film gives the number of channels.
/// `handle` counts particles, and can end the measurement within a pass.
///
/// `on_pass` is called between passes with the number of particles done. When it breaks, the
/// measurement stops with the particles done so far.
///
/// # Errors
/// If a meter does not fit the scene, no light is emitted, or memory is insufficient.
///
/// # Panics
/// If there are no scenes.
pub fn measure(
    scenes: &[Scene],
    meters: &[Meter],
    options: &MeasureOptions,
    handle: &Handle,
    mut on_pass: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Measurement, MeasureError> {
    let mut state = MeasureState::new(scenes, meters)?;
    state.advance(scenes, meters, options, handle, |state| {
        on_pass(state.done().count())
    })?;
    state.into_measurement(scenes, meters)
}

/// Sums over the particles of a measurement so far. They can be kept, continued, and merged with
/// others, like the [`State`](super::State) of a picture.
pub type MeasureState = Accumulator<Readings>;

/// Accumulated readings of meters, for each group of channels.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Readings {
    tallies: Vec<Tally>,
    /// Records of each meter that keeps them, by group of channels and meter.
    records: Vec<Vec<Option<Records>>>,
}

impl Accumulated for Readings {
    /// Weight window of a group's particles, if its meters have one.
    type Learnt = Option<Window>;

    fn is_like(&self, other: &Readings) -> bool {
        let slots = self.tallies.iter().map(Tally::slots);
        slots.eq(other.tallies.iter().map(Tally::slots))
            && same_records(&other.records, &self.records)
    }

    fn merge(&mut self, other: &Readings) {
        for (tally, other) in self.tallies.iter_mut().zip(&other.tallies) {
            tally.merge(other);
        }
        let records = self.records.iter_mut().flatten().flatten();
        let others = other.records.iter().flatten().flatten();
        records
            .zip(others)
            .for_each(|(mine, other)| mine.merge(other));
    }
}

impl MeasureState {
    /// Creates a state without particles.
    ///
    /// # Errors
    /// If a meter does not fit the scene, no light is emitted, or memory is insufficient.
    ///
    /// # Panics
    /// If there are no scenes.
    pub fn new(scenes: &[Scene], meters: &[Meter]) -> Result<Self, MeasureError> {
        let scene = scenes.first().expect(NO_SCENE);
        for (number, meter) in meters.iter().enumerate() {
            let checked = meter.check(scene);
            checked.map_err(|problem| MeasureError::Meter { number, problem })?;
        }
        let tally = |group: Group| {
            let slots = group.setup.slots();
            let tally = Some(slots).filter(|n| *n <= Tally::MAX_SLOTS);
            let tally = tally.and_then(Tally::new);
            tally.ok_or(MeasureError::Memory(Tally::memory(slots)))
        };
        let groups = groups(scenes, meters, u32::MAX, 0)?;
        let readings = Readings {
            records: groups.iter().map(|g| g.setup.records()).collect(),
            tallies: groups.into_iter().map(tally).collect::<Result<_, _>>()?,
        };
        Ok(Accumulator::empty(scenes.len(), readings))
    }

    /// Returns true if this can be the state of a measurement of these scenes with these meters,
    /// with any particles.
    pub fn fits(&self, scenes: &[Scene], meters: &[Meter]) -> bool {
        let groups = groups(scenes, meters, u32::MAX, 0).unwrap_or_default();
        let slots = groups.iter().map(|g| g.setup.slots());
        let records: Vec<_> = groups.iter().map(|g| g.setup.records()).collect();
        self.has_groups(scenes.len())
            && same_records(&self.sums.records, &records)
            && slots.eq(self.sums.tallies.iter().map(Tally::slots))
    }

    /// Follows the missing particles of the options' range on the current thread pool; see
    /// [`measure()`].
    ///
    /// # Errors
    /// If no light is emitted.
    ///
    /// # Panics
    /// If the state does not [fit](MeasureState::fits).
    pub fn advance(
        &mut self,
        scenes: &[Scene],
        meters: &[Meter],
        options: &MeasureOptions,
        handle: &Handle,
        on_pass: impl FnMut(&MeasureState) -> ControlFlow<()>,
    ) -> Result<(), MeasureError> {
        self.advance_on(None, scenes, meters, options, handle, on_pass)
    }

    /// Follows particles like [`MeasureState::advance`], on a device if one is given. A state holds
    /// the particles of batches of one size only, or of none.
    ///
    /// # Errors
    /// If no light is emitted, the scene does not suit the device, or the device fails.
    ///
    /// # Panics
    /// If the state does not [fit](MeasureState::fits).
    pub fn advance_on(
        &mut self,
        device: Option<&DeviceRun>,
        scenes: &[Scene],
        meters: &[Meter],
        options: &MeasureOptions,
        handle: &Handle,
        on_pass: impl FnMut(&MeasureState) -> ControlFlow<()>,
    ) -> Result<(), MeasureError> {
        let max_depth = options.max_depth.unwrap_or(u32::MAX);
        let groups = groups(scenes, meters, max_depth, options.rr_depth)?;
        assert!(
            self.fits(scenes, meters),
            "the state is not one of a measurement of these scenes with these meters"
        );
        let window = |group: &Group| group.setup.window(handle.stop());
        let pilot = || {
            // Use default options for the window, so that states of other ranges and depths have
            // equal windows. `groups` succeeded above, so there is light.
            let whole = self::groups(scenes, meters, u32::MAX, 0);
            whole.iter().flatten().map(window).collect()
        };
        if self.run_pilot(handle, pilot).is_break() {
            return Ok(());
        }
        let windows = self.learnt.iter().cloned();
        let groups = groups.into_iter().zip(windows);
        let groups: Vec<Group> = groups.map(|(group, window)| group.within(window)).collect();
        let limits = WalkLimits {
            max_depth,
            rr_depth: options.rr_depth,
        };
        let load = |device: &DeviceRun| {
            let load = |group: &Group| DeviceBatches::new(&group.setup, device, limits);
            groups.iter().map(load).collect::<Result<Vec<_>, _>>()
        };
        let particles = ParticlePasses {
            devices: device.map(load).transpose()?,
            unit: device.map_or(PARTICLES_PER_TASK, |device| device.batch),
            groups,
            seed: options.seed,
            handle,
            failure: OnceLock::new(),
        };
        self.take(
            options.range_by(particles.unit),
            &particles,
            handle,
            on_pass,
        );
        match particles.failure.into_inner() {
            Some(failure) => Err(failure.into()),
            None => Ok(()),
        }
    }

    /// Returns the result. `scenes` and `meters` must be those that were measured.
    ///
    /// # Errors
    /// If no light is emitted.
    pub fn into_measurement(
        self,
        scenes: &[Scene],
        meters: &[Meter],
    ) -> Result<Measurement, MeasureError> {
        let groups = groups(scenes, meters, u32::MAX, 0)?;
        let records = (0..meters.len()).map(|meter| self.records_of(&groups, meter));
        let records = records.collect();
        let readings = groups.iter().zip(self.sums.tallies);
        let readings = readings.map(|(g, tally)| (g.setup.readings(tally), g.channels));
        let mut balance = EnergyBalance::default();
        for (group, balances) in groups.iter().zip(&self.balances) {
            balance += balances.balance(Share {
                mean: group.setup.emitted().sum(),
                error: group.setup.emitted_error().sum(),
            });
        }
        Ok(Measurement {
            readings: join(readings.collect()),
            records,
            emitted: groups.iter().flat_map(Group::emitted).collect(),
            emitted_error: groups.iter().flat_map(Group::emitted_error).collect(),
            balance,
            stats: self.stats,
            particles: self.done.count(),
        })
    }

    /// Returns the records of a meter in all groups of channels, of the particles whose records all
    /// groups have kept.
    fn records_of(&self, groups: &[Group], meter: usize) -> Option<RecordTable> {
        let by_group: Option<Vec<&Records>> = self
            .sums
            .records
            .iter()
            .map(|r| r[meter].as_ref())
            .collect();
        let by_group = by_group?;
        let share = Records::common_share(&by_group);
        let table = |(group, records): (&Group, &Records)| {
            let followed = self.done.iter().flatten();
            (
                group.setup.record_table(records, share, followed),
                group.channels,
            )
        };
        RecordTable::joined(groups.iter().zip(by_group).map(table).collect())
    }
}

/// Passes of a measurement over its particles.
struct ParticlePasses<'a> {
    groups: Vec<Group<'a>>,
    /// Volumes of the groups on a device, if a device walks the particles.
    devices: Option<Vec<DeviceBatches>>,
    /// Number of particles that are added up together.
    unit: u64,
    seed: u64,
    handle: &'a Handle,
    /// Failure of the device, which ends the measurement.
    failure: OnceLock<DeviceError>,
}

impl ParticlePasses<'_> {
    /// Lets a device follow a range of particles. Its failure ends the measurement.
    fn pass_on(&self, devices: &[DeviceBatches], particles: &Range<u64>) -> Vec<Pass> {
        let follow = |(group, device): (&Group, &DeviceBatches)| {
            let seed = seed_of_group(self.seed, group.index);
            device.follow(&group.setup, seed, particles.clone(), self.handle.stop())
        };
        let passes = self.groups.iter().zip(devices).map(follow);
        let passes: Result<Vec<_>, _> = passes.collect();
        match passes {
            Ok(passes) => {
                let groups = self.groups.len() as u64;
                self.handle
                    .count((particles.end - particles.start) * groups);
                let pass = |(tasks, stats)| Pass { tasks, stats };
                passes.into_iter().map(pass).collect()
            }
            Err(failure) => {
                let _ = self.failure.set(failure);
                self.handle.end_now();
                Vec::new()
            }
        }
    }
}

impl Sampling for ParticlePasses<'_> {
    type Sums = Readings;
    type Found = Vec<Pass>;

    fn pass_size(&self, _: &MeasureState, _: u64, next: u64) -> u64 {
        let most = (MAX_TASKS * PARTICLES_PER_TASK).max(self.unit);
        let most = match self.devices {
            Some(_) => most.max(MAX_DEVICE_PASS),
            None => most,
        };
        next.next_multiple_of(self.unit).min(most)
    }

    fn pass(&self, _: &Readings, particles: Range<u64>) -> Vec<Pass> {
        match &self.devices {
            Some(devices) => self.pass_on(devices, &particles),
            None => {
                let follow = |group: &Group| group.pass(self.seed, particles.clone(), self.handle);
                self.groups.iter().map(follow).collect()
            }
        }
    }

    fn add(&self, state: &mut MeasureState, found: Vec<Pass>) {
        for (group, pass) in found.into_iter().enumerate() {
            let sums: Vec<_> = pass.tasks.iter().map(|task| &task.sums).collect();
            let particles = pass.tasks.len() as u64 * self.unit;
            let samples = match self.devices {
                Some(_) => pass.tasks.len() as u64,
                None => particles,
            };
            state.sums.tallies[group].add(&sums, samples, particles);
            for task in &pass.tasks {
                state.balances[group].enter(&task.balance);
                let records = state.sums.records[group].iter_mut().zip(&task.records);
                for (records, rows) in records {
                    if let Some(records) = records {
                        records.add(rows);
                    }
                }
            }
            state.stats += pass.stats;
        }
    }
}

/// Results of a range of particles in one group of channels, one per task.
struct Pass {
    tasks: Vec<TaskResult>,
    stats: Stats,
}

/// Data of a group of channels.
struct Group<'a> {
    index: usize,
    setup: Setup<'a>,
    scene: &'a Scene,
    channels: usize,
}

/// Creates all groups, for paths of at most `max_depth` edges and Russian roulette after `rr_depth`
/// edges.
fn groups<'a>(
    scenes: &'a [Scene],
    meters: &'a [Meter],
    max_depth: u32,
    rr_depth: u32,
) -> Result<Vec<Group<'a>>, MeasureError> {
    let channels_of = |index: usize| scenes[index].film().channels_of(index);
    let setup = |(index, scene): (usize, &'a Scene)| {
        let channels = channels_of(index);
        Setup::new(scene, meters, channels, max_depth, rr_depth)
    };
    let mut setups: Vec<Setup> = scenes.iter().enumerate().map(setup).collect();
    if scenes.iter().any(Scene::fluoresces) {
        if (0..scenes.len()).any(|index| channels_of(index) != 1) {
            return Err(MeasureError::SharedPaths);
        }
        let excited = with_excitations(setups)?;
        setups = excited.into_iter().map(Arc::unwrap_or_clone).collect();
    }
    let group = |(index, setup): (usize, Setup<'a>)| {
        if setup.is_dark() {
            return Err(MeasureError::Dark);
        }
        Ok(Group {
            index,
            setup,
            scene: &scenes[index],
            channels: channels_of(index),
        })
    };
    setups.into_iter().enumerate().map(group).collect()
}

impl Group<'_> {
    /// Restricts the group's particles to a weight window.
    fn within(self, window: Option<Window>) -> Self {
        Group {
            setup: self.setup.within(window),
            ..self
        }
    }

    /// Follows a range of particles.
    fn pass(&self, seed: u64, particles: Range<u64>, handle: &Handle) -> Pass {
        let seed = seed_of_group(seed, self.index);
        let count = particles.end - particles.start;
        let task = |i: usize| {
            let first = particles.start + i as u64 * PARTICLES_PER_TASK;
            let mut ws = Workspace::new(self.scene.tolerance());
            ws.stop = handle.stop().clone();
            let result = self
                .setup
                .task(seed, first..first + PARTICLES_PER_TASK, &mut ws);
            handle.count(PARTICLES_PER_TASK);
            (result, ws.stats())
        };
        let tasks = (0..(count / PARTICLES_PER_TASK) as usize).into_par_iter();
        let (tasks, stats): (Vec<TaskResult>, Vec<Stats>) = tasks.with_max_len(1).map(task).unzip();
        let stats = stats.into_iter().fold(Stats::default(), |mut sum, s| {
            sum += s;
            sum
        });
        Pass { tasks, stats }
    }

    fn emitted(&self) -> Vec<f64> {
        self.setup.power_of_sources().0[..self.channels].to_vec()
    }

    fn emitted_error(&self) -> Vec<f64> {
        self.setup.error_of_sources().0[..self.channels].to_vec()
    }
}

/// Returns true if both have records of the same meters with equal layouts.
fn same_records(records: &[Vec<Option<Records>>], others: &[Vec<Option<Records>>]) -> bool {
    let alike = |(a, b): (&Option<Records>, &Option<Records>)| match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => a.fits(b),
        _ => false,
    };
    let groups = records.iter().zip(others);
    records.len() == others.len()
        && groups
            .into_iter()
            .all(|(a, b)| a.len() == b.len() && a.iter().zip(b).all(alike))
}
