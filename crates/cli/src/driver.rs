//! The passes of a run: the program shows how far it has got, and ends it in time or when it is asked to.

use crate::interrupt::Interrupt;
use crate::progress::{self, ProgressGoal};
use io::Run;
use io::clock::{Clock, Stopped};
use rayon::ThreadPool;
use std::ops::ControlFlow;
use transport::render::Handle;

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
