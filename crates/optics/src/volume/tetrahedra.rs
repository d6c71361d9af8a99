//! Tetrahedra of several media, with their neighbours (docs/theory.md#walks-through-cells).

use eikonal::Aabb;
use glam::DVec3;
use std::sync::Arc;

/// Number that stands for no tetrahedron.
const NONE: u32 = u32::MAX;
/// Largest number of entries of a [`Bins`], for each tetrahedron.
const MAX_ENTRIES: usize = 32;

/// Tetrahedra in the world, with the number of a part for each. Neighbours share whole faces.
#[derive(Clone, Debug)]
pub struct TetrahedralMesh {
    tetrahedra: Vec<Tetrahedron>,
    parts: Vec<u8>,
    bins: Bins,
}

/// Flat faces of a tetrahedron, each opposite to a node. A point x is inside the tetrahedron where
/// all normals·x > `offsets`.
#[derive(Clone, Debug)]
struct Tetrahedron {
    /// Components x, y and z of the unit normals of the faces.
    normals: [[f64; 4]; 3],
    offsets: [f64; 4],
    neighbours: [u32; 4],
}

/// Medium of each tetrahedron of a mesh, as an index into the media of the scene.
#[derive(Clone, Debug)]
pub struct TetrahedraMedia {
    /// The mesh, whose parts are numbered from 1.
    pub mesh: Arc<TetrahedralMesh>,
    /// Media of the parts.
    pub media: Vec<usize>,
}

impl TetrahedraMedia {
    /// Returns true if the media are equal and the meshes are one in memory.
    pub fn is_same(&self, other: &TetrahedraMedia) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh) && self.media == other.media
    }

    /// Returns the medium at a point; `None` outside the tetrahedra or for the medium around them.
    pub fn at(&self, x: DVec3) -> Option<usize> {
        let part = self.mesh.parts[self.mesh.at(x)?];
        let place = usize::from(part).checked_sub(1)?;
        self.media.get(place).copied()
    }
}

impl TetrahedralMesh {
    /// Creates a mesh from positions of nodes, and for each tetrahedron its four nodes, the
    /// tetrahedra beyond the faces opposite to them, and its part. Tetrahedra may have either
    /// orientation, but must have a volume.
    ///
    /// # Panics
    /// If a number does not exist, or the numbers of elements differ.
    pub fn new(
        nodes: &[DVec3],
        elements: &[[u32; 4]],
        neighbours: &[[Option<u32>; 4]],
        parts: Vec<u8>,
    ) -> Self {
        assert_eq!(
            (elements.len(), elements.len()),
            (neighbours.len(), parts.len())
        );
        let corners = |element: &[u32; 4]| element.map(|node| nodes[node as usize]);
        let made = |(element, beyond): (&[u32; 4], &[Option<u32>; 4])| {
            Tetrahedron::new(
                corners(element),
                beyond.map(|number| number.unwrap_or(NONE)),
            )
        };
        let boxes: Vec<Aabb> = elements.iter().map(|e| Aabb::around(corners(e))).collect();
        TetrahedralMesh {
            tetrahedra: elements.iter().zip(neighbours).map(made).collect(),
            parts,
            bins: Bins::new(&boxes),
        }
    }

    /// Returns the parts of the tetrahedra.
    pub fn parts(&self) -> &[u8] {
        &self.parts
    }

    /// Returns the number of a tetrahedron that contains a point.
    pub fn at(&self, x: DVec3) -> Option<usize> {
        self.bins.at(x).find(|number| self.contains(*number, x))
    }

    /// Returns the tetrahedra that overlap a box, and some that are near it.
    pub fn near(&self, within: &Aabb) -> Vec<usize> {
        let mut near = self.bins.near(within);
        near.retain(|number| !self.tetrahedra[*number].misses(within));
        near
    }

    fn contains(&self, number: usize, x: DVec3) -> bool {
        let of = &self.tetrahedra[number];
        of.depths(x).iter().all(|depth| *depth > 0.0)
    }

    /// Returns the number of the face, from 0 to 3, through which a straight line in a unit
    /// direction leaves a tetrahedron that contains `x`, and the distance to it. Returns `None` if
    /// the line stays in the tetrahedron over a length.
    #[inline]
    pub fn exit(&self, number: usize, [x, d]: [DVec3; 2], length: f64) -> Option<(usize, f64)> {
        let of = &self.tetrahedra[number];
        // Compute all four distances without branches, which processors would often mispredict.
        let (depths, speeds) = (of.depths(x), of.along_normals(d));
        let distance = |face: usize| {
            let distance = depths[face] / -speeds[face];
            if speeds[face] < 0.0 {
                distance
            } else {
                f64::INFINITY
            }
        };
        let [a, b, c, d] = [distance(0), distance(1), distance(2), distance(3)];
        let (first, ab) = if a <= b { (0, a) } else { (1, b) };
        let (second, cd) = if c <= d { (2, c) } else { (3, d) };
        let (face, nearest) = if ab <= cd { (first, ab) } else { (second, cd) };
        // Rounding may put the position slightly beyond a face.
        // Planted error "flights that stay in a tetrahedron beyond its faces", found by morgana-optics/lib::volume::tetrahedra::tests::walks_pass_from_point_to_point:
        // (nearest < 0.5 * length).then(|| (face, nearest.max(0.0)))
        (nearest < length).then(|| (face, nearest.max(0.0)))
    }

    /// Returns the tetrahedron beyond a face.
    #[inline]
    pub fn beyond(&self, number: usize, face: usize) -> Option<usize> {
        let next = self.tetrahedra[number].neighbours[face];
        (next != NONE).then_some(next as usize)
    }

    /// Returns the unit normal of a face, which points into the tetrahedron.
    pub fn normal(&self, number: usize, face: usize) -> DVec3 {
        self.tetrahedra[number].normal(face)
    }

    /// Moves a point in a tetrahedron, or within rounding of it, by about `distance` away from faces
    /// that are nearer than that.
    pub fn inside(&self, number: usize, x: DVec3, distance: f64) -> DVec3 {
        let of = &self.tetrahedra[number];
        // Move towards the point that is deepest inside, as far as the size of the tetrahedron permits.
        let center = of.center();
        let height = of.depths(center).into_iter().fold(f64::INFINITY, f64::min);
        let wanted = distance.min(0.25 * height);
        let share = |depth: f64| {
            let missing = (wanted - depth).max(0.0);
            missing / (height - wanted + missing)
        };
        let share = of.depths(x).into_iter().map(share).fold(0.0, f64::max);
        x + (center - x) * share.min(1.0)
    }
}

impl Tetrahedron {
    fn new(nodes: [DVec3; 4], neighbours: [u32; 4]) -> Self {
        // Unit normals of the faces opposite to each node, into the tetrahedron.
        let normal = |k: usize| {
            let [a, b, c] = [1, 2, 3].map(|i| nodes[(k + i) % 4]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            normal * normal.dot(nodes[k] - a).signum()
        };
        let normals = [0, 1, 2, 3].map(normal);
        Tetrahedron {
            normals: [0, 1, 2].map(|axis| normals.map(|normal| normal[axis])),
            offsets: std::array::from_fn(|k| normals[k].dot(nodes[(k + 1) % 4])),
            neighbours,
        }
    }

    fn normal(&self, face: usize) -> DVec3 {
        self.normals.map(|components| components[face]).into()
    }

    /// Returns the components of a vector along the normals.
    #[inline]
    fn along_normals(&self, v: DVec3) -> [f64; 4] {
        let [x, y, z] = &self.normals;
        std::array::from_fn(|face| x[face] * v.x + y[face] * v.y + z[face] * v.z)
    }

    /// Returns the distances of a point from the planes of all faces, negative outside.
    #[inline]
    fn depths(&self, x: DVec3) -> [f64; 4] {
        let along = self.along_normals(x);
        std::array::from_fn(|face| along[face] - self.offsets[face])
    }

    /// Returns true if a box lies beyond one of the faces.
    fn misses(&self, of: &Aabb) -> bool {
        (0..4).any(|face| {
            let normal = self.normal(face);
            let deepest = DVec3::select(normal.cmpgt(DVec3::ZERO), of.max, of.min);
            normal.dot(deepest) < self.offsets[face]
        })
    }

    /// Returns the centre of the inscribed ball.
    fn center(&self) -> DVec3 {
        // Depths below all faces are equal: n·x − offset = r.
        let [a, b, c, d] = [0, 1, 2, 3].map(|face| self.normal(face));
        let [p, q, r, s] = self.offsets;
        let rows = glam::DMat3::from_cols(b - a, c - a, d - a).transpose();
        rows.inverse() * DVec3::new(q - p, r - p, s - p)
    }
}

/// Grid over boxes, which lists the boxes that overlap each cell.
#[derive(Clone, Debug)]
struct Bins {
    low: DVec3,
    per_length: DVec3,
    size: [usize; 3],
    /// Start of each cell's entries, and the end of the last cell's.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Bins {
    fn new(boxes: &[Aabb]) -> Self {
        let whole = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        let extent = (whole.max - whole.min).max(DVec3::splat(f64::MIN_POSITIVE));
        // Cells are about as large as boxes, or larger if boxes would overlap very many.
        let mut cells = boxes.len() as f64;
        loop {
            // Take roots first: products of extents may overflow or underflow.
            let side = extent.to_array().map(f64::cbrt).iter().product::<f64>() / cells.cbrt();
            let count = (extent / side)
                .ceil()
                .clamp(DVec3::ONE, DVec3::splat(1024.0));
            let mut bins = Bins {
                low: whole.min,
                per_length: count / extent,
                // NaN, of boxes that are not finite, becomes 1.
                size: count.to_array().map(|n| n.max(1.0) as usize),
                starts: Vec::new(),
                entries: Vec::new(),
            };
            let covered = |b: &Aabb| bins.range(b).map(|r| r.len()).iter().product::<usize>();
            let total: usize = boxes.iter().map(covered).fold(0, usize::saturating_add);
            if total <= MAX_ENTRIES * boxes.len() || cells <= 1.0 {
                bins.fill(boxes);
                return bins;
            }
            cells /= 8.0;
        }
    }

    fn fill(&mut self, boxes: &[Aabb]) {
        let mut counts = vec![0u32; self.size.iter().product::<usize>() + 1];
        for of in boxes {
            self.each_cell(of, |cell| counts[cell + 1] += 1);
        }
        for cell in 1..counts.len() {
            counts[cell] += counts[cell - 1];
        }
        let mut next = counts.clone();
        let mut entries = vec![0; counts[counts.len() - 1] as usize];
        for (number, of) in (0..).zip(boxes) {
            self.each_cell(of, |cell| {
                entries[next[cell] as usize] = number;
                next[cell] += 1;
            });
        }
        (self.starts, self.entries) = (counts, entries);
    }

    /// Returns the cells along each axis that a box overlaps.
    fn range(&self, of: &Aabb) -> [std::ops::Range<usize>; 3] {
        let (first, last) = (self.cell(of.min), self.cell(of.max));
        std::array::from_fn(|axis| first[axis]..last[axis] + 1)
    }

    /// Returns the cell of a point along each axis, or the nearest cell.
    fn cell(&self, x: DVec3) -> [usize; 3] {
        let place = ((x - self.low) * self.per_length).to_array();
        // Casts saturate, and take NaN to 0.
        std::array::from_fn(|axis| (place[axis] as usize).min(self.size[axis] - 1))
    }

    fn each_cell(&self, of: &Aabb, mut see: impl FnMut(usize)) {
        let [x, y, z] = self.range(of);
        for k in z {
            for j in y.clone() {
                for i in x.clone() {
                    see(self.number([i, j, k]));
                }
            }
        }
    }

    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.size[0] * (j + self.size[1] * k)
    }

    fn at(&self, x: DVec3) -> impl Iterator<Item = usize> {
        self.of_cell(self.number(self.cell(x)))
    }

    fn of_cell(&self, cell: usize) -> impl Iterator<Item = usize> {
        let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
        self.entries[range].iter().map(|number| *number as usize)
    }

    fn near(&self, within: &Aabb) -> Vec<usize> {
        let mut found = Vec::new();
        self.each_cell(within, |cell| found.extend(self.of_cell(cell)));
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of six tetrahedra around a diagonal, the first in part 2, the others in part 1.
    fn cube() -> TetrahedralMesh {
        let corner = |i: u32| DVec3::from([i & 1, i >> 1 & 1, i >> 2].map(f64::from));
        let nodes: Vec<DVec3> = (0..8).map(corner).collect();
        let around = [1, 3, 2, 6, 4, 5];
        let element = |i: usize| [0, around[i], around[(i + 1) % 6], 7];
        let elements: Vec<[u32; 4]> = (0..6).map(element).collect();
        // The faces opposite to the second and third nodes contain the diagonal.
        let beyond = |i: u32| [None, Some((i + 1) % 6), Some((i + 5) % 6), None];
        let neighbours: Vec<[Option<u32>; 4]> = (0..6).map(beyond).collect();
        TetrahedralMesh::new(&nodes, &elements, &neighbours, vec![2, 1, 1, 1, 1, 1])
    }

    #[test]
    fn walks_pass_from_point_to_point() {
        let mesh = cube();
        let mut rng = testkit::Rng::new(5);
        let mut crossed = 0;
        for _ in 0..1000 {
            let [from, to] = [0; 2].map(|_| DVec3::from(rng.uniform::<3>()));
            let (first, last) = (mesh.at(from).unwrap(), mesh.at(to).unwrap());
            let direction = (to - from).normalize();
            let (mut x, mut here) = (from, first);
            while let Some((face, length)) = mesh.exit(here, [x, direction], (to - x).length()) {
                x += direction * length;
                assert!(mesh.normal(here, face).dot(direction) < 0.0);
                here = mesh.beyond(here, face).unwrap();
                crossed += 1;
            }
            assert_eq!(here, last);
        }
        assert!(crossed > 500, "{crossed}");
    }

    #[test]
    fn infinite_tetrahedra_contain_nothing() {
        let nodes = [0.0, 1.0, f64::INFINITY, f64::NAN].map(|x| DVec3::new(x, 1.0 - x, x * x));
        let mesh = TetrahedralMesh::new(&nodes, &[[0, 1, 2, 3]], &[[None; 4]], vec![1]);
        assert_eq!(mesh.at(DVec3::ONE), None);
    }

    #[test]
    fn points_are_in_one_tetrahedron_or_outside() {
        let mesh = cube();
        assert_eq!(mesh.at(DVec3::new(0.5, 0.2, 1.01)), None);
        assert_eq!(mesh.at(DVec3::NAN), None);
        let number = mesh.at(DVec3::new(0.9, 0.6, 0.3)).unwrap();
        assert_eq!(mesh.parts()[number], 2);
        assert!(
            mesh.near(&Aabb::around([DVec3::splat(0.1)]))
                .contains(&number)
        );
        // A point on a face moves into the tetrahedron.
        let moved = mesh.inside(number, DVec3::new(0.9, 0.6, 0.0), 1e-3);
        assert_eq!(mesh.at(moved), Some(number));
        assert!((moved - DVec3::new(0.9, 0.6, 0.0)).length() < 0.01);
    }
}
