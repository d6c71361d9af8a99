//! Points that fill the unit cube more evenly than chance: digital nets, scrambled as by Owen (1997).
//!
//! The points of a replicate are the samples of one pixel. Each is uniform in the cube, so means over a replicate are
//! unbiased; together they are spread evenly, so the variance of a replicate's mean is less than that of as many
//! independent samples. Replicates are scrambled independently: a replicate's mean is one independent sample, and the
//! only thing of which a variance can be told.
//!
//! Theory: docs/theory.md#randomised-qmc-replicates.

use super::sampler::mix;
use serde::{Deserialize, Serialize};

/// How the samples of a pixel belong together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Replicates {
    /// Each is independent of all others.
    #[default]
    Single,
    /// Eight are spread evenly: few enough to leave a render of 64 samples with eight means to tell its error from
    /// (docs/performance.md).
    OfEight,
    /// Sixty-four are: they gain more where images are smooth, for renders of many samples.
    OfSixtyFour,
}

impl Replicates {
    /// All kinds.
    pub const ALL: [Replicates; 3] = [
        Replicates::Single,
        Replicates::OfEight,
        Replicates::OfSixtyFour,
    ];

    /// Name, as command lines use it.
    pub fn name(self) -> &'static str {
        ["independent", "ldsampler", "ldsampler:64"][self as usize]
    }

    /// Samples in a replicate, a power of two.
    pub fn size(self) -> u64 {
        match self {
            Replicates::Single => 1,
            Replicates::OfEight => 8,
            Replicates::OfSixtyFour => 64,
        }
    }

    /// The least number of samples, at least `samples`, that are whole replicates.
    pub fn whole(self, samples: u64) -> u64 {
        samples.div_ceil(self.size()).saturating_mul(self.size())
    }
}

/// What a number is for: the first of its dimensions among those of an edge. Four neighbours are spread evenly
/// together (`GROUP`), so those that act together are neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Two: the direction in which an edge starts; of the first edge, the place in the pixel.
    Direction = 0,
    /// How far it goes.
    Distance = 2,
    /// The distance of a point around an emitter along it.
    Around = 3,
    /// Two: the place on the emitter to which its end is connected.
    ConnectionEnd = 4,
    /// That emitter.
    Emitter = 6,
    /// The lobe of the surface at which an edge starts.
    Lobe = 7,
    /// Two: the place on the emitter to which the point around it is connected.
    AroundAim = 8,
    /// That emitter.
    AroundEmitter = 10,
    /// Whether an edge starts towards an emitter.
    Attraction = 11,
    /// The channel whose extinction is sampled.
    Channel = 12,
    /// Whether the path goes on, after the edge was chosen.
    Roulette = 13,
    /// Two: the place on the lens; of the first edge.
    Lens = 14,
    /// Four: whether it is reflected or refracted at the first smooth surfaces on its way.
    Specular = 16,
}

/// Specular events of an edge with dimensions of their own.
pub(super) const SPECULAR_EVENTS: u32 = 4;

/// Bits of a random number.
pub(super) const BITS: u32 = 53;
/// Dimensions of an edge.
const DIMENSIONS: u32 = Purpose::Specular as u32 + SPECULAR_EVENTS;
/// Edges with points: later ones have lost the memory of the first.
const EDGES: u32 = 4;
/// Dimensions that are spread evenly together. Groups take the points of a replicate in orders of their own: of so few
/// points, those in more dimensions would depend on one another.
const GROUP: u32 = 4;

/// N points by their leading binary digits.
struct Net<const N: usize> {
    /// The digits, by dimension of a group.
    points: [[u8; N]; GROUP as usize],
    /// The powers of a generator of the field of N elements, as polynomials over that of two; the last is the first again.
    powers: [u8; N],
}

/// A (0, 3, 3)-net in base 2 (Sobol' 1967), so that any division of the cube of the first three into eight boxes with sides
/// that are powers of two has a point in each box. No net has a fourth dimension; this one misses as few divisions as can be.
static OF_EIGHT: Net<8> = Net {
    points: [
        [0, 1, 2, 3, 4, 5, 6, 7],
        [0, 4, 2, 6, 1, 5, 3, 7],
        [0, 4, 6, 2, 5, 1, 3, 7],
        [0, 7, 5, 2, 3, 4, 6, 1],
    ],
    powers: powers(0b1011),
};

/// A (0, 6, 3)-net, likewise, and a fourth dimension: the numbers of points and the first three dimensions of Sobol's sequence.
static OF_SIXTY_FOUR: Net<64> = Net {
    points: [
        sobol([1, 2, 4, 8, 16, 32]),
        sobol([32, 16, 8, 4, 2, 1]),
        sobol([32, 48, 40, 60, 34, 51]),
        sobol([32, 48, 24, 36, 58, 23]),
    ],
    powers: powers(0b100_0011),
};

/// The digits of 64 points in one dimension, given what each binary digit of their numbers adds.
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

/// The powers of x modulo a primitive polynomial.
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

    /// The place of a point in a random order: i ↦ a i + b in the field of N elements, a ≠ 0. Any two points get any two
    /// places with equal probability, which is all that variances know of an order.
    fn place(&self, index: u32, random: u32) -> usize {
        let n = N as u32;
        let (shift, factor) = (random % n, random / n);
        let product = match index {
            0 => 0,
            power => u32::from(self.powers[((power + factor) % (n - 1)) as usize]),
        };
        (product ^ shift) as usize
    }

    /// A number with the digits of a place, scrambled, in front of those that it has.
    fn refined(&self, number: u64, dimension: usize, place: usize, random: u64) -> u64 {
        let digits = u64::from(self.points[dimension][place]);
        // Each digit is flipped or not, as a bit says that belongs to the digits before it: nested scrambling.
        let flips = (0..Self::DIGITS).fold(0, |flips, level| {
            let bit = (1 << level) - 1 + (digits >> (Self::DIGITS - level));
            flips << 1 | random >> bit & 1
        });
        (digits ^ flips) << (BITS - Self::DIGITS) | number >> Self::DIGITS
    }
}

/// A point of a replicate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points {
    /// Its number in the replicate.
    pub index: u32,
    /// Random key of the replicate.
    pub key: u64,
    /// The kind of replicate.
    pub replicates: Replicates,
}

impl Points {
    /// A number of [`BITS`] random bits for a dimension of an edge, with the point's leading digits where numbers are spread.
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
