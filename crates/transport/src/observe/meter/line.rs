//! Cells of a Cartesian grid along a straight line or along an arc that bends little
//! (docs/theory.md#cutting-arcs), after J. Amanatides and A. Woo, "A Fast Voxel Traversal Algorithm
//! for Ray Tracing", Eurographics 1987.

use super::grid::{Coordinates, MeterGrid};
use crate::volume::{cell_of, number_of};
use eikonal::ray::Arc;
use glam::DVec3;

/// Smallest ratio of the rates at which an arc moves along an axis, for which Newton's method
/// surely finds where it meets a plane across the axis.
const MIN_RATE_RATIO: f64 = 0.5;
/// Change of θ below which a Newton step is the last: the next change would be about its square.
const MAX_LAST_STEP: f64 = 1e-7;

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
        } else if let Some(line) = Crossing::of_line(ends, cells, top) {
            line.see_all(see);
        }
        Some(())
    }

    /// Calls `see` with each cell along an arc up to `theta_end`, in order, and the θ at which the
    /// arc enters and leaves the cell. Returns `None`, before any call, if the grid is not
    /// Cartesian, or if the arc leaves the grid or bends too much.
    #[inline]
    pub(super) fn along_curve(
        &self,
        arc: &Arc,
        theta_end: f64,
        mut see: impl FnMut(usize, [f64; 2]),
    ) -> Option<()> {
        if self.coordinates() != Coordinates::Cartesian {
            return None;
        }
        let top = self.top();
        let ends = [arc.start(), arc.position(theta_end)].map(|x| self.in_cells(x));
        let cells = ends.map(cell_of);
        let first = number_of(cells[0], top)?;
        number_of(cells[1], top)?;
        let control = arc.control().map(|x| self.in_cells(x));
        if !(0..3).all(|axis| meets_faces_once(control.map(|x| x[axis]), cells[0][axis])) {
            return None;
        }
        if cells[0] == cells[1] {
            see(first, [0.0, theta_end]);
        } else {
            let curve = Curve::of(control, ends, theta_end);
            Crossing::new(curve, [0.0, theta_end], cells, top).see_all(see);
        }
        Some(())
    }
}

/// Returns true if an arc surely meets each face across an axis at most once, at a place that
/// Newton's method finds. `control` are the coordinates of the control points along the axis, and
/// `cell` is that of the first cell.
#[inline]
fn meets_faces_once(control: [f64; 6], cell: f64) -> bool {
    if control.iter().all(|x| cell <= *x && *x < cell + 1.0) {
        return true;
    }
    let rates: [f64; 5] = std::array::from_fn(|i| control[i + 1] - control[i]);
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = rates
        .iter()
        .fold(ends, |(low, high), rate| (low.min(*rate), high.max(*rate)));
    let (least, most) = if low > 0.0 {
        (low, high)
    } else {
        (-high, -low)
    };
    least > MIN_RATE_RATIO * most
}

/// A path through cells that moves along each axis in one direction.
trait Crosses {
    /// Returns the place on the path, after `from`, at which its coordinate along an axis is
    /// `face`.
    fn place(&self, axis: usize, face: f64, from: f64) -> f64;
}

/// Line from `start`, in cells; places on it are fractions of `step`.
struct Straight {
    start: DVec3,
    step: DVec3,
}

impl Crosses for Straight {
    #[inline]
    fn place(&self, axis: usize, face: f64, _from: f64) -> f64 {
        (face - self.start[axis]) / self.step[axis]
    }
}

/// Arc in cells; places on it are values of θ.
struct Curve {
    /// Coefficients of the powers of θ.
    powers: [DVec3; 6],
    /// Change of θ per cell along each axis, from the start to the end.
    per_cell: DVec3,
    theta_end: f64,
}

impl Curve {
    fn of(control: [DVec3; 6], ends: [DVec3; 2], theta_end: f64) -> Self {
        let (mut powers, mut differences) = (control, control);
        for (k, binomial) in [5.0, 10.0, 10.0, 5.0, 1.0].into_iter().enumerate() {
            for i in 0..5 - k {
                differences[i] = differences[i + 1] - differences[i];
            }
            powers[k + 1] = differences[0] * binomial;
        }
        Curve {
            powers,
            per_cell: theta_end / (ends[1] - ends[0]),
            theta_end,
        }
    }
}

impl Crosses for Curve {
    #[inline]
    fn place(&self, axis: usize, face: f64, from: f64) -> f64 {
        let [a, b, c, d, e, f] = self.powers.map(|power| power[axis]);
        let value = |t: f64| a + t * (b + t * (c + t * (d + t * (e + t * f))));
        let rate = |t: f64| b + t * (2.0 * c + t * (3.0 * d + t * (4.0 * e + t * (5.0 * f))));
        let mut theta = (face - a) * self.per_cell[axis];
        for _ in 0..8 {
            let change = (face - value(theta)) / rate(theta);
            // Planted error "curved arcs cut where straight ones would be", found by morgana-transport/lib::observe::meter::line::tests::arcs_are_cut_where_they_cross_faces:
            // theta += 0.0 * change;
            theta += change;
            if change.abs() < MAX_LAST_STEP {
                break;
            }
        }
        theta.clamp(from, self.theta_end)
    }
}

/// Traversal of the cells along a path, at its current cell.
struct Crossing<P> {
    path: P,
    top: DVec3,
    here: DVec3,
    /// Last cell; `left` is the number of cells up to it.
    there: DVec3,
    left: f64,
    /// Place on the path at the next face along each axis.
    next: DVec3,
    /// Place at which the path enters the current cell; `leave` is the place at which it leaves the
    /// grid.
    from: f64,
    leave: f64,
}

impl Crossing<Straight> {
    /// Creates a traversal at the first cell of a line, given the cells of its ends. Returns `None`
    /// if the line misses the grid.
    fn of_line([a, b]: [DVec3; 2], cells: [DVec3; 2], top: DVec3) -> Option<Self> {
        let step = b - a;
        let are_inside = cells.iter().all(|cell| number_of(*cell, top).is_some());
        let ([from, leave], [here, there]) = if are_inside {
            ([0.0, 1.0], cells)
        } else {
            let shares = clip(a, step, top)?;
            let cell = |share: f64| cell_of(a + step * share).clamp(DVec3::ZERO, top - 1.0);
            (shares, shares.map(cell))
        };
        let line = Straight { start: a, step };
        Some(Crossing::new(line, [from, leave], [here, there], top))
    }
}

impl<P: Crosses> Crossing<P> {
    /// Creates a traversal of a path between two places in the grid, given their cells.
    fn new(path: P, [from, leave]: [f64; 2], [here, there]: [DVec3; 2], top: DVec3) -> Self {
        let mut crossing = Crossing {
            path,
            top,
            here,
            there,
            left: (there - here).abs().element_sum(),
            next: DVec3::ZERO,
            from,
            leave,
        };
        crossing.next = DVec3::new(crossing.face(0), crossing.face(1), crossing.face(2));
        crossing
    }

    /// Calls `see` with each cell, and the places at which the path enters and leaves it.
    #[inline]
    fn see_all(mut self, mut see: impl FnMut(usize, [f64; 2])) {
        while self.left > 0.0 {
            let (cell, piece) = self.next();
            see(cell, piece);
        }
        see(self.number(), [self.from, self.leave]);
    }

    /// Returns the index of the current cell, which is in the grid.
    #[inline]
    fn number(&self) -> usize {
        number_of(self.here, self.top).unwrap_or_default()
    }

    /// Returns the place on the path at the next face across an axis.
    #[inline]
    fn face(&self, axis: usize) -> f64 {
        let (here, there) = (self.here[axis], self.there[axis]);
        if here == there {
            return f64::INFINITY;
        }
        let face = if there > here { here + 1.0 } else { here };
        self.path.place(axis, face, self.from)
    }

    /// Returns the current cell with the places at which the path enters and leaves it, and steps
    /// to the next cell, which must exist.
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
        self.from = to;
        self.next[axis] = self.face(axis);
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

    /// Arcs that bend little are cut where the general search cuts them.
    #[test]
    fn arcs_are_cut_where_they_cross_faces() {
        let turn = DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(0.7);
        let to_world = DAffine3::from_mat3_translation(turn * 1.5, DVec3::splat(-0.6));
        let grid = MeterGrid::new(Coordinates::Cartesian, [7, 4, 9], to_world).unwrap();
        let mut rng = testkit::Rng::new(2);
        let mut vector = |size: f64| (DVec3::from_array(rng.uniform::<3>()) - 0.5) * size;
        let (mut crossed, mut left_out) = (0, 0);
        for i in 0..3000 {
            let start = to_world.transform_point3(vector(0.9) + 0.5);
            let (v, bend) = (vector(1.0).normalize(), vector(0.5));
            let (h, theta_end) = ([0.1, 0.5, 1.0][i % 3], [1.0, 0.9][i % 2]);
            // x = x₀ + v σ + a σ²/2 + b σ³/6
            let b = vector(0.3);
            let end = [
                start + v * h + bend * (h * h / 2.0) + b * (h.powi(3) / 6.0),
                v + bend * h + b * (h * h / 2.0),
                bend + b * h,
            ];
            let arc = Arc::hermite([start, v, bend], end, h);
            let mut pieces = Vec::new();
            let seen = grid.along_curve(&arc, theta_end, |cell, piece| pieces.push((cell, piece)));
            if seen.is_none() {
                assert!(pieces.is_empty());
                left_out += 1;
                continue;
            }
            let mut cuts = Vec::new();
            grid.cut(&arc, theta_end, &mut cuts);
            cuts.sort_by(f64::total_cmp);
            let ends: Vec<f64> = pieces.iter().map(|(_, [_, to])| *to).collect();
            assert_eq!(pieces[0].1[0], 0.0);
            assert!(pieces.windows(2).all(|p| p[0].1[1] == p[1].1[0]));
            let expected = cuts.into_iter().chain([theta_end]);
            for (found, expected) in ends.iter().zip(expected.clone()) {
                assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            }
            assert_eq!(ends.len(), expected.count());
            for (cell, [from, to]) in &pieces {
                let middle = arc.position(0.5 * (from + to));
                assert!(grid.cell(middle) == Some(*cell) || to - from < 1e-9);
            }
            crossed += usize::from(pieces.len() > 1);
        }
        assert!(crossed > 800 && left_out < 1600, "{crossed} {left_out}");
    }
}
