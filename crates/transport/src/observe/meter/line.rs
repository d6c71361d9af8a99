//! Cells of a Cartesian grid along a straight line (docs/theory.md#cutting-arcs), after J.
//! Amanatides and A. Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987.

use super::grid::{Coordinates, MeterGrid};
use crate::volume::{cell_of, number_of};
use glam::DVec3;

impl MeterGrid {
    /// Calls `see` with each cell along a straight line, in order, and the fractions of the line at
    /// which it enters and leaves the cell. Neighbouring cells share these fractions, so that the
    /// pieces make up the whole line. Returns `None` if the grid is not Cartesian.
    #[inline]
    pub(super) fn along_line(
        &self,
        ends: [DVec3; 2],
        mut see: impl FnMut(usize, [f64; 2]),
    ) -> Option<()> {
        if self.coordinates() != Coordinates::Cartesian {
            return None;
        }
        let ends = ends.map(|x| self.in_cells(x));
        let top = self.top();
        let cells = ends.map(cell_of);
        if cells[0] == cells[1]
            && let Some(cell) = number_of(cells[0], top)
        {
            see(cell, [0.0, 1.0]);
        } else if let Some(mut line) = Crossing::of(ends, cells, top) {
            while line.left > 0.0 {
                let (cell, piece) = line.next();
                see(cell, piece);
            }
            see(line.number(), [line.from, line.leave]);
        }
        Some(())
    }
}

/// Traversal of the cells along a line, at its current cell.
struct Crossing {
    /// Start of the line; `step` is the vector to its other end, both in cells.
    start: DVec3,
    step: DVec3,
    top: DVec3,
    here: DVec3,
    /// Last cell; `left` is the number of cells up to it.
    there: DVec3,
    left: f64,
    /// Fraction of the line at the next face along each axis.
    next: DVec3,
    /// Fraction of the line at which it enters the current cell; `leave` is the fraction at which
    /// it leaves the grid.
    from: f64,
    leave: f64,
}

impl Crossing {
    /// Creates a traversal at the first cell of a line, given the cells of its ends. Returns `None`
    /// if the line misses the grid.
    fn of([a, b]: [DVec3; 2], cells: [DVec3; 2], top: DVec3) -> Option<Self> {
        let step = b - a;
        let are_inside = cells.iter().all(|cell| number_of(*cell, top).is_some());
        let ([from, leave], [here, there]) = if are_inside {
            ([0.0, 1.0], cells)
        } else {
            let shares = clip(a, step, top)?;
            let cell = |share: f64| cell_of(a + step * share).clamp(DVec3::ZERO, top - 1.0);
            (shares, shares.map(cell))
        };
        let mut line = Crossing {
            start: a,
            step,
            top,
            here,
            there,
            left: (there - here).abs().element_sum(),
            next: DVec3::ZERO,
            from,
            leave,
        };
        line.next = DVec3::new(line.face(0), line.face(1), line.face(2));
        Some(line)
    }

    /// Returns the index of the current cell, which is in the grid.
    #[inline]
    fn number(&self) -> usize {
        number_of(self.here, self.top).unwrap_or_default()
    }

    /// Returns the fraction of the line at the next face across an axis.
    #[inline]
    fn face(&self, axis: usize) -> f64 {
        let (here, there) = (self.here[axis], self.there[axis]);
        if here == there {
            return f64::INFINITY;
        }
        let face = if there > here { here + 1.0 } else { here };
        (face - self.start[axis]) / self.step[axis]
    }

    /// Returns the current cell with the fractions of the line in it, and steps to the next cell,
    /// which must exist.
    #[inline]
    fn next(&mut self) -> (usize, [f64; 2]) {
        let [x, y, z] = self.next.to_array();
        let axis = if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        let (cell, to) = (self.number(), self.next[axis].clamp(self.from, self.leave));
        let piece = [self.from, to];
        self.here[axis] += (self.there[axis] - self.here[axis]).signum();
        self.left -= 1.0;
        self.next[axis] = self.face(axis);
        self.from = to;
        (cell, piece)
    }
}

/// Returns the fractions of a line between which it is in the box of all cells.
fn clip(start: DVec3, step: DVec3, top: DVec3) -> Option<[f64; 2]> {
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for axis in 0..3 {
        let (a, d, top) = (start[axis], step[axis], top[axis]);
        if d == 0.0 {
            if !(0.0..=top).contains(&a) {
                return None;
            }
            continue;
        }
        let [p, q] = [-a / d, (top - a) / d];
        (enter, leave) = (enter.max(p.min(q)), leave.min(p.max(q)));
    }
    (enter < leave).then_some([enter, leave])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DMat3};

    /// Along random lines, within the grid and through it, each piece lies in its cell, and all
    /// pieces in cells are found.
    #[test]
    fn pieces_of_lines_lie_in_their_cells() {
        let columns = [[1.0, 0.2, 0.0], [0.0, 0.8, 0.3], [0.1, 0.0, 0.5]];
        let to_world =
            DAffine3::from_mat3_translation(DMat3::from_cols_array_2d(&columns), DVec3::NEG_ONE);
        let grid = MeterGrid::new(Coordinates::Cartesian, [7, 4, 5], to_world).unwrap();
        let mut rng = testkit::Rng::new(1);
        let mut next = || rng.next_1d();
        let mut crossed = 0;
        for i in 0..3000 {
            let size = [0.9, 3.0, 1e17][i % 3];
            let mut end = || (DVec3::new(next(), next(), next()) - 0.5) * size + 0.5;
            let [mut a, mut b] = [end(), end()];
            match i % 5 {
                // The line is parallel to an axis, lies in a face, or starts at a corner.
                0 => b.z = a.z,
                1 => (a.y, b.y, b.x) = (0.5, 0.5, a.x),
                2 => a = DVec3::new(0.0, 0.25, 1.0),
                _ => {}
            }
            let ends = [a, b].map(|p| to_world.transform_point3(p));
            let at = |share: f64| ends[0] + (ends[1] - ends[0]) * share;
            let mut pieces = Vec::new();
            let seen = grid.along_line(ends, |cell, piece| pieces.push((cell, piece)));
            assert_eq!(seen, Some(()));
            assert!(pieces.windows(2).all(|p| p[0].1[1] == p[1].1[0]));
            for &(cell, [from, to]) in &pieces {
                assert!(from <= to);
                if to - from > 1e-6 {
                    // For lines in a face, either neighbouring cell is right.
                    let middle = at(0.5 * (from + to));
                    let beside = |i: i32| {
                        DVec3::new(
                            f64::from(i & 2) - 1.0,
                            f64::from(i & 4) / 2.0 - 1.0,
                            f64::from(i & 1) * 2.0 - 1.0,
                        )
                    };
                    let near = (0..8).any(|i| grid.cell(middle + 1e-9 * beside(i)) == Some(cell));
                    assert!(near, "{ends:?}");
                }
            }
            let seen: f64 = pieces.iter().map(|(_, [from, to])| to - from).sum();
            let inside = |k: &u32| grid.cell(at((f64::from(*k) + 0.5) / 1000.0)).is_some();
            let found = (0..1000).filter(inside).count() as f64 / 1000.0;
            // For lines that touch the grid along its boundary, either answer is right.
            assert!(
                (seen - found).abs() < 2.1e-3 || i % 5 == 2,
                "{seen} {found} {ends:?}"
            );
            crossed += usize::from(pieces.len() > 1);
        }
        assert!(crossed > 1000, "{crossed}");
    }
}
