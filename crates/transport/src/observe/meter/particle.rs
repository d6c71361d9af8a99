//! The walk of one particle from its emitter to its end (docs/theory.md#meters).

use super::{Setup, Window};
use crate::Spectrum;
use crate::emitter::EmittedRay;
use crate::path::{
    Observer, ParticleBalance, RandomWalk, Survival, TransportMode, WalkRay, Workspace, emit,
};
use crate::sampling::Sampler;

/// Russian roulette is played when a particle has less than this share of the power that it should have.
const SMALL: f64 = 0.1;
/// A particle that has more than so many times that power is divided, if meters ask for weight windows,
const LARGE: f64 = 2.0;
/// into no more than so many at once,
const MOST_AT_ONCE: f64 = 16.0;
/// as long as no more than so many have come of one that an emitter has sent.
const MOST_COPIES: usize = 10_000;

impl Setup<'_> {
    /// Emits the particle of a number, and follows it, and all that it is divided into. Returns what became of its power.
    pub(super) fn follow(
        &self,
        number: u64,
        observer: &mut impl Observer,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> ParticleBalance {
        match self.emit(number, sampler) {
            Some((_, ray)) => self.walk(number, ray, observer, sampler, ws),
            None => ParticleBalance::default(),
        }
    }

    /// Emits the particle of a number: chooses the emitter by P_E, and draws an end and a ray; the power is Φ_E. `None` if no light leaves.
    pub(super) fn emit(&self, number: u64, sampler: &mut Sampler) -> Option<(EmittedRay, WalkRay)> {
        let pick = self.choice.sample(sampler.next_1d());
        let u = [sampler.next_2d(), sampler.next_2d()];
        let white = self.channel_pdf.map(|p| f64::from(u8::from(p > 0.0)));
        let scene = self.scene.at(number);
        let (emission, ray) = emit(scene, pick.index, pick.probability, white, u)?;
        let emitted = EmittedRay {
            emitter: pick.index,
            end: emission.end,
            x: emission.x,
            direction: emission.direction,
        };
        Some((emitted, ray))
    }

    /// Follows an emitted particle, and all that it is divided into, edge by edge.
    pub(super) fn walk(
        &self,
        number: u64,
        ray: WalkRay,
        observer: &mut impl Observer,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> ParticleBalance {
        let mut balance = ParticleBalance::default();
        let walk = RandomWalk {
            scene: self.scene.at(number),
            mode: TransportMode::Importance,
            channel_pdf: self.channel_pdf,
            follows_throughput: true,
            max_depth: self.max_depth,
        };
        let mut survival = WindowedSurvival {
            window: self.window.as_ref(),
            rr_depth: self.rr_depth,
            initial: ray.throughput.sum(),
            copies: 1,
        };
        let mut observers = (observer, &mut balance);
        walk.run(ray, &mut observers, &mut survival, sampler, ws);
        balance
    }
}

/// Keeps the power of particles near what a window wants, or that which they start with.
struct WindowedSurvival<'w> {
    window: Option<&'w Window>,
    rr_depth: u32,
    /// Power with which the particle started.
    initial: f64,
    /// Particles that have come of it so far.
    copies: usize,
}

impl Survival for WindowedSurvival<'_> {
    #[inline]
    fn copies(
        &mut self,
        throughput: &mut Spectrum,
        depth: u32,
        optical_length: f64,
        sampler: &mut Sampler,
    ) -> usize {
        if throughput.is_zero() {
            return 0;
        }
        // The power w over what the window W(L) wants.
        let left = throughput.sum() / self.initial;
        let worth = left / self.window.map_or(1.0, |w| w.share(optical_length));
        // Survive with probability w/W if there is little, or divide into round(w/W) if there is much.
        if depth >= self.rr_depth && worth < SMALL {
            if sampler.next_1d() >= worth {
                return 0;
            }
            *throughput *= 1.0 / worth;
        } else if self.window.is_some() && worth > LARGE && self.copies < MOST_COPIES {
            let copies = worth.min(MOST_AT_ONCE).round() as usize;
            // Planted error "particles that are divided keep all their power each", found by morgana-transport/transport::meters::gates::an_infinite_medium_absorbs_exponentially:
            // *throughput *= 1.0;
            *throughput *= 1.0 / copies as f64;
            self.copies += copies - 1;
            return copies;
        }
        1
    }
}
