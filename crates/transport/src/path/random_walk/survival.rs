//! What decides whether a random walk goes on (docs/theory.md#random-walks).

use crate::Spectrum;
use crate::sampling::Sampler;

/// Ends walks that carry little by chance, or divides those that carry much, without bias.
pub trait Survival {
    /// Into how many copies of itself a ray of some depth and optical path length is divided, 0 if it ends; its throughput becomes that of
    /// each.
    fn copies(
        &mut self,
        throughput: &mut Spectrum,
        depth: u32,
        optical_length: f64,
        sampler: &mut Sampler,
    ) -> usize;
}

/// Russian roulette: a walk goes on with the probability of its throughput over the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roulette {
    /// Depth at which it begins.
    pub rr_depth: u32,
    /// Largest throughput of a channel at the start of the walk.
    pub initial: f64,
}

/// Russian roulette never lets a path go on with a larger probability than this.
const MOST_SURVIVAL: f64 = 0.95;

impl Survival for Roulette {
    fn copies(
        &mut self,
        throughput: &mut Spectrum,
        depth: u32,
        _optical_length: f64,
        sampler: &mut Sampler,
    ) -> usize {
        if throughput.is_zero() {
            return 0;
        }
        if depth >= self.rr_depth {
            let survival = (throughput.max() / self.initial).min(MOST_SURVIVAL);
            if sampler.next_1d() >= survival {
                return 0;
            }
            *throughput *= 1.0 / survival;
        }
        1
    }
}
