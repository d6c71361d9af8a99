//! How a run is done and when it ends.

use crate::errors;
use crate::watch::Shared;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A dictionary of what the caller asks for.
#[derive(Clone, Copy, Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Limits {
    pub seed: u64,
    /// Samples per pixel, or particles; without a number, something else ends the run.
    pub samples: Option<u64>,
    /// Seconds, positive.
    pub time: Option<f64>,
    /// Error at which a render ends, positive, and whether it is that of pixels.
    pub target_error: Option<(f64, bool)>,
    /// Zero for as many as there are processors.
    pub threads: usize,
}

impl Limits {
    /// Threads to run on.
    pub fn pool(&self) -> PyResult<ThreadPool> {
        let builder = ThreadPoolBuilder::new().num_threads(self.threads);
        builder
            .build()
            .map_err(|e| errors::render(format!("cannot start threads: {e}")))
    }

    /// How long a run may take.
    pub fn time(&self) -> Option<Duration> {
        self.time.and_then(|t| Duration::try_from_secs_f64(t).ok())
    }

    /// Looks whether a run is to end before it is done.
    pub fn clock<'a>(&self, shared: &'a Shared) -> Clock<'a> {
        Clock {
            shared,
            time: self.time(),
            started: Instant::now(),
            is_over: false,
        }
    }
}

/// The time of a run.
#[derive(Debug)]
pub struct Clock<'a> {
    shared: &'a Shared,
    time: Option<Duration>,
    started: Instant,
    /// Whether the run has ended because its time was over.
    pub is_over: bool,
}

impl Clock<'_> {
    /// To be asked when a run has ended: within a pass, if it was given up.
    pub fn ended(&mut self) {
        if self.shared.handle.is_given_up() {
            let _ = self.look(false);
        }
    }

    /// To be asked between passes.
    pub fn look(&mut self, is_done: bool) -> ControlFlow<()> {
        self.is_over = !is_done && self.time.is_some_and(|t| self.started.elapsed() >= t);
        if self.is_over || self.shared.stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// Why a run ended early.
pub fn stopped(interrupted: bool, is_over: bool, reached: bool) -> Option<&'static str> {
    match (interrupted, is_over, reached) {
        (true, ..) => Some("interrupted"),
        (_, true, _) => Some("time"),
        (.., true) => Some("target"),
        _ => None,
    }
}
