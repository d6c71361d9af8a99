//! Cells of space, and the points where an arc passes from one cell to the next
//! (docs/theory.md#cutting-arcs).

use crate::scene::VoxelVolume;
use eikonal::Aabb;
use eikonal::ray::Arc;
use eikonal::ray::bernstein::{first_root, product, restrict};
use glam::{DAffine3, DVec3};
use std::f64::consts::PI;

/// Coordinates that cells divide evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// Cartesian coordinates x, y and z over the unit cube \[0, 1\]³.
    Cartesian,
    /// Distance r from the axis, and z, over the cylinder of unit radius from z = 0 to z = 1.
    Cylindrical,
    /// Distance r from the origin, over the unit ball.
    Spherical,
}

/// Cells in the image of the unit cube, cylinder or ball under an affine map.
#[derive(Clone, Debug)]
pub struct MeterGrid {
    coordinates: Coordinates,
    size: [usize; 3],
    /// Number of cells along each coordinate, as a vector.
    top: DVec3,
    /// Total number of cells.
    cells: usize,
    to_world: DAffine3,
    to_local: DAffine3,
    aabb: Aabb,
}

/// Maximum number of roots. A polynomial has at most as many as its degree; an edge that is touched
/// counts once.
const MAX_ROOTS: usize = 10;

impl MeterGrid {
    /// Creates a grid with the given number of cells along each coordinate: x, y, z; or r, 1, z; or
    /// r, 1, 1. Returns `None` if a number is 0, or if a number that must be 1 is not. Also returns
    /// `None` if the map or its inverse is not finite.
    pub fn new(coordinates: Coordinates, size: [usize; 3], to_world: DAffine3) -> Option<Self> {
        let fits = match coordinates {
            Coordinates::Cartesian => true,
            Coordinates::Cylindrical => size[1] == 1,
            Coordinates::Spherical => size[1] == 1 && size[2] == 1,
        };
        let det = to_world.matrix3.determinant();
        let to_local = to_world.inverse();
        let invertible = det.is_finite() && det != 0.0 && to_local.is_finite();
        if !fits || size.contains(&0) || !to_world.is_finite() || !invertible {
            return None;
        }
        let (low, high) = match coordinates {
            Coordinates::Cartesian => (DVec3::ZERO, DVec3::ONE),
            Coordinates::Cylindrical => (DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE),
            Coordinates::Spherical => (DVec3::NEG_ONE, DVec3::ONE),
        };
        let corners = Aabb::new(low, high).corners();
        Some(MeterGrid {
            coordinates,
            size,
            top: size.map(|n| n as f64).into(),
            cells: size.iter().fold(1, |n, &k| n.saturating_mul(k)),
            to_world,
            to_local,
            aabb: Aabb::around(corners.map(|p| to_world.transform_point3(p))),
        })
    }

    /// Returns the coordinates that cells divide evenly.
    pub fn coordinates(&self) -> Coordinates {
        self.coordinates
    }

    /// Returns the number of cells along each coordinate.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the number of cells.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Returns the map from the unit cube, cylinder or ball to the world.
    pub fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    /// Returns the number of cells along each coordinate, as a vector.
    pub(super) fn top(&self) -> DVec3 {
        self.top
    }

    /// Converts a point to Cartesian coordinates in which each cell has size 1.
    #[inline]
    pub(super) fn in_cells(&self, x: DVec3) -> DVec3 {
        self.to_local.transform_point3(x) * self.top
    }

    /// Returns the bounding box of all cells.
    pub fn aabb(&self) -> &Aabb {
        &self.aabb
    }

    /// Returns the index of the cell that contains a point. The first coordinate varies fastest.
    pub fn cell(&self, x: DVec3) -> Option<usize> {
        let p = self.to_local.transform_point3(x);
        let position = match self.coordinates {
            Coordinates::Cartesian => p,
            Coordinates::Cylindrical => DVec3::new(p.x.hypot(p.y), 0.5, p.z),
            Coordinates::Spherical => DVec3::new(p.length(), 0.5, 0.5),
        };
        let inside = position.min_element() >= 0.0 && position.max_element() <= 1.0;
        let index = |axis: usize| {
            let n = self.size[axis];
            ((position[axis] * n as f64) as usize).min(n - 1)
        };
        inside.then(|| index(0) + self.size[0] * (index(1) + self.size[1] * index(2)))
    }

    /// Returns true if the cells are the voxels of a volume, up to rounding.
    pub(super) fn is_voxels_of(&self, volume: &VoxelVolume) -> bool {
        let alike = || {
            let between = self.to_local * *volume.to_world();
            self.to_world == *volume.to_world() || between.abs_diff_eq(DAffine3::IDENTITY, 1e-12)
        };
        self.coordinates == Coordinates::Cartesian && self.size == volume.size() && alike()
    }

    /// Returns the midpoint of a cell along every coordinate. For a ring or a shell it lies on the
    /// local x axis.
    pub fn middle(&self, cell: usize) -> DVec3 {
        let [i, j, k] = self.split(cell);
        let at = |index: usize, axis: usize| (index as f64 + 0.5) / self.size[axis] as f64;
        let local = match self.coordinates {
            Coordinates::Cartesian => DVec3::new(at(i, 0), at(j, 1), at(k, 2)),
            Coordinates::Cylindrical => DVec3::new(at(i, 0), 0.0, at(k, 2)),
            Coordinates::Spherical => DVec3::new(at(i, 0), 0.0, 0.0),
        };
        self.to_world.transform_point3(local)
    }

    /// Returns the volume of a cell, in cubic scene units.
    pub fn volume(&self, cell: usize) -> f64 {
        let [i, _, _] = self.split(cell);
        let [nx, ny, nz] = self.size.map(|n| n as f64);
        let power = |k: i32| ((i + 1) as f64 / nx).powi(k) - (i as f64 / nx).powi(k);
        let local = match self.coordinates {
            Coordinates::Cartesian => 1.0 / (nx * ny * nz),
            Coordinates::Cylindrical => PI * power(2) / nz,
            Coordinates::Spherical => 4.0 / 3.0 * PI * power(3),
        };
        local * self.to_world.matrix3.determinant().abs()
    }

    fn split(&self, cell: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [cell % nx, cell / nx % ny, cell / nx / ny]
    }

    /// Adds to `cuts` every θ in (0, `theta_end`) at which the arc crosses a boundary of cells or
    /// of the grid, in any order. It may add other values, too.
    pub fn cut(&self, arc: &Arc, theta_end: f64, cuts: &mut Vec<f64>) {
        if arc.is_straight() {
            let ends = [arc.start(), arc.position(theta_end)];
            if Aabb::around(ends).overlaps(&self.aabb) {
                self.cut_line(
                    ends.map(|p| self.to_local.transform_point3(p)),
                    theta_end,
                    cuts,
                );
            }
            return;
        }
        let control = restrict(&arc.control(), 0.0, theta_end);
        if Aabb::around(control).overlaps(&self.aabb) {
            self.cut_curve(
                &control.map(|p| self.to_local.transform_point3(p)),
                theta_end,
                cuts,
            );
        }
    }

    fn cut_line(&self, [a, b]: [DVec3; 2], theta_end: f64, cuts: &mut Vec<f64>) {
        let d = b - a;
        let mut plane = |axis: usize| {
            for edge in self.edges(axis, [a[axis], b[axis]]) {
                push((edge - a[axis]) / d[axis], theta_end, cuts);
            }
        };
        let (p, q) = match self.coordinates {
            Coordinates::Cartesian => return (0..3).for_each(plane),
            Coordinates::Cylindrical => {
                plane(2);
                (a.with_z(0.0), d.with_z(0.0))
            }
            Coordinates::Spherical => (a, d),
        };
        // Solve |p + t q|² = r², with both roots free of cancellation.
        let (aa, b, far) = (
            q.length_squared(),
            p.dot(q),
            p.length().max((p + q).length()),
        );
        for r in self.edges(0, [0.0, far]) {
            let c = p.length_squared() - r * r;
            let root = (b * b - aa * c).sqrt();
            if aa > 0.0 && root > 0.0 {
                let s = -(b + root.copysign(b));
                push(s / aa, theta_end, cuts);
                push(c / s, theta_end, cuts);
            }
        }
    }

    fn cut_curve(&self, control: &[DVec3; 6], theta_end: f64, cuts: &mut Vec<f64>) {
        let coordinate = |axis: usize| control.map(|p| p[axis]);
        let mut plane = |axis: usize| {
            let c = coordinate(axis);
            for edge in self.edges(axis, range(&c)) {
                roots(&c.map(|v| v - edge), theta_end, cuts);
            }
        };
        let axes = match self.coordinates {
            Coordinates::Cartesian => return (0..3).for_each(plane),
            Coordinates::Cylindrical => {
                plane(2);
                2
            }
            Coordinates::Spherical => 3,
        };
        let squares =
            (0..axes).map(|axis| product::<6, 6, 11>(&coordinate(axis), &coordinate(axis)));
        let square = squares.fold([0.0; 11], |sum, s| std::array::from_fn(|i| sum[i] + s[i]));
        let [low, high] = range(&square).map(|v| v.max(0.0).sqrt());
        for edge in self.edges(0, [low, high]) {
            roots(&square.map(|v| v - edge * edge), theta_end, cuts);
        }
    }

    /// Returns the edges of cells along a local coordinate within a closed range.
    fn edges(&self, axis: usize, [a, b]: [f64; 2]) -> impl Iterator<Item = f64> + use<> {
        let n = self.size[axis] as f64;
        let first = (a.min(b) * n).ceil().clamp(0.0, n + 1.0) as usize;
        let end = ((a.max(b) * n).floor().clamp(-1.0, n) + 1.0) as usize;
        (first..end).map(move |k| k as f64 / n)
    }
}

fn range<const N: usize>(c: &[f64; N]) -> [f64; 2] {
    c.iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
            [a.min(*v), b.max(*v)]
        })
}

/// Adds a cut at the fraction `t` of `theta_end`, if it lies strictly between 0 and 1.
fn push(t: f64, theta_end: f64, cuts: &mut Vec<f64>) {
    if t > 0.0 && t < 1.0 {
        cuts.push(t * theta_end);
    }
}

/// Adds cuts at the roots of a polynomial. Two roots that lie closer than round-off may both be
/// missed; the arc between them is equally short.
fn roots<const N: usize>(c: &[f64; N], theta_end: f64, cuts: &mut Vec<f64>) {
    let mut from = 0.0;
    for _ in 0..MAX_ROOTS {
        match first_root(c, from, 1.0, [0.0; 2]) {
            Some(root) if root < 1.0 => {
                push(root, theta_end, cuts);
                from = root;
            }
            _ => return,
        }
    }
}
