//! Russian roulette: which paths go on (docs/theory.md#russian-roulette).

use super::{Next, PathTracer, Tracing};
use crate::path::{PathLog, PathTally};
use crate::sampling::Purpose;

/// Russian roulette never lets a path go on with a larger probability than this from the depth on at which all paths
/// may end,
const LONGEST_ROULETTE: f64 = 0.95;
/// nor, by what it may still bring, with a smaller one than this: what is expected may be wrong.
const SHORTEST_ROULETTE: f64 = 0.3;

impl PathTracer {
    /// Ends paths by chance, without bias; whether this one goes on.
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
        t.depart(next);
        true
    }

    /// The probability that a path goes on: by what it may still bring or, as long as nobody knows, by its throughput. The
    /// scale is then the throughput of radiance, so that n² of the medium does not count.
    fn survival<R>(&self, t: &Tracing<R>, next: &Next) -> f64 {
        let late = next.length.depth >= self.rr_depth;
        let wanted = match t.ws.adjoint.of(&next.start) {
            Some(prospect) => (prospect * next.throughput.sum()).max(SHORTEST_ROULETTE),
            None if late => {
                let sensor = t.scene.sensor().position();
                let n = t.scene.n(t.scene.sensor_medium(), sensor);
                next.throughput.max() / (n * n)
            }
            None => 1.0,
        };
        wanted.min(if late { LONGEST_ROULETTE } else { 1.0 })
    }
}

impl<L: PathLog> Tracing<'_, L> {
    /// Tells a pilot of a path that goes on.
    fn depart(&mut self, next: &Next) {
        let tally = self.tally();
        if let (Some(adjoint_training), Some(tally)) = (&mut self.ws.adjoint_training, tally) {
            adjoint_training.depart(&next.start, next.throughput.sum(), tally);
        }
    }

    /// Tells a pilot of the end of a path.
    pub(super) fn end(&mut self) {
        let tally = self.tally();
        if let (Some(adjoint_training), Some(tally)) = (&mut self.ws.adjoint_training, tally) {
            adjoint_training.end(tally);
        }
    }

    /// What the path has brought and taken so far, if a pilot asks for it.
    fn tally(&self) -> Option<PathTally> {
        self.ws.adjoint_training.as_ref().map(|_| PathTally {
            light: self.out.iter().map(|c| c.weighted().sum()).sum(),
            work: self.ws.stats().cost(),
        })
    }
}
