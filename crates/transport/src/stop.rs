//! How work that is under way is told to end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A wish that work under way be given up. Copies share it.
///
/// Rays, connections and photon searches look at it between steps, and end as if they had found nothing once it is
/// raised: what they return then is worthless, and whoever raises it has to throw it away. Scenes that are being built look at it between
/// objects.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// From now on, work is given up.
    pub fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether work is to be given up.
    #[inline]
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
