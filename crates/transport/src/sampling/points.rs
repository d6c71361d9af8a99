//! Points that fill the unit cube more evenly than chance: digital nets, scrambled as by Owen (1997).
//!
//! The points of a set are the samples of one pixel. Each is uniform in the cube, so means over a set are
//! unbiased; together they are spread evenly, so the variance of a set's mean is less than that of as many
//! independent samples. Sets are scrambled independently: a set's mean is one independent sample, and the
//! only thing of which a variance can be told.

use super::sampler::mix;
use serde::{Deserialize, Serialize};

/// How the samples of a pixel belong together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Sets {
    /// Each is independent of all others.
    #[default]
    Single,
    /// Eight are spread evenly: enough to gain most of what there is to gain, few enough to leave a render
    /// of 64 samples with eight means to tell its error from (docs/performance.md).
    OfEight,
}

impl Sets {
    /// Samples in a set, a power of two.
    pub fn size(self) -> u64 {
        match self {
            Sets::Single => 1,
            Sets::OfEight => 8,
        }
    }

    /// The least number of samples, at least `samples`, that are whole sets.
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
    Aim = 4,
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
}

/// Dimensions of an edge.
const DIMENSIONS: u32 = 16;
/// Edges with points: later ones have lost the memory of the first.
const EDGES: u32 = 4;
/// Dimensions that are spread evenly together. Groups take the points of a set in orders of their own: of so few
/// points, those in more dimensions would depend on one another.
const GROUP: u32 = 4;

/// The three leading binary digits of eight points, by dimension: a (0, 3, 3)-net in base 2 (Sobol' 1967), so that any
/// division of the cube of the first three into eight boxes with sides that are powers of two has a point in each
/// box. No net has a fourth dimension; this one misses as few divisions as can be.
const NET: [[u32; 8]; GROUP as usize] = [
    [0, 1, 2, 3, 4, 5, 6, 7],
    [0, 4, 2, 6, 1, 5, 3, 7],
    [0, 4, 6, 2, 5, 1, 3, 7],
    [0, 7, 5, 2, 3, 4, 6, 1],
];

/// The powers of a generator of the field of eight elements, as polynomials over that of two.
const POWERS: [u32; 7] = [1, 2, 4, 3, 6, 7, 5];

/// A point of a set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points {
    /// Its number in the set.
    pub index: u32,
    /// Random key of the set.
    pub key: u64,
}

impl Points {
    /// Leading binary digits that are told.
    pub const DIGITS: u32 = 3;

    /// The leading digits of a dimension of an edge; `None` where nothing is spread.
    pub fn digits(&self, edge: u32, dimension: u32) -> Option<u32> {
        if edge >= EDGES {
            return None;
        }
        let (group, within) = (dimension / GROUP, dimension % GROUP);
        let random = mix(self.key ^ u64::from(edge * DIMENSIONS + group));
        let point = self.place((random >> 32) as u32);
        let digits = NET[within as usize][point as usize];
        Some(scrambled(digits, (random >> (7 * within)) as u32))
    }

    /// Its place in a random order: i ↦ a i + b in the field of eight elements, a ≠ 0. Any two points get any two
    /// places with equal probability, which is all that variances know of an order.
    fn place(&self, random: u32) -> u32 {
        let (shift, factor) = (random % 8, random / 8);
        let product = match self.index {
            0 => 0,
            power => POWERS[((power + factor) % 7) as usize],
        };
        product ^ shift
    }
}

/// Nested scrambling of three digits by seven random bits: each digit is flipped or not, as a bit says that belongs to
/// the digits before it.
fn scrambled(digits: u32, bits: u32) -> u32 {
    let flip = |bit: u32| bits >> bit & 1;
    digits ^ flip(0) << 2 ^ flip(1 + (digits >> 2)) << 1 ^ flip(3 + (digits >> 1))
}
