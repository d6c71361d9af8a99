//! Random numbers addressed by (seed, pixel, sample, dimension) (docs/theory.md#randomness).

use super::points::{BITS, Points, Purpose, Replicates, SPECULAR_EVENTS};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng as _;

/// Random numbers of one path.
///
/// The address (seed, pixel, sample) is hashed into the state of the generator, and the dimension
/// is the count of numbers drawn. Hence results do not depend on threads, tiles, shards or
/// resumption. If samples come in [`Replicates`], numbers drawn for a [`Purpose`] are evenly
/// distributed over a replicate.
#[derive(Clone, Debug)]
pub struct Sampler {
    random: Pcg64Mcg,
    points: Option<Points>,
    /// Index of the edge of the path that is being sampled.
    edge: u32,
}

impl Sampler {
    /// Creates the numbers of sample `sample` of pixel (or particle batch) `pixel`. All values are
    /// valid. Neighbouring addresses give independent streams.
    #[inline]
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let address = [seed, pixel, sample];
        let high = hash(0x243f_6a88_85a3_08d3, address);
        let low = hash(0x1319_8a2e_0370_7344, address);
        Sampler {
            random: Pcg64Mcg::new(u128::from(high) << 64 | u128::from(low)),
            points: None,
            edge: 0,
        }
    }

    /// Creates the numbers of a sample that belongs to a replicate. The samples of a replicate
    /// share its points; points of different replicates are independent.
    #[inline]
    pub fn in_replicates(replicates: Replicates, [seed, pixel, sample]: [u64; 3]) -> Self {
        let (replicate, index) = (sample / replicates.size(), sample % replicates.size());
        let key = hash(0xa409_3822_299f_31d0, [seed, pixel, replicate]);
        Sampler {
            points: Points::new(replicates, index, key),
            ..Sampler::new(seed, pixel, sample)
        }
    }

    /// Returns a number uniform in [0, 1), a multiple of 2⁻⁵³.
    #[inline]
    pub fn next_1d(&mut self) -> f64 {
        to_unit(self.bits())
    }

    /// Returns two independent numbers uniform in [0, 1).
    #[inline]
    pub fn next_2d(&mut self) -> [f64; 2] {
        [self.next_1d(), self.next_1d()]
    }

    /// Returns an exponential deviate of mean 1.
    #[inline]
    pub fn next_exponential(&mut self) -> f64 {
        -(1.0 - self.next_1d()).ln()
    }

    /// Returns the cosine and sine of an angle uniform over the circle. Rejection sampling gives a
    /// point in the unit disc; the result has twice its angle.
    #[inline]
    pub fn next_turn(&mut self) -> [f64; 2] {
        loop {
            let bits = self.random.next_u64();
            // Map the bits to odd multiples of 2⁻³² in (−1, 1).
            let coordinate =
                |bits: u32| (f64::from(bits.cast_signed()) + 0.5) * (1.0 / 2f64.powi(31));
            let [x, y] = [(bits >> 32) as u32, bits as u32].map(coordinate);
            let square = x * x + y * y;
            if square <= 1.0 {
                return [(x * x - y * y) / square, 2.0 * x * y / square];
            }
        }
    }

    /// Returns a number like [`Sampler::next_1d`] for a purpose at the current edge. Call it once
    /// per purpose and edge.
    #[inline]
    pub fn next_1d_for(&mut self, purpose: Purpose) -> f64 {
        let bits = self.bits();
        to_unit(self.refined(bits, purpose as u32))
    }

    /// Returns numbers like [`Sampler::next_2d`] for a purpose at the current edge. Call it once
    /// per purpose and edge.
    #[inline]
    pub fn next_2d_for(&mut self, purpose: Purpose) -> [f64; 2] {
        let bits = [self.bits(), self.bits()];
        let refined = |points: &Points| points.refined_pair(bits, self.edge, purpose as u32);
        self.points.as_ref().map_or(bits, refined).map(to_unit)
    }

    /// Skips `count` numbers, faster than by drawing them.
    #[inline]
    pub fn skip(&mut self, count: usize) {
        for _ in 0..count {
            self.random.next_u64();
        }
    }

    /// Returns a number like [`Sampler::next_1d`] for the choice between reflection and refraction,
    /// after `events` specular events on the current edge. Call it once per event.
    #[inline]
    pub fn next_specular(&mut self, events: u32) -> f64 {
        let bits = self.bits();
        // Planted error "reflections of a replicate left to chance", found by morgana-transport/transport::first_vertex::reflections_are_spread_evenly:
        // to_unit(if events > SPECULAR_EVENTS {
        to_unit(if events < SPECULAR_EVENTS {
            self.refined(bits, Purpose::Specular as u32 + events)
        } else {
            bits
        })
    }

    /// Returns random numbers for the choice of an emitter to which the end of the current edge is
    /// connected, and of the position on it. If there are several connections, only the first uses
    /// the numbers of the replicate, so that connections share none.
    #[inline]
    pub fn next_end(&mut self, connection: usize) -> (f64, [f64; 2]) {
        match connection {
            0 => {
                let choice = self.next_1d_for(Purpose::Emitter);
                (choice, self.next_2d_for(Purpose::ConnectionEnd))
            }
            _ => (self.next_1d(), self.next_2d()),
        }
    }

    /// Runs `draw` with numbers that are independent of the other samples of the replicate.
    /// Subpaths from emitters use it, because their edges would otherwise share the points of the
    /// sensor subpath.
    #[inline]
    pub fn independently<T>(&mut self, draw: impl FnOnce(&mut Self) -> T) -> T {
        let (points, edge) = (self.points.take(), self.edge);
        let drawn = draw(self);
        (self.points, self.edge) = (points, edge);
        drawn
    }

    /// Makes all further numbers independent of the other samples of the replicate.
    #[inline]
    pub fn leave_replicate(&mut self) {
        self.points = None;
    }

    /// Assigns all further numbers to the edge with index `edge` of the path.
    #[inline]
    pub fn at_edge(&mut self, edge: usize) {
        self.edge = u32::try_from(edge).unwrap_or(u32::MAX);
    }

    /// Assigns all further numbers to the next edge of the path.
    #[inline]
    pub fn next_edge(&mut self) {
        self.edge = self.edge.saturating_add(1);
    }

    /// Returns the random bits of a number.
    #[inline]
    fn bits(&mut self) -> u64 {
        self.random.next_u64() >> (64 - BITS)
    }

    /// Replaces the leading digits by digits of the point of the replicate, if there is one.
    #[inline]
    fn refined(&self, bits: u64, dimension: u32) -> u64 {
        let refined = |points: &Points| points.refined(bits, self.edge, dimension);
        self.points.as_ref().map_or(bits, refined)
    }
}

fn to_unit(bits: u64) -> f64 {
    bits as f64 * (1.0 / (1u64 << BITS) as f64)
}

/// Hashes the address, with one bijective mixing round per word. The keys of the two halves and the
/// key of replicates are digits of π.
fn hash(key: u64, address: [u64; 3]) -> u64 {
    address
        .into_iter()
        .fold(key, |h, word| mix(h ^ word).wrapping_add(key))
}

/// Returns true if `number` belongs to a fraction 2^−`halvings` of all numbers. The fraction is
/// evenly distributed, and contains the fractions of more halvings.
pub fn in_fraction(number: u64, halvings: u32) -> bool {
    mix(number).leading_zeros() >= halvings
}

/// Applies SplitMix64's increment and finaliser (Steele, Lea and Flood 2014; Stafford's variant
/// 13), a bijection. Each input bit flips each output bit with probability close to one half.
pub(super) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
