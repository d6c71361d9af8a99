//! Rules by which random walks end or split (docs/theory.md#random-walks).

use crate::Spectrum;
use crate::sampling::Sampler;

/// Ends walks that carry little power at random, or splits walks that carry much, without bias.
pub trait Survival {
    /// Returns the number of copies with which a ray of some depth and optical path length
    /// continues, 0 if it ends. Sets `throughput` to the throughput of each copy.
    fn copies(
        &mut self,
        throughput: &mut Spectrum,
        depth: u32,
        optical_length: f64,
        sampler: &mut Sampler,
    ) -> usize;
}

/// Russian roulette: a walk continues with a probability equal to its throughput over its initial
/// throughput.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roulette {
    /// Depth at which Russian roulette begins.
    pub rr_depth: u32,
    /// Largest throughput of a channel at the start of the walk.
    pub initial: f64,
}

/// Largest probability of survival in Russian roulette.
const MAX_SURVIVAL: f64 = 0.95;

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
            let survival = (throughput.max() / self.initial).min(MAX_SURVIVAL);
            if sampler.next_1d() >= survival {
                return 0;
            }
            *throughput *= 1.0 / survival;
        }
        1
    }
}
