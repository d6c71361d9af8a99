//! A render or a measurement as other threads see it: how far it has got, and how it is ended.

use crate::stop::Stop;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Time in which a pass that is under way when a render is to end may be completed. Most are, and nothing is lost.
pub const GRACE: Duration = Duration::from_millis(600);

/// What a render or a measurement shares with threads that watch it.
#[derive(Debug, Default)]
pub struct Handle {
    samples: AtomicU64,
    asked: OnceLock<Instant>,
    stop: Stop,
}

impl Handle {
    /// Samples of pixels, or particles, taken so far, as if all pixels had equally many; for each group of channels. It
    /// grows while a pass is under way, and does not shrink if that is given up.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    pub(super) fn count(&self, samples: u64) {
        self.samples.fetch_add(samples, Ordering::Relaxed);
    }

    /// Asks the render to end, to be called again and again: it ends after the pass that is under way, or, 0.6 s after
    /// the first call, within it. A pass that is not completed counts for nothing.
    pub fn ask_to_end(&self) {
        if self.asked.get_or_init(Instant::now).elapsed() >= GRACE {
            self.stop.raise();
        }
    }

    /// Whether it was asked to end.
    pub fn is_asked(&self) -> bool {
        self.asked.get().is_some()
    }

    /// Ends the render within a pass.
    pub fn end_now(&self) {
        self.stop.raise();
    }

    /// Whether it was ended within a pass.
    pub fn is_given_up(&self) -> bool {
        self.stop.is_raised()
    }

    /// What work under way looks at.
    pub(super) fn stop(&self) -> &Stop {
        &self.stop
    }
}
