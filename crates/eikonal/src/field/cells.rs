//! Cells of regular grids.
//!
//! Coordinates are rounded down by additions: added to `LAST_BIT`, a number is rounded to an integer, which the last bits of the sum
//! hold. This takes a tenth of the instructions of conversions that saturate.

use glam::DVec3;

/// What a coordinate of zero becomes in `LAST_BIT`: coordinates are more than this below zero.
const ORIGIN: isize = 8;
/// A number whose last bit is worth 1, so far from powers of two that sums with coordinates are, too.
const LAST_BIT: f64 = 6_755_399_441_055_744.0 + ORIGIN as f64;
/// The bits of such a sum that count from 1.5·2⁵².
const INTEGER: u64 = (1 << 51) - 1;

/// The cell of a place in units of cells, and the fraction of it there, in [0, 1]. Where cells meet, either may be taken. Places lie
/// between −7 and 2⁵⁰.
#[inline(always)]
pub(super) fn located(t: DVec3) -> ([isize; 3], DVec3) {
    let sum = (t - 0.5) + LAST_BIT;
    (sum.to_array().map(integer), t - (sum - LAST_BIT))
}

/// The number that was rounded to an integer by adding it to [`LAST_BIT`], given the sum.
#[inline(always)]
fn integer(sum: f64) -> isize {
    (sum.to_bits() & INTEGER) as isize - ORIGIN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_in_their_cells() {
        for t in [-6.7, -1.0, -0.3, 0.0, 0.4, 1.0, 2.0, 6.99, 7.0, 123_456.25] {
            let (cell, fraction) = located(DVec3::splat(t));
            assert!((cell[0] as f64 + fraction.x - t).abs() < 1e-15);
            assert!((0.0..=1.0).contains(&fraction.x), "{t}");
        }
        // What is just below a place where cells meet lies before it.
        let just_below = DVec3::new(1.0, 2.0, 1e6) * (1.0 - f64::EPSILON);
        assert_eq!(located(just_below).0, [0, 1, 999_999]);
    }
}
