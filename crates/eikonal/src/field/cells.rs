//! Cells of regular grids.
//!
//! Coordinates are rounded down by additions. A number added to `LAST_BIT` is rounded to an
//! integer, which the last bits of the sum hold. This takes a tenth of the instructions of
//! saturating conversions.

use glam::DVec3;

/// Integer that represents a coordinate of zero in sums with `LAST_BIT`. Coordinates must be larger
/// than −`ORIGIN`.
const ORIGIN: isize = 8;
/// Constant 1.5·2⁵² + `ORIGIN`. The last bit of this number, and of its sums with coordinates, has
/// the value 1, because they are far from powers of two.
const LAST_BIT: f64 = 6_755_399_441_055_744.0 + ORIGIN as f64;
/// Bits of a sum that hold its offset from 1.5·2⁵².
const INTEGER: u64 = (1 << 51) - 1;

/// Returns the cell of a place, in units of cells, and the fraction of the cell there, in [0, 1].
/// On the border of two cells, either may be returned. Places must lie between −7 and 2⁵⁰.
#[inline(always)]
pub(super) fn located(t: DVec3) -> ([isize; 3], DVec3) {
    let sum = (t - 0.5) + LAST_BIT;
    (sum.to_array().map(integer), t - (sum - LAST_BIT))
}

/// Returns the integer to which a number was rounded when it was added to [`LAST_BIT`], given the
/// sum.
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
        // A place just below a border of cells lies in the cell before it.
        let just_below = DVec3::new(1.0, 2.0, 1e6) * (1.0 - f64::EPSILON);
        assert_eq!(located(just_below).0, [0, 1, 999_999]);
    }
}
