//! Energy balance of a run of particles (docs/theory.md#energy-balance).

use crate::sum::ReproducibleSum;
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Number of entries of a balance.
const ENTRIES: usize = 6;

/// Power of one particle by its fate, summed over channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ParticleBalance {
    /// Power absorbed by media.
    pub media: f64,
    /// Power absorbed by surfaces.
    pub surfaces: f64,
    /// Power that left the scene.
    pub escaped: f64,
    /// Power left at the largest depth.
    pub cut: f64,
    /// Power on rays that were lost; the losses are counted as failures.
    pub lost: f64,
    /// Power that media emitted as fluorescence. All other entries count the destinations of this
    /// power, too.
    pub fluorescence: f64,
    /// True if no particle was followed, so that there is nothing to add.
    pub is_void: bool,
}

impl ParticleBalance {
    /// Returns the entries. Sources are negative, so that the sum is the emitted power.
    fn entries(&self) -> [f64; ENTRIES] {
        let source = -self.fluorescence;
        [
            self.media,
            self.surfaces,
            self.escaped,
            self.cut,
            self.lost,
            source,
        ]
    }
}

impl AddAssign for ParticleBalance {
    /// Adds the fates of other light of the particle.
    fn add_assign(&mut self, o: Self) {
        self.media += o.media;
        self.surfaces += o.surfaces;
        self.escaped += o.escaped;
        self.cut += o.cut;
        self.lost += o.lost;
        self.fluorescence += o.fluorescence;
    }
}

/// Sums over particles, in the order in which they are added.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BalanceSums {
    particles: u64,
    /// Sum and sum of squares of each entry, and of the total of the entries.
    sums: [[f64; 2]; ENTRIES + 1],
}

impl BalanceSums {
    /// Adds a particle. A particle with entries that are not finite is counted in `not_finite` and
    /// added with zero entries. Its power is then part of the residual.
    pub fn add(&mut self, particle_balance: &ParticleBalance, not_finite: &mut u64) {
        if particle_balance.is_void {
            return;
        }
        let mut entries = particle_balance.entries();
        if !entries.iter().sum::<f64>().is_finite() {
            entries = [0.0; ENTRIES];
            *not_finite += 1;
        }
        let total = entries.iter().sum();
        self.particles += 1;
        for (sum, value) in self.sums.iter_mut().zip(entries.into_iter().chain([total])) {
            sum[0] += value;
            sum[1] += value * value;
        }
    }
}

/// Sums over balances with bits that do not depend on the order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BalanceTotals {
    particles: u64,
    sums: [[ReproducibleSum; 2]; ENTRIES + 1],
}

impl BalanceTotals {
    /// Adds a balance.
    pub fn enter(&mut self, balance: &BalanceSums) {
        self.particles += balance.particles;
        for (kept, sums) in self.sums.iter_mut().zip(balance.sums) {
            kept[0].add(sums[0]);
            kept[1].add(sums[1].min(f64::MAX));
        }
    }

    /// Returns the number of particles.
    pub fn particles(&self) -> u64 {
        self.particles
    }

    /// Returns the energy balance of emitters with the power `emitted`, summed over channels.
    pub fn balance(&self, emitted: Share) -> EnergyBalance {
        let share = |i: usize| self.share(i);
        let total = share(ENTRIES);
        EnergyBalance {
            emitted: emitted.mean,
            media: share(0),
            surfaces: share(1),
            escaped: share(2),
            cut: share(3),
            lost: share(4),
            fluorescence: Share {
                mean: 0.0 - share(5).mean,
                ..share(5)
            },
            residual: Share {
                mean: emitted.mean - total.mean,
                error: total.error.hypot(emitted.error),
            },
        }
    }

    fn share(&self, i: usize) -> Share {
        let (n, [sum, square]) = (
            self.particles as f64,
            self.sums[i].map(ReproducibleSum::value),
        );
        let mean = sum / n.max(1.0);
        let variance = (square / n - mean * mean).max(0.0) / (n - 1.0);
        Share {
            mean,
            error: if n < 2.0 {
                f64::INFINITY
            } else {
                variance.sqrt()
            },
        }
    }
}

impl AddAssign for BalanceTotals {
    /// Adds the sums of other balances.
    fn add_assign(&mut self, other: BalanceTotals) {
        self.particles += other.particles;
        for (sums, other) in self.sums.iter_mut().zip(other.sums) {
            sums[0] += other[0];
            sums[1] += other[1];
        }
    }
}

impl AddAssign for BalanceSums {
    /// Adds the sums of other particles. Sums are rounded: add parts in an order that does not
    /// depend on threads.
    fn add_assign(&mut self, o: Self) {
        self.particles += o.particles;
        for (sum, other) in self.sums.iter_mut().zip(o.sums) {
            sum[0] += other[0];
            sum[1] += other[1];
        }
    }
}

/// An amount of power, summed over channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// Mean over particles.
    pub mean: f64,
    /// Standard error of the mean.
    pub error: f64,
}

/// Energy balance of a whole run. The residual is the power that no entry accounts for. It is noise
/// from unbiased choices: of emitters and rays, by Russian roulette, and by spectral sampling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyBalance {
    /// Power of all emitters. It is exact, except for emitting media whose power had to be
    /// estimated.
    pub emitted: f64,
    /// Power absorbed by media.
    pub media: Share,
    /// Power absorbed by surfaces.
    pub surfaces: Share,
    /// Power that left the scene.
    pub escaped: Share,
    /// Power left at the largest depth.
    pub cut: Share,
    /// Power on rays that were lost; the losses are counted as failures.
    pub lost: Share,
    /// Power that media emitted as fluorescence.
    pub fluorescence: Share,
    /// Emitted power and fluorescence minus all other entries. It is zero within its error, and the error of the
    /// power of emitting media.
    pub residual: Share,
}

impl AddAssign for Share {
    /// Adds an independent amount.
    fn add_assign(&mut self, o: Self) {
        self.mean += o.mean;
        self.error = self.error.hypot(o.error);
    }
}

impl AddAssign for EnergyBalance {
    /// Adds the balance of other channels, with separate particles.
    fn add_assign(&mut self, o: Self) {
        self.emitted += o.emitted;
        self.media += o.media;
        self.surfaces += o.surfaces;
        self.escaped += o.escaped;
        self.cut += o.cut;
        self.lost += o.lost;
        self.fluorescence += o.fluorescence;
        self.residual += o.residual;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_left_over_and_counted() {
        let (mut balance, mut not_finite) = (BalanceSums::default(), 0);
        let one = ParticleBalance {
            media: 1.0,
            ..ParticleBalance::default()
        };
        let bad = ParticleBalance {
            escaped: f64::NAN,
            ..one
        };
        for particle_balance in [one, bad] {
            balance.add(&particle_balance, &mut not_finite);
        }
        let mut balances = BalanceTotals::default();
        balances.enter(&balance);
        let balance = balances.balance(Share {
            mean: 1.0,
            error: 0.0,
        });
        assert_eq!((not_finite, balances.particles()), (1, 2));
        assert_eq!((balance.media.mean, balance.residual.mean), (0.5, 0.5));
    }
}
