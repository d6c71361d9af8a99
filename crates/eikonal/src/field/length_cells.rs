//! Length scales in the cells of an octree, computed where rays first need them
//! (docs/theory.md#formulas).

use glam::DVec3;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Binary exponents of the coordinates for which cells are stored. Other places are outside of any
/// scene, and their length scales are computed anew at each query.
const EXPONENTS: std::ops::Range<i32> = -64..64;
/// Length scale at the centre of a cell in units of the cell's edge, from which on the cell is not
/// divided. The bound is then at least 0.64 of the length scale, and 0.88 on average.
const MIN_LENGTH_PER_EDGE: f64 = 4.0;
/// Maximum number of divisions of a root. Length scales below the smallest edge are computed anew.
const MAX_DEPTH: usize = 32;
/// Maximum number of stored cells: 32 MiB.
const MAX_CELLS: usize = 1 << 20;

/// Lower bounds of a 1-Lipschitz length scale.
///
/// The bound at a place depends on the place alone, so that rays are the same in any order and on
/// any number of threads. Clones of a field share its cells.
#[derive(Debug)]
pub(super) struct LengthCells {
    /// A cube around the origin for each of [`EXPONENTS`]. A place belongs to the smallest cube
    /// that contains it.
    roots: [Cell; EXPONENTS.end.abs_diff(EXPONENTS.start) as usize],
    /// Number of stored cells.
    count: AtomicUsize,
}

/// A cell, with the length scale at its centre and its eight parts, as far as they are needed.
#[derive(Debug, Default)]
struct Cell {
    length: OnceLock<f64>,
    parts: OnceLock<Box<[Cell; 8]>>,
}

impl LengthCells {
    pub(super) fn new() -> Self {
        LengthCells {
            roots: std::array::from_fn(|_| Cell::default()),
            count: AtomicUsize::new(0),
        }
    }

    /// Returns the bound at `x` for the length scale `exact`, a function of position.
    pub(super) fn at(&self, x: DVec3, exact: impl Fn(DVec3) -> f64) -> f64 {
        let exponent = exponent_above(x.abs().max_element());
        if !x.is_finite() || exponent >= EXPONENTS.end {
            return exact(x);
        }
        let root = exponent.max(EXPONENTS.start);
        let mut cell = Some(&self.roots[(root - EXPONENTS.start) as usize]);
        let (mut center, mut half) = (DVec3::ZERO, 2f64.powi(root));
        for _ in 0..MAX_DEPTH {
            let length = match cell {
                Some(cell) => *cell.length.get_or_init(|| exact(center)),
                None => exact(center),
            };
            if length >= MIN_LENGTH_PER_EDGE * 2.0 * half {
                return length - x.distance(center);
            }
            // Go to the part that contains the place.
            half *= 0.5;
            let beyond = x.cmpge(center);
            center += DVec3::select(beyond, DVec3::splat(half), DVec3::splat(-half));
            let part = beyond.bitmask() as usize;
            cell = cell.and_then(|cell| Some(&self.parts(cell)?[part]));
        }
        exact(x)
    }

    /// Returns the parts of a cell; `None` if they are not stored for lack of memory.
    fn parts<'a>(&self, cell: &'a Cell) -> Option<&'a [Cell; 8]> {
        if let Some(parts) = cell.parts.get() {
            return Some(parts);
        }
        if self.count.load(Ordering::Relaxed) >= MAX_CELLS {
            return None;
        }
        Some(cell.parts.get_or_init(|| {
            self.count.fetch_add(8, Ordering::Relaxed);
            Box::default()
        }))
    }

    /// Returns the memory in bytes.
    pub(super) fn memory(&self) -> usize {
        size_of::<Self>() + self.count.load(Ordering::Relaxed) * size_of::<Cell>()
    }
}

/// Returns the smallest e for which 2^e exceeds a number that is not negative. Subnormal numbers
/// have the exponent of the smallest normal number.
fn exponent_above(number: f64) -> i32 {
    let biased = (number.to_bits() >> 52) as i32;
    biased - 1022
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Length scale that falls to zero at a place off the origin, with the slope 1.
    fn distance(x: DVec3) -> f64 {
        x.distance(DVec3::new(3.0, -1.0, 0.5))
    }

    fn places() -> impl Iterator<Item = DVec3> {
        (0..4000).map(|i| {
            let turn = |by: f64| (by * f64::from(i)).sin();
            DVec3::new(turn(0.7), turn(1.3), turn(2.9)) * 2f64.powi(i % 24 - 12)
        })
    }

    #[test]
    fn bounds_are_below_the_length_scale_and_close_to_it() {
        let cells = LengthCells::new();
        for x in places() {
            let (bound, exact) = (cells.at(x, distance), distance(x));
            assert!(bound <= exact * (1.0 + 1e-12), "{x}: {bound} {exact}");
            assert!(bound >= 0.64 * exact, "{x}: {bound} {exact}");
        }
        assert!(cells.memory() < 4 << 20);
    }

    #[test]
    fn bounds_do_not_depend_on_the_order_of_queries() {
        let (cells, others) = (LengthCells::new(), LengthCells::new());
        let reversed: Vec<_> = places().collect();
        let mut reversed: Vec<_> = reversed
            .iter()
            .rev()
            .map(|&x| others.at(x, distance))
            .collect();
        reversed.reverse();
        let forward: Vec<_> = places().map(|x| cells.at(x, distance)).collect();
        assert_eq!(forward, reversed);
        // Full memory changes no bound.
        others.count.store(MAX_CELLS, Ordering::Relaxed);
        let x = DVec3::new(2.999, -1.001, 0.501);
        assert_eq!(others.at(x, distance), cells.at(x, distance));
    }

    #[test]
    fn extreme_places_have_bounds() {
        let [infinite, flat] = [LengthCells::new(), LengthCells::new()];
        let places = [0.0, 5e-324, 1e-300, 1.0, 1e30, 1e300];
        for x in places.into_iter().chain([f64::INFINITY, f64::NAN]) {
            let x = DVec3::splat(x);
            assert_eq!(infinite.at(x, |_| f64::INFINITY), f64::INFINITY);
            assert_eq!(flat.at(x, |_| 0.0), 0.0);
        }
    }
}
