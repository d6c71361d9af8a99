//! Handle of a render or a measurement, by which other threads read its progress and end it.

use crate::stop::Stop;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Time that the current pass may still take after a request to end. Most passes complete within
/// this time, so that no samples are lost.
pub const GRACE: Duration = Duration::from_millis(600);

/// State that a render or a measurement shares with threads that watch it.
#[derive(Debug, Default)]
pub struct Handle {
    samples: AtomicU64,
    requested: OnceLock<Instant>,
    stop: Stop,
}

impl Handle {
    /// Returns the samples of pixels, or particles, taken so far in all groups of channels
    /// together. Adaptive renders count every pixel with the mean number. The count grows during a
    /// pass, and does not decrease if the pass is aborted.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    pub(super) fn count(&self, samples: u64) {
        self.samples.fetch_add(samples, Ordering::Relaxed);
    }

    /// Requests the end of the render; to be called repeatedly. The render ends after the current
    /// pass. A call at least [`GRACE`] after the first call aborts the pass and discards its
    /// samples.
    pub fn request_end(&self) {
        if self.requested.get_or_init(Instant::now).elapsed() >= GRACE {
            self.stop.raise();
        }
    }

    /// Returns true if the end was requested.
    pub fn end_requested(&self) -> bool {
        self.requested.get().is_some()
    }

    /// Ends the render within a pass.
    pub fn end_now(&self) {
        self.stop.raise();
    }

    /// Returns true if the render was ended within a pass.
    pub fn is_given_up(&self) -> bool {
        self.stop.is_raised()
    }

    /// Creates a handle for work that ends with this one, and whose samples do not count.
    pub(super) fn uncounted(&self) -> Handle {
        Handle {
            stop: self.stop.clone(),
            ..Handle::default()
        }
    }

    /// Returns the flag that running work checks.
    pub(super) fn stop(&self) -> &Stop {
        &self.stop
    }
}
