//! The passes of a run: the program shows how far it has got, and ends it in time or when it is asked to.

use crate::interrupt::Interrupt;
use crate::progress::{self, ProgressGoal};
use io::Run;
use io::clock::{Clock, Stopped};
use rayon::ThreadPool;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use transport::render::{GRACE, Handle};

/// Limit of the time that a render may take, its scene's loading included.
#[derive(Clone, Copy, Debug)]
pub struct TimeLimit {
    time: Option<Duration>,
    started: Instant,
}

impl TimeLimit {
    /// Starts now; without a `time` there is no limit.
    pub fn start(time: Option<Duration>) -> Self {
        TimeLimit {
            time,
            started: Instant::now(),
        }
    }

    /// Returns what is left of the time.
    pub fn left(&self) -> Option<Duration> {
        let elapsed = self.started.elapsed();
        self.time.map(|time| time.saturating_sub(elapsed))
    }

    /// Returns the limit if it was exceeded by the time in which a pass under way may be completed.
    pub fn exceeded(&self) -> Option<Duration> {
        let elapsed = self.started.elapsed();
        self.time
            .filter(|time| elapsed >= time.saturating_add(GRACE))
    }
}

/// What drives a run.
#[derive(Debug)]
pub struct Driver<'a> {
    /// Threads to run on.
    pub pool: &'a ThreadPool,
    /// Whether the user has asked to stop.
    pub interrupt: &'a Interrupt,
    /// Whether nothing is shown.
    pub quiet: bool,
}

impl Driver<'_> {
    /// Chooses the integrator of a run, if that is left open, unless the user has asked to stop.
    pub fn choose(&self, run: &mut Run) -> ControlFlow<()> {
        let goal = ProgressGoal {
            samples_per_spp: 1,
            spp: None,
            before: 0,
            unit: "spp",
            time: run.time,
        };
        let silent = Driver {
            quiet: true,
            ..*self
        };
        silent.drive(goal, |handle, _| run.choose(handle));
        if self.interrupt.asked() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    /// Does `work`, which asks the clock after each pass whether to go on. Returns what it gives, and why it ended early.
    pub fn drive<T: Send>(
        &self,
        goal: ProgressGoal,
        work: impl FnOnce(&Handle, &mut Clock) -> T + Send,
    ) -> (T, Option<Stopped>) {
        let (handle, asked) = (Handle::default(), || self.interrupt.asked());
        let mut clock = Clock::start(goal.time, &asked);
        let result = std::thread::scope(|scope| {
            let _watch = progress::watch(scope, goal, !self.quiet, &handle, self.interrupt);
            self.pool.install(|| work(&handle, &mut clock))
        });
        (result, clock.end(&handle))
    }
}
