//! Limits on the work of one ray and of one connection.
//!
//! The limits end computations that would take too long or for ever. Reports count every
//! computation that was abandoned, because its light is missing.

/// Maximum number of steps of a ray, or of the part of a path between two vertices. Rays across a
/// lens take about ten steps, rays through the finest grids thousands. More steps are taken only by
/// rays that circle for ever, or in fields much finer than the length of the ray.
pub const STEPS_PER_RAY: usize = 20_000;

/// Maximum number of interfaces that a ray meets. Rays that creep along inside a curved interface
/// would meet it without end.
pub(crate) const CROSSINGS_PER_RAY: u32 = 1_000;

/// Maximum number of rays traced by Newton's method to find one connection.
pub(crate) const SHOTS_PER_CONNECTION: u32 = 20;

/// Maximum number of steps of all rays traced for one connection.
pub(crate) const STEPS_PER_CONNECTION: u64 = 100_000;

/// Maximum number of field evaluations by the quadratures of an optical path difference; they take
/// about a tenth of a second. A field that needs more has too fine a structure for the length of
/// the ray.
pub const EVALUATIONS_PER_DIFFERENCE: u64 = 1 << 21;
