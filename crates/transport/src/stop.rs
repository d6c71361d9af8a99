//! Cancellation of running work.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Request to cancel running work. Copies share the request.
///
/// Rays, connections and photon searches check it between steps. Once it is raised they end as if
/// they had found nothing. Their results are then worthless, and the caller that raises it must
/// discard them. The construction of scenes checks it between objects.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Cancels work from now on.
    pub fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns true if work is cancelled.
    #[inline]
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
