//! Random numbers addressed by (seed, pixel, sample, dimension).

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng as _;

/// The random numbers of one path.
///
/// The address (seed, pixel, sample) is hashed into the generator's state and the dimension is the
/// count of numbers drawn, so results do not depend on threads, tiles, shards or resumption.
#[derive(Clone, Debug)]
pub struct Sampler(Pcg64Mcg);

impl Sampler {
    /// Numbers of sample `sample` of pixel (or particle batch) `pixel`. Any values are fine:
    /// neighbouring addresses give independent streams.
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let address = [seed, pixel, sample];
        let high = hash(0x243f_6a88_85a3_08d3, address);
        let low = hash(0x1319_8a2e_0370_7344, address);
        Sampler(Pcg64Mcg::new(u128::from(high) << 64 | u128::from(low)))
    }

    /// Uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn next_1d(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Two independent numbers.
    pub fn next_2d(&mut self) -> [f64; 2] {
        [self.next_1d(), self.next_1d()]
    }
}

/// Hash of the address, one bijective mixing round per word. The keys of the two halves are digits
/// of π.
fn hash(key: u64, address: [u64; 3]) -> u64 {
    address
        .into_iter()
        .fold(key, |h, word| mix(h ^ word).wrapping_add(key))
}

/// SplitMix64's increment and finaliser (Steele, Lea and Flood 2014; Stafford's variant 13): a
/// bijection in which each input bit flips each output bit with probability close to one half.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
