//! A deterministic generator for tests.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng as _;

/// PCG-64 with a fixed stream. A seed gives equal numbers on every machine.
#[derive(Clone, Debug)]
pub struct Rng(Pcg64);

impl Rng {
    /// Makes a generator for `seed`.
    pub fn new(seed: u64) -> Self {
        let mut rng = Pcg64::new(u128::from(seed), 0x5eed);
        // Nearby seeds give nearby states: a few steps of the generator separate them.
        for _ in 0..8 {
            rng.next_u64();
        }
        Rng(rng)
    }

    /// Returns a uniform number in [0, 1), a multiple of 2⁻⁵³.
    pub fn next_1d(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Returns `N` independent uniform numbers in [0, 1).
    pub fn uniform<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.next_1d())
    }

    /// Returns a uniform number in [lo, hi).
    pub fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.next_1d()
    }

    /// Returns a uniformly distributed unit vector.
    pub fn direction(&mut self) -> [f64; 3] {
        let z = self.range(-1.0, 1.0);
        let phi = self.range(0.0, std::f64::consts::TAU);
        let r = (1.0 - z * z).sqrt();
        [r * phi.cos(), r * phi.sin(), z]
    }
}

#[cfg(test)]
mod tests {
    use super::Rng;

    #[test]
    fn the_seed_decides_the_numbers() {
        let first = Rng::new(1).uniform::<2>();
        assert_eq!(first, Rng::new(1).uniform::<2>());
        assert_ne!(first, Rng::new(2).uniform::<2>());
        assert!(first.iter().all(|x| (0.0..1.0).contains(x)));
    }
}
