//! Russian roulette (docs/theory.md#russian-roulette).

use super::{Next, PathTracer, Tracing};
use crate::path::{PathLog, PathTally};
use crate::sampling::Purpose;

/// Largest probability of survival from the depth on at which all paths may end.
const MAX_SURVIVAL: f64 = 0.95;
/// Smallest probability of survival by adjoint estimates, which may be wrong.
const MIN_SURVIVAL: f64 = 0.3;

impl PathTracer {
    /// Ends paths at random, without bias. Returns true if this path continues.
    pub(super) fn roulette(&self, t: &mut Tracing<impl PathLog>, next: &mut Next) -> bool {
        if next.throughput.is_zero() {
            return false;
        }
        let survival = self.survival(t, next);
        if survival < 1.0 {
            if t.sampler.next_1d_for(Purpose::Roulette) >= survival {
                return false;
            }
            // Planted error "survivors of roulette not weighted by the probability of that", found by morgana-transport/transport::roulette::absurd_adjoint_estimates_keep_the_mean:
            // next.throughput *= 1.0;
            next.throughput *= 1.0 / survival;
        }
        t.record(next);
        true
    }

    /// Returns the probability that a path continues. It follows from the adjoint estimate or,
    /// without one, from the throughput. The throughput is then compared as radiance, without n² of
    /// the medium.
    fn survival<R>(&self, t: &Tracing<R>, next: &Next) -> f64 {
        let late = next.length.depth >= self.rr_depth;
        let wanted = match t.ws.adjoint.of(&next.start) {
            Some(prospect) => (prospect * next.throughput.sum()).max(MIN_SURVIVAL),
            None if late => {
                let sensor = t.scene.sensor().position();
                let n = t.scene.n(t.scene.sensor_medium(), sensor);
                next.throughput.max() / (n * n)
            }
            None => 1.0,
        };
        wanted.min(if late { MAX_SURVIVAL } else { 1.0 })
    }
}

impl<L: PathLog> Tracing<'_, L> {
    /// Records a path that continues for a pilot.
    fn record(&mut self, next: &Next) {
        let tally = self.tally();
        if let (Some(adjoint_training), Some(tally)) = (&mut self.ws.adjoint_training, tally) {
            adjoint_training.record(&next.start, next.throughput.sum(), tally);
        }
    }

    /// Records the end of a path for a pilot.
    pub(super) fn end(&mut self) {
        let tally = self.tally();
        if let (Some(adjoint_training), Some(tally)) = (&mut self.ws.adjoint_training, tally) {
            adjoint_training.end(tally);
        }
    }

    /// Returns the contribution and work of the path so far, if a pilot needs them.
    fn tally(&self) -> Option<PathTally> {
        self.ws.adjoint_training.as_ref().map(|_| PathTally {
            light: self.out.iter().map(|c| c.weighted().sum()).sum(),
            work: self.ws.stats().cost(),
        })
    }
}
