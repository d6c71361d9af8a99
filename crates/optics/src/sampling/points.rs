//! Points that fill the unit cube more evenly than independent random points: digital nets with
//! Owen scrambling (1997).
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

/// Grouping of the samples of a pixel into replicates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Replicates {
    /// Each sample is independent of all others.
    #[default]
    Single,
    /// Replicates of eight evenly distributed samples. A render of 64 samples still has eight means
    /// from which to estimate its error (docs/performance.md).
    OfEight,
    /// Replicates of 64 evenly distributed samples. They gain more where images are smooth, and
    /// suit renders of many samples.
    OfSixtyFour,
}

impl Replicates {
    /// All variants.
    pub const ALL: [Replicates; 3] = [
        Replicates::Single,
        Replicates::OfEight,
        Replicates::OfSixtyFour,
    ];

    /// Returns the name used on command lines.
    pub fn name(self) -> &'static str {
        ["independent", "ldsampler", "ldsampler:64"][self as usize]
    }

    /// Returns the number of samples in a replicate, a power of two.
    pub fn size(self) -> u64 {
        match self {
            Replicates::Single => 1,
            Replicates::OfEight => 8,
            Replicates::OfSixtyFour => 64,
        }
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

/// Number of bits of a random number.
pub(super) const BITS: u32 = 53;
/// Number of dimensions of an edge.
const DIMENSIONS: u32 = Purpose::Specular as u32 + SPECULAR_EVENTS;
/// Number of edges with evenly distributed points. Later edges depend too little on the first ones.
const EDGES: u32 = 4;
/// Number of dimensions that are evenly distributed jointly. Groups take the points of a replicate
/// in different orders. With so few points, more dimensions would depend on one another.
const GROUP: u32 = 4;

/// Net of N points, given by their leading binary digits.
struct Net<const N: usize> {
    /// Digits, by dimension of a group.
    points: [[u8; N]; GROUP as usize],
    /// Powers of a generator of the field of N elements, as polynomials over the field of two
    /// elements. The last power equals the first.
    powers: [u8; N],
}

/// A (0, 3, 3)-net in base 2 (Sobol' 1967). Any division of the cube of the first three dimensions
/// into eight boxes with sides that are powers of two has a point in each box. No net has a fourth
/// dimension; this one misses as few divisions as possible.
static OF_EIGHT: Net<8> = Net {
    points: [
        [0, 1, 2, 3, 4, 5, 6, 7],
        [0, 4, 2, 6, 1, 5, 3, 7],
        [0, 4, 6, 2, 5, 1, 3, 7],
        [0, 7, 5, 2, 3, 4, 6, 1],
    ],
    powers: powers(0b1011),
};

/// A (0, 6, 3)-net in base 2, with a fourth dimension: the indices of points and the first three
/// dimensions of Sobol's sequence.
static OF_SIXTY_FOUR: Net<64> = Net {
    points: [
        sobol([1, 2, 4, 8, 16, 32]),
        sobol([32, 16, 8, 4, 2, 1]),
        sobol([32, 48, 40, 60, 34, 51]),
        sobol([32, 48, 24, 36, 58, 23]),
    ],
    powers: powers(0b100_0011),
};

/// Computes the digits of 64 points in one dimension. `directions` holds the contribution of each
/// binary digit of the index.
const fn sobol(directions: [u8; 6]) -> [u8; 64] {
    let mut points = [0; 64];
    let mut i = 0;
    while i < 64 {
        let mut bit = 0;
        while bit < 6 {
            points[i] ^= directions[bit] * (i >> bit & 1) as u8;
            bit += 1;
        }
        i += 1;
    }
    points
}

/// Computes the powers of x modulo a primitive polynomial.
const fn powers<const N: usize>(polynomial: usize) -> [u8; N] {
    let mut powers = [1; N];
    let mut i = 1;
    while i < N {
        let twice = 2 * powers[i - 1] as usize;
        powers[i] = if twice < N { twice } else { twice ^ polynomial } as u8;
        i += 1;
    }
    powers
}

impl<const N: usize> Net<N> {
    const DIGITS: u32 = N.ilog2();

    /// Returns the position of a point in a random order: i ↦ a i + b in the field of N elements, a
    /// ≠ 0. Any two points get any two positions with equal probability. Variances depend on
    /// nothing else.
    fn place(&self, index: u32, random: u32) -> usize {
        let n = N as u32;
        let (shift, factor) = (random % n, random / n);
        let product = match index {
            0 => 0,
            power => u32::from(self.powers[((power + factor) % (n - 1)) as usize]),
        };
        (product ^ shift) as usize
    }

    /// Returns `number` with the scrambled digits of a position inserted in front of its own bits.
    fn refined(&self, number: u64, dimension: usize, place: usize, random: u64) -> u64 {
        let digits = u64::from(self.points[dimension][place]);
        // Flip each digit according to a bit selected by the digits before it (nested scrambling).
        let flips = (0..Self::DIGITS).fold(0, |flips, level| {
            let bit = (1 << level) - 1 + (digits >> (Self::DIGITS - level));
            flips << 1 | random >> bit & 1
        });
        (digits ^ flips) << (BITS - Self::DIGITS) | number >> Self::DIGITS
    }
}

/// Point of a replicate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points {
    /// Index in the replicate.
    pub index: u32,
    /// Random key of the replicate.
    pub key: u64,
    /// Kind of replicate.
    pub replicates: Replicates,
}

impl Points {
    /// Refines a number of [`BITS`] random bits for a dimension of an edge. On the first edges, its
    /// leading digits become the digits of the point.
    pub(super) fn refined(&self, number: u64, edge: u32, dimension: u32) -> u64 {
        if edge >= EDGES {
            return number;
        }
        let (group, within) = (dimension / GROUP, (dimension % GROUP) as usize);
        let random = mix(self.key ^ u64::from(edge * DIMENSIONS + group));
        let order = (random >> 32) as u32;
        match self.replicates {
            Replicates::Single => number,
            Replicates::OfEight => {
                let place = OF_EIGHT.place(self.index, order);
                OF_EIGHT.refined(number, within, place, random >> (7 * within))
            }
            Replicates::OfSixtyFour => {
                let place = OF_SIXTY_FOUR.place(self.index, order);
                OF_SIXTY_FOUR.refined(number, within, place, mix(random ^ within as u64))
            }
        }
    }
}
