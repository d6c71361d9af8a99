//! Measuring: particles spread over threads, with results that depend on the seed alone.

use super::longer_or_shorter;
use crate::meter::{Meter, Part, Reading, Setup, Tally};
use crate::path::{Account, Balance, Workspace};
use crate::scene::Scene;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Particles per task. The sums of a task are rounded on their own, so this number is part of the result.
const TASK: u64 = 64;
/// Most tasks that are kept before they are added up.
const MOST_TASKS: u64 = 1 << 10;

/// How a measurement is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeasureOptions {
    /// Particles, for each group of channels.
    pub particles: u64,
    /// Seed: the same seed gives the same readings, bit for bit, for any number of threads.
    pub seed: u64,
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and events after which Russian roulette begins.
    pub rr_depth: u32,
}

/// What a measurement gives.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// For each meter, what it has measured, with the channels of all groups. Absolute: in the units of
    /// the emitters' power.
    pub readings: Vec<Vec<Reading>>,
    /// Power of all emitters, per channel.
    pub emitted: Vec<f64>,
    /// Where the light went, summed over channels.
    pub balance: Balance,
    /// What happened.
    pub stats: Stats,
    /// Particles followed, per channel group: fewer than asked for if the measurement was stopped.
    pub particles: u64,
}

/// Why nothing can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// No emitter has any power.
    #[error("the scene emits no light: there is nothing to measure")]
    Dark,
    /// There is no room for the sums.
    #[error("the meters need {0} bytes of memory, or more than {max} bins", max = Tally::MOST_SLOTS)]
    Memory(usize),
}

/// Measures on the current thread pool: one scene for each group of channels, alike but for their spectra and
/// indices, whose film gives the number of channels. `counter` grows by one for each particle.
///
/// `on_pass` is called between passes with the number of particles done; when it breaks, the measurement
/// stops with what it has.
///
/// # Errors
/// If no light is emitted, or there is not enough memory.
pub fn measure(
    scenes: &[Scene],
    meters: &[Meter],
    options: &MeasureOptions,
    counter: &AtomicU64,
    mut on_pass: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Measurement, MeasureError> {
    let mut groups = Vec::new();
    for (i, scene) in scenes.iter().enumerate() {
        groups.push(Group::new((i, scene), meters, options)?);
    }
    let (mut done, mut tasks) = (0, 1);
    let mut stats = Stats::default();
    while done < options.particles {
        let started = Instant::now();
        let end = options.particles.min(done + tasks * TASK);
        for group in &mut groups {
            stats += group.pass(done..end, counter);
        }
        done = end;
        if on_pass(done).is_break() {
            break;
        }
        tasks = longer_or_shorter(tasks, started.elapsed()).min(MOST_TASKS);
    }
    Ok(Measurement {
        readings: join(groups.iter().map(|g| (g.readings(), g.channels)).collect()),
        emitted: groups.iter().flat_map(Group::emitted).collect(),
        balance: groups.iter().fold(Balance::default(), |mut sum, group| {
            sum += group.account.balance(group.setup.emitted().sum());
            sum
        }),
        stats,
        particles: done,
    })
}

/// One group of channels.
struct Group<'a> {
    setup: Setup<'a>,
    scene: &'a Scene,
    tally: Tally,
    account: Account,
    seed: u64,
    channels: usize,
}

impl<'a> Group<'a> {
    fn new(
        (index, scene): (usize, &'a Scene),
        meters: &'a [Meter],
        options: &MeasureOptions,
    ) -> Result<Self, MeasureError> {
        let channels = scene.film().lanes_of(index);
        let depths = (options.max_depth.unwrap_or(u32::MAX), options.rr_depth);
        let setup = Setup::new(scene, meters, channels, depths).ok_or(MeasureError::Dark)?;
        let slots = setup.slots();
        let tally = Some(slots).filter(|n| *n <= Tally::MOST_SLOTS);
        let tally = tally.and_then(Tally::new);
        Ok(Group {
            tally: tally.ok_or(MeasureError::Memory(Tally::memory(slots)))?,
            account: Account::default(),
            setup,
            scene,
            // Each group's paths have an address space of their own.
            seed: options
                .seed
                .wrapping_add((index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)),
            channels,
        })
    }

    /// Follows a range of particles.
    fn pass(&mut self, particles: std::ops::Range<u64>, counter: &AtomicU64) -> Stats {
        let tasks = (particles.end - particles.start).div_ceil(TASK);
        let (setup, scene, seed) = (&self.setup, self.scene, self.seed);
        let task = |i: u64| {
            let first = particles.start + i * TASK;
            let range = first..particles.end.min(first + TASK);
            let mut ws = Workspace::new(scene.tolerance());
            let part = setup.task(seed, range.clone(), &mut ws);
            counter.fetch_add(range.end - range.start, Ordering::Relaxed);
            (part, ws.stats())
        };
        let ((parts, accounts), stats): ((Vec<Part>, Vec<Account>), Vec<Stats>) =
            (0..tasks).into_par_iter().map(task).unzip();
        self.tally.add(&parts, particles.end - particles.start);
        for account in accounts {
            self.account += account;
        }
        stats.into_iter().fold(Stats::default(), |mut sum, s| {
            sum += s;
            sum
        })
    }

    fn readings(&self) -> Vec<Vec<Reading>> {
        self.setup.readings(&self.tally)
    }

    fn emitted(&self) -> Vec<f64> {
        self.setup.emitted().0[..self.channels].to_vec()
    }
}

/// Puts the channels of all groups side by side.
fn join(mut groups: Vec<(Vec<Vec<Reading>>, usize)>) -> Vec<Vec<Reading>> {
    if groups.len() == 1 {
        return groups.remove(0).0;
    }
    let Some((first, _)) = groups.first() else {
        return Vec::new();
    };
    let interleave = |meter: usize, reading: usize, of: &dyn Fn(&Reading) -> &[f64]| {
        let cells = of(&first[meter][reading]).len() / groups[0].1;
        let cell = |i: usize| {
            let values = groups.iter().map(move |(readings, channels)| {
                (of(&readings[meter][reading]), i * channels, *channels)
            });
            values.flat_map(|(v, start, n)| v[start..start + n].iter().copied())
        };
        (0..cells).flat_map(cell).collect::<Vec<f64>>()
    };
    let joined = |(meter, readings): (usize, &Vec<Reading>)| {
        let each = readings.iter().enumerate().map(|(k, reading)| Reading {
            mean: interleave(meter, k, &|r| &r.mean),
            error: interleave(meter, k, &|r| &r.error),
            ..reading.clone()
        });
        each.collect()
    };
    first.iter().enumerate().map(joined).collect()
}
