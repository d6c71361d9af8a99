//! Points that fill the unit cube more evenly than independent random points: digital nets with
//! Owen scrambling (1997), in groups of four dimensions.
//!
//! The points of a replicate are samples of one pixel. Each point is uniform in the cube, so means
//! over a replicate are unbiased. Together they are evenly distributed, so the mean of a replicate
//! has a smaller variance than the mean of equally many independent samples. Replicates are
//! scrambled independently. Hence the mean of a replicate is one independent sample, and variances
//! are estimated only from means of replicates.
//!
//! Theory: docs/theory.md#randomised-qmc-replicates.

use super::sampler::mix;
use serde::{Deserialize, Serialize};

/// Number of samples in a replicate.
///
/// A replicate is a set of evenly distributed samples of one pixel; replicates are independent of
/// one another. Larger replicates gain more, but leave fewer of them from which to estimate the
/// error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Replicates {
    /// Binary logarithm of the number of samples, at most [`MAX_DIGITS`].
    digits: u8,
}

impl Replicates {
    /// Replicates of one sample: each sample is independent of all others.
    pub const SINGLE: Replicates = Replicates { digits: 0 };
    /// Maximum number of samples in a replicate.
    pub const MAX_SAMPLES: u64 = 1 << MAX_DIGITS;

    /// Returns replicates of `size` samples, a power of two between 1 and
    /// [`MAX_SAMPLES`](Self::MAX_SAMPLES); `None` for other sizes.
    pub const fn new(size: u64) -> Option<Self> {
        if size.is_power_of_two() && size <= Self::MAX_SAMPLES {
            let digits = size.trailing_zeros() as u8;
            Some(Replicates { digits })
        } else {
            None
        }
    }

    /// Returns all sizes, in ascending order.
    pub fn all() -> impl DoubleEndedIterator<Item = Self> {
        (0..=MAX_DIGITS as u8).map(|digits| Replicates { digits })
    }

    /// Returns the name used on command lines: `independent`, or `ldsampler:` and the size.
    pub fn name(self) -> String {
        match self.size() {
            1 => "independent".into(),
            size => format!("ldsampler:{size}"),
        }
    }

    /// Returns the number of samples in a replicate.
    pub fn size(self) -> u64 {
        1 << self.digits
    }

    /// Returns the smallest multiple of the replicate size that is at least `samples`.
    pub fn whole(self, samples: u64) -> u64 {
        samples.div_ceil(self.size()).saturating_mul(self.size())
    }
}

/// Purpose of a random number. Its value is the first of its dimensions among the dimensions of an
/// edge. Each group of four consecutive dimensions is evenly distributed jointly (`GROUP`), so
/// dimensions that act together are adjacent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Direction in which an edge starts; for the first edge, the position in the pixel. Two
    /// dimensions.
    Direction = 0,
    /// Length of the edge.
    Distance = 2,
    /// Distance along the edge of a point around an emitter.
    Around = 3,
    /// Position on the emitter to which the end of the edge is connected. Two dimensions.
    ConnectionEnd = 4,
    /// Choice of the emitter to which the end of the edge is connected.
    Emitter = 6,
    /// Lobe of the surface at which an edge starts.
    Lobe = 7,
    /// Position on the emitter to which the point around it is connected. Two dimensions.
    AroundAim = 8,
    /// Choice of the emitter to which the point around it is connected.
    AroundEmitter = 10,
    /// Decision to start an edge towards an emitter.
    Attraction = 11,
    /// Channel whose extinction is sampled.
    Channel = 12,
    /// Decision to continue the path, after the edge was chosen.
    Roulette = 13,
    /// Position on the lens, for the first edge. Two dimensions.
    Lens = 14,
    /// Choices between reflection and refraction at the first smooth surfaces along the edge. Four
    /// dimensions.
    Specular = 16,
}

/// Number of specular events of an edge with dimensions of their own.
pub(super) const SPECULAR_EVENTS: u32 = 4;

/// Number of bits of a random number: the precision of `f64`.
pub(super) const BITS: u32 = 53;
/// Number of dimensions of an edge.
const DIMENSIONS: u32 = Purpose::Specular as u32 + SPECULAR_EVENTS;
/// Number of edges with evenly distributed points. Later edges depend too little on the first ones.
const EDGES: u32 = 4;
/// Number of dimensions that are evenly distributed jointly. Groups take the points of a replicate
/// in different orders. Small replicates would relate more dimensions to one another.
const GROUP: u32 = 4;
/// Maximum number of binary digits in which the points of a replicate are evenly distributed.
const MAX_DIGITS: u32 = 10;
/// Maximum number of points in a replicate.
const MAX_POINTS: usize = 1 << MAX_DIGITS;

/// Sobol's sequence in the dimension of the polynomial x + 1 (Sobol' 1967).
static SOBOL_1: [u16; MAX_POINTS] = sobol([1, 3, 5, 15, 17, 51, 85, 255, 257, 771]);
/// Sobol's sequence in the dimension of the polynomial x² + x + 1 (Sobol' 1967).
static SOBOL_2: [u16; MAX_POINTS] = sobol([1, 3, 3, 9, 29, 23, 71, 197, 209, 627]);

/// Powers of a generator of the finite field of N elements, for each power of two N. Elements N to
/// 2 N − 1 of the array hold them, as polynomials over the field of two elements.
static POWERS: [u16; 2 * MAX_POINTS] = powers([
    0b1,
    0b11,
    0b111,
    0b1011,
    0b1_0011,
    0b10_0101,
    0b100_0011,
    0b1000_0011,
    0b1_0001_1101,
    0b10_0001_0001,
    0b100_0000_1001,
]);

/// Computes the first points of Sobol's sequence from the direction numbers of a dimension (Joe and
/// Kuo 2008), as [`MAX_DIGITS`] binary digits.
const fn sobol(directions: [u16; MAX_DIGITS as usize]) -> [u16; MAX_POINTS] {
    let mut points = [0; MAX_POINTS];
    let mut i = 0;
    while i < MAX_POINTS {
        let mut bit = 0;
        while bit < MAX_DIGITS as usize {
            let direction = directions[bit] << (MAX_DIGITS as usize - 1 - bit);
            points[i] ^= direction * (i >> bit & 1) as u16;
            bit += 1;
        }
        i += 1;
    }
    points
}

/// Computes the powers of x modulo primitive polynomials of all degrees up to [`MAX_DIGITS`].
const fn powers(polynomials: [usize; MAX_DIGITS as usize + 1]) -> [u16; 2 * MAX_POINTS] {
    let mut powers = [1; 2 * MAX_POINTS];
    let mut degree = 1;
    while degree < polynomials.len() {
        let n = 1 << degree;
        let mut i = 1;
        while i < n {
            let twice = 2 * powers[n + i - 1] as usize;
            let power = if twice < n {
                twice
            } else {
                twice ^ polynomials[degree]
            };
            powers[n + i] = power as u16;
            i += 1;
        }
        degree += 1;
    }
    powers
}

/// Point of a replicate: a (0, m, 3)-net of N = 2^m points in base 2, with a fourth dimension.
/// Divide the cube of the first three dimensions into N boxes with sides that are powers of two:
/// each box contains one point. No net has this property in four dimensions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points {
    /// Index in the replicate.
    index: u32,
    /// Random key of the replicate.
    key: u64,
    /// Binary logarithm m of the number of points, at least 1.
    digits: u32,
}

impl Points {
    /// Returns the point with index `index` of a replicate with the random key `key`; `None` for
    /// replicates of one sample.
    pub(super) fn new(replicates: Replicates, index: u64, key: u64) -> Option<Self> {
        (replicates != Replicates::SINGLE).then(|| Points {
            index: index as u32,
            key,
            digits: u32::from(replicates.digits),
        })
    }

    /// Refines a number of [`BITS`] random bits for a dimension of an edge. On the first edges, its
    /// leading digits become the digits of the point.
    #[inline]
    pub(super) fn refined(&self, number: u64, edge: u32, dimension: u32) -> u64 {
        if edge >= EDGES {
            return number;
        }
        let (random, place) = self.group(edge, dimension / GROUP);
        self.refined_at(number, [random, u64::from(dimension % GROUP)], place)
    }

    /// Refines two numbers like [`Points::refined`], for two consecutive dimensions of one group.
    #[inline]
    pub(super) fn refined_pair(&self, numbers: [u64; 2], edge: u32, dimension: u32) -> [u64; 2] {
        if edge >= EDGES {
            return numbers;
        }
        debug_assert!(dimension % GROUP + 1 < GROUP);
        let (random, place) = self.group(edge, dimension / GROUP);
        let first = u64::from(dimension % GROUP);
        [(0, first), (1, first + 1)]
            .map(|(i, within)| self.refined_at(numbers[i], [random, within], place))
    }

    /// Returns the random key of a group of dimensions of an edge, and the position of the point in
    /// the group's order.
    #[inline]
    fn group(&self, edge: u32, group: u32) -> (u64, u32) {
        let random = mix(self.key ^ u64::from(edge * DIMENSIONS + group));
        (random, self.place(random))
    }

    /// Refines a number for dimension `within` of the group with the key `random`, where the point
    /// has the position `place`.
    #[inline]
    fn refined_at(&self, number: u64, [random, within]: [u64; 2], place: u32) -> u64 {
        let digits = self.digits_of(place, within as u32);
        let scrambled = self.scramble(digits, mix(random ^ within) as u32);
        u64::from(scrambled) << (BITS - self.digits) | number >> self.digits
    }

    /// Returns the position of the point in a random order: i ↦ a i + b in the field of N elements,
    /// a ≠ 0. Any two points get any two positions with equal probability. Variances depend on
    /// nothing else.
    fn place(&self, random: u64) -> u32 {
        let n = 1 << self.digits;
        let shift = random as u32 & (n - 1);
        // Planted error "groups of dimensions in one order", found by morgana-transport/transport::points::groups_are_paired_at_random:
        // let factor = 0;
        let factor = ((u128::from(random) * u128::from(n - 1)) >> 64) as u32;
        let product = match self.index {
            0 => 0,
            power => {
                let power = power + factor;
                let reduced = if power < n { power } else { power - (n - 1) };
                u32::from(POWERS[(n + reduced) as usize])
            }
        };
        product ^ shift
    }

    /// Returns the digits of the net's point `place` in a dimension of a group.
    fn digits_of(&self, place: u32, within: u32) -> u32 {
        let sobol =
            |points: &[u16]| u32::from(points[place as usize]) >> (MAX_DIGITS - self.digits);
        match within {
            0 => place,
            1 => self.reversed(place),
            2 => sobol(&SOBOL_1),
            _ => sobol(&SOBOL_2),
        }
    }

    /// Flips each digit at random, depending on the digits before it (nested scrambling). A hash
    /// replaces the tree of random bits (Burley, "Practical Hash-based Owen Scrambling", JCGT 2020;
    /// Vegdahl's constants).
    fn scramble(&self, digits: u32, seed: u32) -> u32 {
        let mut x = self.reversed(digits);
        x ^= x.wrapping_mul(0x3d20_adea);
        x = x.wrapping_add(seed);
        x = x.wrapping_mul(seed >> 16 | 1);
        x ^= x.wrapping_mul(0x0552_6c56);
        x ^= x.wrapping_mul(0x53a2_2864);
        // Planted error "points without scrambling", found by morgana-transport/transport::points::points_are_uniform_and_replicates_independent:
        // digits
        self.reversed(x)
    }

    /// Reverses the order of the last digits of a number, and drops all others.
    fn reversed(&self, number: u32) -> u32 {
        number.reverse_bits() >> (32 - self.digits)
    }
}
