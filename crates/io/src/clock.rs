//! Time limits and interruptions of runs.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use transport::render::Handle;

/// Reason why a run ended before it had all its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// The user interrupted the run.
    Interrupted,
    /// The time limit was reached.
    Time,
    /// The run reached its target error.
    Target,
}

impl Stopped {
    /// Returns the reason's name in statistics.
    pub fn name(self) -> &'static str {
        match self {
            Stopped::Interrupted => "interrupted",
            Stopped::Time => "time",
            Stopped::Target => "target",
        }
    }
}

/// Clock that ends a run at its time limit, or when the user interrupts it.
pub struct Clock<'a> {
    requested: &'a (dyn Fn() -> bool + Sync),
    time: Option<Duration>,
    started: Instant,
    stopped: Option<Stopped>,
}

impl<'a> Clock<'a> {
    /// Starts the clock. The run may take at most `time`; `requested` returns true once the user
    /// has interrupted the run.
    pub fn start(time: Option<Duration>, requested: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Clock {
            requested,
            time,
            started: Instant::now(),
            stopped: None,
        }
    }

    /// Decides after each pass whether the run continues. It does not stop a run that has all its
    /// samples.
    pub fn look(&mut self, is_done: bool) -> ControlFlow<()> {
        self.stopped = self.reason().filter(|_| !is_done);
        if self.stopped.is_some() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Returns the reason why a finished run ended early, possibly within a pass.
    pub fn end(self, handle: &Handle) -> Option<Stopped> {
        let given_up = self.reason().filter(|_| handle.is_given_up());
        self.stopped.or(given_up)
    }

    fn reason(&self) -> Option<Stopped> {
        let is_over = self.time.is_some_and(|time| self.started.elapsed() >= time);
        if (self.requested)() {
            Some(Stopped::Interrupted)
        } else {
            is_over.then_some(Stopped::Time)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_end_in_time_or_when_asked_unless_they_are_done() {
        let handle = Handle::default();
        let mut patient = Clock::start(None, &|| false);
        assert_eq!(patient.look(false), ControlFlow::Continue(()));
        assert_eq!(patient.end(&handle), None);
        let mut late = Clock::start(Some(Duration::ZERO), &|| false);
        assert_eq!(late.look(true), ControlFlow::Continue(()));
        assert_eq!(late.look(false), ControlFlow::Break(()));
        assert_eq!(late.end(&handle), Some(Stopped::Time));
        let mut requested = Clock::start(Some(Duration::ZERO), &|| true);
        assert_eq!(requested.look(true), ControlFlow::Continue(()));
        assert_eq!(requested.end(&handle), None);
        handle.end_now();
        let given_up = Clock::start(None, &|| true);
        assert_eq!(given_up.end(&handle), Some(Stopped::Interrupted));
    }
}
