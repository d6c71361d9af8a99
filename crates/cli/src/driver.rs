//! Passes of a run, with a progress bar, a time limit and interruption by the user.

use crate::interrupt::Interrupt;
use crate::progress::{self, ProgressGoal};
use io::Run;
use io::clock::{Clock, Stopped};
use rayon::ThreadPool;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use transport::render::{GRACE, Handle};

/// Time limit of a render, including the time to load its scene.
#[derive(Clone, Copy, Debug)]
pub struct TimeLimit {
    time: Option<Duration>,
    started: Instant,
}

impl TimeLimit {
    /// Starts the time; without `time` there is no limit.
    pub fn start(time: Option<Duration>) -> Self {
        TimeLimit {
            time,
            started: Instant::now(),
        }
    }

    /// Returns the remaining time.
    pub fn left(&self) -> Option<Duration> {
        let elapsed = self.started.elapsed();
        self.time.map(|time| time.saturating_sub(elapsed))
    }

    /// Returns the limit if it is exceeded by more than `GRACE`, in which a pass in progress may
    /// finish.
    pub fn exceeded(&self) -> Option<Duration> {
        let elapsed = self.started.elapsed();
        self.time
            .filter(|time| elapsed >= time.saturating_add(GRACE))
    }
}

/// Environment in which a run is driven.
#[derive(Debug)]
pub struct Driver<'a> {
    /// Threads to run on.
    pub pool: &'a ThreadPool,
    /// Request to stop by the user.
    pub interrupt: &'a Interrupt,
    /// True if no progress is shown.
    pub quiet: bool,
}

impl Driver<'_> {
    /// Chooses the integrator of a run, if the choice is open, unless the user has asked to stop.
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
        if self.interrupt.requested() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    /// Runs `work`, which checks after each pass whether the clock requests the end. Returns the
    /// result, and the reason why `work` ended early.
    pub fn drive<T: Send>(
        &self,
        goal: ProgressGoal,
        work: impl FnOnce(&Handle, &mut Clock) -> T + Send,
    ) -> (T, Option<Stopped>) {
        let (handle, requested) = (Handle::default(), || self.interrupt.requested());
        let mut clock = Clock::start(goal.time, &requested);
        let result = std::thread::scope(|scope| {
            let _watch = progress::watch(scope, goal, !self.quiet, &handle, self.interrupt);
            self.pool.install(|| work(&handle, &mut clock))
        });
        (result, clock.end(&handle))
    }
}
