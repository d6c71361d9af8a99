//! Measuring: particles spread over threads, with results that depend on the seed alone (docs/theory.md#meters).

use super::passes::Passes;
use super::state::MergeError;
use super::{Handle, Ranges, seed_of_group};
use crate::meter::{
    Meter, MeterProblem, Reading, RecordTable, Records, Setup, Tally, TaskResult, Window,
};
use crate::path::{BalanceTotals, EnergyBalance, Share, Workspace};
use crate::scene::{NO_SCENE, Scene};
use crate::sparse::Sparse;
use crate::stats::Stats;
use crate::sum::ReproducibleSum;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::{ControlFlow, Range};

/// Particles per task. The sums of a task are rounded on their own, so tasks are always the same particles.
const TASK: u64 = 64;
/// Most tasks that are kept before they are added up.
const MOST_TASKS: u64 = 1 << 10;

/// How a measurement is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasureOptions {
    /// Number of the first particle, rounded up to a multiple of [`MeasureOptions::UNIT`]; not 0 if this measurement is
    /// part of a larger one.
    pub first: u64,
    /// Particles, for each group of channels; the last one's number is rounded likewise. A tally has room for the numbers
    /// below [`MeasureOptions::MOST`]: a measurement ends there.
    pub particles: u64,
    /// Seed: the same seed gives the same readings, bit for bit, for any number of threads.
    pub seed: u64,
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and events after which Russian roulette begins.
    pub rr_depth: u32,
}

impl MeasureOptions {
    /// Particles are followed in so many at a time.
    pub const UNIT: u64 = TASK;
    /// Most particles that can be followed.
    pub const MOST: u64 = TASK * ReproducibleSum::MOST;

    /// Numbers of the particles.
    pub fn range(&self) -> Range<u64> {
        let whole = |n: u64| n.min(Self::MOST).next_multiple_of(TASK);
        whole(self.first)..whole(self.first.saturating_add(self.particles))
    }
}

/// What a measurement gives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measurement {
    /// For each meter, what it has measured, with the channels of all groups. Absolute: in the units of
    /// the emitters' power.
    pub readings: Vec<Vec<Reading>>,
    /// For each meter, the records of the light that it has accepted, if it keeps any.
    pub records: Vec<Option<RecordTable>>,
    /// Power of all emitters, per channel.
    pub emitted: Vec<f64>,
    /// Standard errors of `emitted`; zero unless a medium emits whose power had to be estimated.
    pub emitted_error: Vec<f64>,
    /// Where the light went, summed over channels.
    pub balance: EnergyBalance,
    /// What happened.
    pub stats: Stats,
    /// Particles followed, per channel group: fewer than asked for if the measurement was stopped.
    pub particles: u64,
}

/// Why nothing can be measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// A meter cannot measure in the scene.
    #[error("meter {number}: {problem}")]
    Meter {
        /// Number of the meter, counted from 0.
        number: usize,
        /// What is wrong with it.
        problem: MeterProblem,
    },
    /// No emitter has any power.
    #[error("the scene emits no light: there is nothing to measure")]
    Dark,
    /// There is no room for the sums.
    #[error("the meters need {0} bytes of memory, or more than {max} bins", max = Tally::MOST_SLOTS)]
    Memory(usize),
}

/// Measures on the current thread pool: one scene for each group of channels, alike but for their spectra and
/// indices, whose film gives the number of channels. `handle` counts
/// particles, and can end the measurement within a pass.
///
/// `on_pass` is called between passes with the number of particles done; when it breaks, the measurement
/// stops with what it has.
///
/// # Errors
/// If a meter does not fit the scene, no light is emitted, or there is not enough memory.
///
/// # Panics
/// Without scenes.
pub fn measure(
    scenes: &[Scene],
    meters: &[Meter],
    options: &MeasureOptions,
    handle: &Handle,
    mut on_pass: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Measurement, MeasureError> {
    let mut state = MeasureState::new(scenes, meters)?;
    state.advance(scenes, meters, options, handle, |state| {
        on_pass(state.done.count())
    })?;
    state.into_measurement(scenes, meters)
}

/// What a measurement has gathered so far: to go on with it later, or to add it to what others have gathered, as
/// [`State`](super::State) is for images.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MeasureState {
    done: Ranges,
    stats: Stats,
    /// For each group of channels.
    tallies: Vec<Tally>,
    balances: Vec<BalanceTotals>,
    /// The same, for each meter that keeps any.
    records: Vec<Vec<Option<Records>>>,
    /// The same; empty until they are learnt.
    windows: Vec<Option<Window>>,
}

impl MeasureState {
    /// Nothing yet.
    ///
    /// # Errors
    /// If a meter does not fit the scene, no light is emitted, or there is not enough memory.
    ///
    /// # Panics
    /// Without scenes.
    pub fn new(scenes: &[Scene], meters: &[Meter]) -> Result<Self, MeasureError> {
        let scene = scenes.first().expect(NO_SCENE);
        for (number, meter) in meters.iter().enumerate() {
            let checked = meter.check(scene);
            checked.map_err(|problem| MeasureError::Meter { number, problem })?;
        }
        let tally = |group: Group| {
            let slots = group.setup.slots();
            let tally = Some(slots).filter(|n| *n <= Tally::MOST_SLOTS);
            let tally = tally.and_then(Tally::new);
            tally.ok_or(MeasureError::Memory(Tally::memory(slots)))
        };
        let groups = groups(scenes, meters, u32::MAX, 0)?;
        Ok(MeasureState {
            done: Ranges::default(),
            stats: Stats::default(),
            balances: vec![BalanceTotals::default(); groups.len()],
            windows: Vec::new(),
            records: groups.iter().map(|g| g.setup.records()).collect(),
            tallies: groups.into_iter().map(tally).collect::<Result<_, _>>()?,
        })
    }

    /// The particles that have been followed.
    pub fn done(&self) -> &Ranges {
        &self.done
    }

    /// Whether this is a state of a measurement of these scenes with these meters, whichever particles it has.
    pub fn fits(&self, scenes: &[Scene], meters: &[Meter]) -> bool {
        let groups = groups(scenes, meters, u32::MAX, 0).unwrap_or_default();
        let slots = groups.iter().map(|g| g.setup.slots());
        let learnt = self.windows.is_empty() || self.windows.len() == scenes.len();
        let records: Vec<_> = groups.iter().map(|g| g.setup.records()).collect();
        let learnt = learnt && same_records(&self.records, &records);
        let same = self.balances.len() == scenes.len() && learnt;
        same && slots.eq(self.tallies.iter().map(Tally::slots))
    }

    /// Adds what another state of the same measurement has gathered: the same scenes, meters, seed and options,
    /// but for the range of particles.
    ///
    /// # Errors
    /// Particles that both have, or states of obviously different measurements; nothing is added then.
    pub fn merge(&mut self, other: &MeasureState) -> Result<(), MergeError> {
        let slots = |state: &MeasureState| state.tallies.iter().map(Tally::slots).collect();
        let [mine, others]: [Vec<usize>; 2] = [slots(self), slots(other)];
        let learnt = !self.windows.is_empty() && !other.windows.is_empty();
        let recorded = same_records(&other.records, &self.records);
        if mine != others || !recorded || learnt && self.windows != other.windows {
            return Err(MergeError::Different);
        }
        if let Some(range) = self.done.overlap(&other.done) {
            return Err(MergeError::Overlap(range));
        }
        if self.windows.is_empty() {
            self.windows = other.windows.clone();
        }
        other.done.iter().for_each(|range| self.done.insert(range));
        self.stats += other.stats;
        for (tally, other) in self.tallies.iter_mut().zip(&other.tallies) {
            tally.merge(other);
        }
        for (balances, other) in self.balances.iter_mut().zip(&other.balances) {
            *balances += *other;
        }
        let records = self.records.iter_mut().flatten().flatten();
        let others = other.records.iter().flatten().flatten();
        records
            .zip(others)
            .for_each(|(mine, other)| mine.merge(other));
        Ok(())
    }

    /// Follows the particles of the options' range that are missing, on the current thread pool; see
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
        mut on_pass: impl FnMut(&MeasureState) -> ControlFlow<()>,
    ) -> Result<(), MeasureError> {
        let max_depth = options.max_depth.unwrap_or(u32::MAX);
        let groups = groups(scenes, meters, max_depth, options.rr_depth)?;
        assert!(
            self.fits(scenes, meters),
            "the state is not one of a measurement of these scenes with these meters"
        );
        if self.windows.is_empty() {
            // Whatever the options: states of other ranges and depths have the same.
            let whole = self::groups(scenes, meters, u32::MAX, 0)?;
            let windows = whole.iter().map(|g| g.setup.window(handle.stop()));
            let windows = windows.collect();
            if handle.stop().is_raised() {
                return Ok(());
            }
            self.windows = windows;
        }
        let windows = self.windows.iter().cloned();
        let groups: Vec<Group> = groups
            .into_iter()
            .zip(windows)
            .map(|(group, window)| group.within(window))
            .collect();
        let mut passes = Passes::over(self.done.gaps(options.range()), TASK);
        while passes.at().is_some() {
            let most = MOST_TASKS * TASK;
            let pass = passes.begin(|next| next.next_multiple_of(TASK).min(most));
            let taken = self.pass(&groups, options.seed, pass, handle);
            if taken.is_break() || on_pass(self).is_break() {
                return Ok(());
            }
            passes.end();
        }
        Ok(())
    }

    /// Follows a range of particles in all groups of channels. Breaks, without them, if it is stopped.
    fn pass(
        &mut self,
        groups: &[Group],
        seed: u64,
        particles: Range<u64>,
        handle: &Handle,
    ) -> ControlFlow<()> {
        let follow = |group: &Group| group.pass(seed, particles.clone(), handle);
        let passes: Vec<Pass> = groups.iter().map(follow).collect();
        if handle.stop().is_raised() {
            return ControlFlow::Break(());
        }
        for (group, pass) in passes.into_iter().enumerate() {
            let sums: Vec<_> = pass.tasks.iter().map(|task| &task.sums).collect();
            self.tallies[group].add(&sums, particles.end - particles.start);
            for task in &pass.tasks {
                self.balances[group].enter(&task.balance);
                let records = self.records[group].iter_mut().zip(&task.records);
                for (records, rows) in records {
                    if let Some(records) = records {
                        records.add(rows);
                    }
                }
            }
            self.stats += pass.stats;
        }
        self.done.insert(particles);
        ControlFlow::Continue(())
    }

    /// The result; `scenes` and `meters` are those with which it was measured.
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
        let readings = groups.iter().zip(self.tallies);
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

    /// The records of a meter by all groups of channels, of particles of which all groups have kept them.
    fn records_of(&self, groups: &[Group], meter: usize) -> Option<RecordTable> {
        let by_group: Option<Vec<&Records>> =
            self.records.iter().map(|r| r[meter].as_ref()).collect();
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

/// What a range of particles has left behind in a group of channels, task by task.
struct Pass {
    tasks: Vec<TaskResult>,
    stats: Stats,
}

/// One group of channels.
struct Group<'a> {
    index: usize,
    setup: Setup<'a>,
    scene: &'a Scene,
    channels: usize,
}

/// All groups, for paths of at most so many edges, with Russian roulette after so many.
fn groups<'a>(
    scenes: &'a [Scene],
    meters: &'a [Meter],
    max_depth: u32,
    rr_depth: u32,
) -> Result<Vec<Group<'a>>, MeasureError> {
    let group = |(index, scene): (usize, &'a Scene)| {
        let channels = scene.film().channels_of(index);
        let setup =
            Setup::new(scene, meters, channels, max_depth, rr_depth).ok_or(MeasureError::Dark)?;
        Ok(Group {
            index,
            setup,
            scene,
            channels,
        })
    };
    scenes.iter().enumerate().map(group).collect()
}

impl Group<'_> {
    /// The group with particles that keep to a window.
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
            let first = particles.start + i as u64 * TASK;
            let mut ws = Workspace::new(self.scene.tolerance());
            ws.stop = handle.stop().clone();
            let result = self.setup.task(seed, first..first + TASK, &mut ws);
            handle.count(TASK);
            (result, ws.stats())
        };
        let tasks = (0..(count / TASK) as usize).into_par_iter();
        let (tasks, stats): (Vec<TaskResult>, Vec<Stats>) = tasks.with_max_len(1).map(task).unzip();
        let stats = stats.into_iter().fold(Stats::default(), |mut sum, s| {
            sum += s;
            sum
        });
        Pass { tasks, stats }
    }

    fn emitted(&self) -> Vec<f64> {
        self.setup.emitted().0[..self.channels].to_vec()
    }

    fn emitted_error(&self) -> Vec<f64> {
        self.setup.emitted_error().0[..self.channels].to_vec()
    }
}

/// Whether both have records of the same meters, laid out alike.
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

/// Puts the channels of all groups side by side.
fn join(mut groups: Vec<(Vec<Vec<Reading>>, usize)>) -> Vec<Vec<Reading>> {
    if groups.len() == 1 {
        return groups.remove(0).0;
    }
    let Some((first, _)) = groups.first() else {
        return Vec::new();
    };
    let joined = |(meter, readings): (usize, &Vec<Reading>)| {
        let each = readings.iter().enumerate().map(|(k, reading)| {
            let parts = || groups.iter().map(move |(r, n)| (&r[meter][k], *n));
            Reading {
                mean: interleave(
                    reading.mean.rest(),
                    parts().map(|(r, n)| (&r.mean, n)).collect(),
                ),
                error: interleave(
                    reading.error.rest(),
                    parts().map(|(r, n)| (&r.error, n)).collect(),
                ),
                effective: interleave(
                    reading.effective.rest(),
                    parts().map(|(r, n)| (&r.effective, n)).collect(),
                ),
                few: interleave(
                    reading.few.rest(),
                    parts().map(|(r, n)| (&r.few, n)).collect(),
                ),
                ..reading.clone()
            }
        });
        each.collect()
    };
    first.iter().enumerate().map(joined).collect()
}

/// The values of several groups, each with its number of channels, cell by cell; `rest` where no group has any.
fn interleave<T: Copy>(rest: T, groups: Vec<(&Sparse<T>, usize)>) -> Sparse<T> {
    let all = groups.iter().map(|(values, _)| values.len()).sum();
    let channels: usize = groups.iter().map(|(_, n)| n).sum();
    let mut joined = Sparse::new(all, rest);
    let mut first = 0;
    for (values, n) in groups {
        for (i, value) in values.written(0..values.len()) {
            *joined.get_mut(i / n * channels + first + i % n) = value;
        }
        first += n;
    }
    joined
}
