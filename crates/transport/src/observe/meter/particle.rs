//! Walk of one particle from its emitter to its end (docs/theory.md#meters).

use super::{Setup, Window};
use crate::Spectrum;
use crate::emitter::EmittedRay;
use crate::path::{
    Observer, ParticleBalance, RandomWalk, Survival, TransportMode, WalkRay, Workspace, emit,
};
use crate::sampling::Sampler;

/// Power below which a particle may end by Russian roulette, relative to the weight window. Without
/// a window, it is relative to the particle's initial power.
const ROULETTE_POWER: f64 = 0.1;
/// Power, relative to the power of the weight window, above which a particle is divided.
const SPLITTING_POWER: f64 = 2.0;
/// Maximum number of particles into which one particle is divided at one place.
const MAX_SPLIT: f64 = 16.0;
/// Maximum number of copies of one emitted particle; beyond it particles are no longer divided.
const MAX_COPIES: usize = 10_000;

impl Setup<'_> {
    /// Emits particle `number`, and follows it, all its copies, and the fluorescent light that other
    /// channels cause. Returns the balance of its power.
    pub(super) fn follow(
        &self,
        number: u64,
        observer: &mut impl Observer,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> ParticleBalance {
        let mut balance = match self.emit(number, sampler) {
            Some((_, ray)) => self.walk(number, ray, observer, sampler, ws),
            None => ParticleBalance::default(),
        };
        if !self.excitations.is_empty() {
            balance += self.fluoresce(number, observer, sampler, ws);
        }
        balance
    }

    /// Emits the particle with this number: chooses the emitter with probability P_E, and samples a
    /// point on it and a ray. The power is Φ_E. Returns `None` if no light leaves.
    pub(crate) fn emit(&self, number: u64, sampler: &mut Sampler) -> Option<(EmittedRay, WalkRay)> {
        let pick = self.choice.as_ref()?.sample(sampler.next_1d());
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

    /// Follows an emitted particle and all its copies, edge by edge.
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

/// Survival that keeps the power of particles near the window, or near their initial power.
struct WindowedSurvival<'w> {
    window: Option<&'w Window>,
    rr_depth: u32,
    /// Initial power of the particle.
    initial: f64,
    /// Number of copies of the particle so far.
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
        // Compute the particle's power w relative to the window W(L).
        let left = throughput.sum() / self.initial;
        let worth = left / self.window.map_or(1.0, |w| w.share(optical_length));
        // Survive with probability w/W if w/W is small, or divide into round(w/W) particles if it
        // is large.
        if depth >= self.rr_depth && worth < ROULETTE_POWER {
            if sampler.next_1d() >= worth {
                return 0;
            }
            *throughput *= 1.0 / worth;
        } else if self.window.is_some() && worth > SPLITTING_POWER && self.copies < MAX_COPIES {
            let copies = worth.min(MAX_SPLIT).round() as usize;
            // Planted error "particles that are divided keep all their power each", found by morgana-transport/transport::meters::gates::an_infinite_medium_absorbs_exponentially:
            // *throughput *= 1.0;
            *throughput *= 1.0 / copies as f64;
            self.copies += copies - 1;
            return copies;
        }
        1
    }
}
