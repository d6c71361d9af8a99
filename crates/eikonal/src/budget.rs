//! How much work one ray and one connection may take: the end of what would not end by itself, or not in reasonable time.
//! What is given up here is counted wherever it is reported, for its light is missing.

/// Steps of a ray, or of the part of a path between two vertices. Rays across a lens take some ten, those through the
/// finest grids thousands; more than these have only rays that circle for ever, or fields that are much finer than
/// the way through them is long.
pub const STEPS_PER_RAY: usize = 20_000;

/// Interfaces that a ray meets: rays that creep along inside a curved one meet it without end.
pub(crate) const CROSSINGS_PER_RAY: u32 = 1_000;

/// Rays shot to find one connection by Newton's method.
pub(crate) const SHOTS_PER_CONNECTION: u32 = 20;

/// Steps of all these rays together.
pub(crate) const STEPS_PER_CONNECTION: u64 = 100_000;

/// Evaluations by the quadratures of an optical path difference: a tenth of a second or so. A field whose structure takes more
/// is too fine for the length of the ray.
pub const EVALUATIONS_PER_DIFFERENCE: u64 = 1 << 21;
