//! What decides whether a random walk goes on (docs/theory.md#random-walks).

use super::WalkRay;
use crate::sampling::Sampler;

/// Ends walks that carry little by chance, or divides those that carry much, without bias.
pub trait Survival {
    /// Into how many copies of itself a ray is divided, 0 if it ends; its throughput becomes that of each.
    fn copies(&mut self, ray: &mut WalkRay, sampler: &mut Sampler) -> usize;
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
    fn copies(&mut self, ray: &mut WalkRay, sampler: &mut Sampler) -> usize {
        if ray.throughput.is_zero() {
            return 0;
        }
        if ray.depth >= self.rr_depth {
            let survival = (ray.throughput.max() / self.initial).min(MOST_SURVIVAL);
            if sampler.next_1d() >= survival {
                return 0;
            }
            ray.throughput *= 1.0 / survival;
        }
        1
    }
}
