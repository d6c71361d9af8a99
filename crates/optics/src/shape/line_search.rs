//! Search for the triangles of all meshes that a straight line may meet.
//!
//! Boxes and a first test of triangles are in single precision. They only exclude: what remains is
//! tested exactly.

use super::Shape;
use super::mesh::Mesh;
use super::split::Costs;
use super::sweep::{SingleRay, Sweep};
use super::tree::{Frame, Hierarchy};
use eikonal::Aabb;
use glam::{DVec3, Vec4};

/// Bound of the rounding errors of the filter, as a length in the coordinates of the hierarchy,
/// which end at ±1.
///
/// Let u = 2⁻²⁴ be the largest relative error of an operation in single precision. The filter
/// computes sheared coordinates x = p − s·z − c of the corners, where |p|, |s|, |z| ≤ 1 and
/// |c| ≤ 2. Their errors have five parts: u from p, 3u from s·z, 2u from the first difference, 2u
/// from c, and u|x| from the second difference. Meshes far from the origin and ends of long lines
/// add at most 2u. If the line passes through the triangle, |x| ≤ 4, and x has an error of at most
/// δ = 14u.
///
/// A side of the line is a × b for sheared corners with |a|₁, |b|₁ ≤ d ≤ 8. Its error is at most
/// 2dδ + 2δ² from the coordinates and 2ud² ≤ 16ud from the products: 44ud + 392u². Sides of a line
/// through the triangle have one sign, or are zero. The filter accepts a wrong sign of up to
/// 64ud + (64u)².
const ROUNDING: f64 = 64.0 / (1 << 24) as f64;

/// Largest bound of the rounding errors of a mesh, relative to half the size of the scene, for
/// which the filter is safe.
const MAX_NOISE: f64 = 0.25 / (1 << 24) as f64;

/// Mean size of the triangles of a mesh, relative to half the size of the scene, below which the
/// filter would exclude too little.
const MIN_TRIANGLE_SIZE: f64 = 2e-4;

/// Costs of leaves whose triangles are tested together.
const COSTS: Costs = Costs {
    together: Group::LENGTH,
    visit: 0.7,
};

/// Hierarchy over the triangles of the meshes of a scene, and over its other shapes.
#[derive(Clone)]
pub(super) struct LineSearch {
    hierarchy: Hierarchy,
    groups: Vec<Group>,
}

/// Part of a scene that a line may meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    /// Index of the shape.
    pub shape: u32,
    /// Index of the triangle; [`Entry::WHOLE`] for a whole shape.
    triangle: u32,
}

/// Entries that are tested together.
#[derive(Clone)]
#[repr(align(64))]
struct Group {
    /// Coordinates of the corners by corner and axis.
    corners: [[Vec4; 3]; 3],
    /// Bounds of the rounding errors of the sides of the line.
    slack: Vec4,
    entries: [Entry; Group::LENGTH],
}

/// Line prepared for the filter: coordinates are sheared so that the line becomes an axis.
struct Filter {
    /// Axes, the last one being the axis along which the line advances most.
    axes: [usize; 3],
    /// Slopes of the line along the first two axes.
    slopes: [Vec4; 2],
    /// Sheared coordinates of the line.
    offsets: [Vec4; 2],
    /// Coordinate of the start along the last axis.
    start: f32,
    is_forward: bool,
}

impl Entry {
    const WHOLE: u32 = u32::MAX;

    /// Returns the index of the triangle; `None` for a whole shape.
    #[inline]
    pub(super) fn triangle(self) -> Option<usize> {
        (self.triangle != Self::WHOLE).then_some(self.triangle as usize)
    }

    fn aabb(self, shapes: &[Shape]) -> Aabb {
        let shape = &shapes[self.shape as usize];
        match (shape, self.triangle()) {
            (Shape::Mesh(mesh), Some(i)) => Aabb::around(mesh.triangle(i)),
            _ => shape.aabb(),
        }
    }
}

impl LineSearch {
    /// Builds the hierarchy for these shapes, in this order. Returns `None` if no mesh has
    /// triangles for the filter.
    pub(super) fn new(shapes: &[Shape]) -> Option<Self> {
        let boxes = shapes.iter().map(Shape::aabb);
        let frame = Frame::around(&boxes.fold(Aabb::EMPTY, Aabb::union));
        let mut entries = Vec::new();
        let mut has_triangles = false;
        for (shape, i) in shapes.iter().zip(0..) {
            let triangles = match shape {
                Shape::Mesh(mesh) if is_fit(mesh, &frame) => {
                    has_triangles = true;
                    0..=mesh.triangles().len() as u32 - 1
                }
                _ => Entry::WHOLE..=Entry::WHOLE,
            };
            entries.extend(triangles.map(|triangle| Entry { shape: i, triangle }));
        }
        has_triangles.then(|| Self::of(frame, shapes, &entries))
    }

    fn of(frame: Frame, shapes: &[Shape], entries: &[Entry]) -> Self {
        let boxes = entries.iter().map(|entry| entry.aabb(shapes));
        let (mut hierarchy, places) = Hierarchy::new(frame, boxes, COSTS);
        let mut groups = Vec::with_capacity(hierarchy.leaves());
        hierarchy.renumber(|leaf| {
            let first = groups.len() as u32;
            for places in places[leaf.start as usize..leaf.end as usize].chunks(Group::LENGTH) {
                let mut group = Group::EMPTY;
                for (k, place) in places.iter().enumerate() {
                    group.set(k, entries[*place as usize], shapes, &frame);
                }
                groups.push(group);
            }
            first..groups.len() as u32
        });
        LineSearch { hierarchy, groups }
    }

    /// Calls `test` with each entry that the line between two points may meet for a parameter in
    /// `range`, roughly in order. `test` returns the new end of the range.
    #[inline]
    pub(super) fn visit(
        &self,
        ends: [DVec3; 2],
        range: [f64; 2],
        test: &mut impl FnMut(Entry) -> f64,
    ) {
        let frame = self.hierarchy.frame();
        let sweep = frame.line(&ends);
        let Some([start, _]) = frame.clip(&sweep, range) else {
            return;
        };
        let ray = sweep.single(start);
        let filter = Filter::new(&sweep, start);
        let end = ray.parameter(range[1]);
        self.hierarchy.visit(&ray, end, &mut |groups, mut end| {
            for group in &self.groups[groups.start as usize..groups.end as usize] {
                end = group.visit(&filter, &ray, end, test);
            }
            end
        });
    }
}

/// Returns true if the filter suits the triangles of a mesh in a scene with this frame.
fn is_fit(mesh: &Mesh, frame: &Frame) -> bool {
    let size = |i| Aabb::around(mesh.triangle(i)).size().max_element();
    let count = mesh.triangles().len();
    let mean = (0..count).map(size).sum::<f64>() / count as f64;
    frame.local_length(mean) >= MIN_TRIANGLE_SIZE && frame.local_length(mesh.noise()) <= MAX_NOISE
}

impl Group {
    /// Number of entries, which is the number of lanes of [`Vec4`].
    const LENGTH: usize = 4;

    /// Coordinate of the corners of a triangle that stands for a whole shape.
    const FAR: f32 = 1e9;

    const EMPTY: Group = Group {
        corners: [[Vec4::NAN; 3]; 3],
        slack: Vec4::ZERO,
        entries: [Entry {
            shape: u32::MAX,
            triangle: u32::MAX,
        }; Self::LENGTH],
    };

    fn set(&mut self, k: usize, entry: Entry, shapes: &[Shape], frame: &Frame) {
        self.entries[k] = entry;
        let (Shape::Mesh(mesh), Some(i)) = (&shapes[entry.shape as usize], entry.triangle()) else {
            // A triangle that passes the filter for all lines.
            for (corner, at) in self.corners.iter_mut().zip([-Self::FAR, Self::FAR, 0.0]) {
                corner.iter_mut().for_each(|axis| axis[k] = at);
            }
            self.slack[k] = f32::INFINITY;
            return;
        };
        let corners = mesh.triangle(i).map(|p| frame.local(p));
        for (corner, p) in self.corners.iter_mut().zip(corners) {
            for (axis, x) in corner.iter_mut().zip(p.as_vec3().to_array()) {
                axis[k] = x;
            }
        }
        // No slope exceeds 1, so that each sheared coordinate spans at most two sides of the box.
        let sheared = 2.0 * Aabb::around(corners).size().element_sum();
        // Planted error "lines lost within the rounding of single precision", found by morgana-optics/lib::shape::line_search::tests::lines_meet_the_triangles_of_all_meshes:
        // self.slack[k] = (0.0 * sheared) as f32;
        self.slack[k] = (ROUNDING * (sheared + ROUNDING)) as f32;
    }

    /// Calls `test` with the entries that pass the filter before the parameter `end` of the ray.
    /// Returns the new end.
    #[inline]
    fn visit(
        &self,
        filter: &Filter,
        ray: &SingleRay,
        mut end: f32,
        test: &mut impl FnMut(Entry) -> f64,
    ) -> f32 {
        let mut passed = filter.passed(self, end);
        while passed != 0 {
            let k = passed.trailing_zeros() as usize;
            passed &= passed - 1;
            end = ray.parameter(test(self.entries[k]));
        }
        end
    }
}

impl Filter {
    /// Prepares the line of a sweep from the parameter `start` on.
    #[inline]
    fn new(sweep: &Sweep, start: f64) -> Self {
        let direction = sweep.direction();
        let origin = sweep.point(start);
        let last = direction.abs().max_position();
        let axes = [(last + 1) % 3, (last + 2) % 3, last];
        let slopes = [0, 1].map(|k| direction[axes[k]] / direction[last]);
        let offsets = [0, 1].map(|k| origin[axes[k]] - slopes[k] * origin[last]);
        Filter {
            axes,
            slopes: slopes.map(|x| Vec4::splat(x as f32)),
            offsets: offsets.map(|x| Vec4::splat(x as f32)),
            start: origin[last] as f32,
            is_forward: direction[last] > 0.0,
        }
    }

    /// Returns a mask with a bit for each entry of a group that the line may meet before the
    /// parameter `end`.
    #[inline]
    fn passed(&self, group: &Group, end: f32) -> u32 {
        let [(ax, ay, az), (bx, by, bz), (cx, cy, cz)] = [0, 1, 2].map(|corner| {
            let p = &group.corners[corner];
            let z = p[self.axes[2]];
            let [x, y] = [0, 1].map(|k| p[self.axes[k]] - self.slopes[k] * z - self.offsets[k]);
            (x, y, z)
        });
        let sides = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        let low = sides[0].min(sides[1]).min(sides[2]);
        let high = sides[0].max(sides[1]).max(sides[2]);
        let inside = low.cmpge(-group.slack) | high.cmple(group.slack);
        // Exclude triangles before the start and beyond the end.
        let slack = ROUNDING as f32;
        let [from, to] = if self.is_forward {
            [self.start - slack, self.start + end + slack]
        } else {
            [self.start - end - slack, self.start + slack]
        };
        let reached =
            az.min(bz).min(cz).cmple(Vec4::splat(to)) & az.max(bz).max(cz).cmpge(Vec4::splat(from));
        (inside & reached).bitmask()
    }
}

impl std::fmt::Debug for LineSearch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LineSearch")
            .field("groups", &self.groups.len())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::mesh::LineTest;
    use crate::shape::{Accel, Intersection, Rectangle, Sphere};
    use eikonal::ray::Arc;
    use glam::DAffine3;

    /// SplitMix64.
    struct Rng(u64);

    impl Rng {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        }

        fn index(&mut self, n: usize) -> usize {
            (self.uniform() * n as f64) as usize
        }

        /// Draws a uniform point in the cube [−1, 1]³.
        fn vector(&mut self) -> DVec3 {
            DVec3::from_array(std::array::from_fn(|_| 2.0 * self.uniform() - 1.0))
        }
    }

    /// Returns a mesh of `n` × `n` squares of two triangles over [−1, 1]², with heights below
    /// `height`.
    fn sheet(n: u32, height: f64, map: DAffine3, rng: &mut Rng) -> Shape {
        let side = |i: u32| f64::from(i) / f64::from(n) * 2.0 - 1.0;
        let points = (0..=n).flat_map(|i| (0..=n).map(move |k| (side(i), side(k))));
        let point = |(x, y)| map.transform_point3(DVec3::new(x, y, height * rng.uniform()));
        let positions = points.map(point).collect();
        let triangles = (0..n).flat_map(|i| (0..n).map(move |k| i * (n + 1) + k));
        let triangles = triangles.flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        let triangles = triangles.collect();
        Mesh::new(positions, triangles, None).unwrap().into()
    }

    /// Returns a mesh of unconnected triangles of a size around a point.
    fn loose(count: u32, size: f64, center: DVec3, rng: &mut Rng) -> Shape {
        let corners = (0..3 * count).map(|i| {
            let place = Rng(u64::from(i / 3)).vector();
            center + place * 4.0 * size + rng.vector() * size
        });
        let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        let (positions, triangles) = (corners.collect(), triangles.collect());
        Mesh::new(positions, triangles, None).unwrap().into()
    }

    /// Returns meshes of different sizes around a point, some of which coincide, and other shapes.
    fn scene(offset: DVec3, rng: &mut Rng) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for size in [1.0, 0.3, 0.05, 0.01] {
            shapes.push(loose(40, 0.2 * size, offset + rng.vector() * 0.2, rng));
            let turned = DAffine3::from_axis_angle(rng.vector().normalize(), 2.0);
            for (turn, height) in [(DAffine3::IDENTITY, 0.0), (turned, 0.3)] {
                let scale = DAffine3::from_scale(DVec3::splat(size));
                let map = DAffine3::from_translation(offset + rng.vector() * 0.5) * turn * scale;
                shapes.push(sheet(5, height, map, rng));
            }
            // A mesh that coincides with the last one.
            shapes.push(shapes.last().unwrap().clone());
        }
        // Triangles too small for the filter.
        let map = DAffine3::from_translation(offset) * DAffine3::from_scale(DVec3::splat(1e-4));
        shapes.push(sheet(4, 0.3, map, rng));
        shapes.push(Sphere::around(offset + rng.vector(), 0.2).unwrap().into());
        let flat = DAffine3::from_translation(offset + 0.3 * rng.vector());
        shapes.push(Rectangle::new(flat).unwrap().into());
        shapes
    }

    /// Draws a point of a triangle: inside, on a side, or a corner.
    fn target(shapes: &[Shape], rng: &mut Rng) -> DVec3 {
        loop {
            if let Shape::Mesh(mesh) = &shapes[rng.index(shapes.len())] {
                let [a, b, c] = mesh.triangle(rng.index(mesh.triangles().len()));
                let [u, v] = [rng.uniform(), rng.uniform()];
                return match rng.index(3) {
                    0 => a,
                    1 => a + (b - a) * u,
                    _ => a + (b - a) * (u * v) + (c - a) * (1.0 - u),
                };
            }
        }
    }

    /// Draws a line: any, through a point of a triangle, or along one or two axes.
    fn line(shapes: &[Shape], offset: DVec3, rng: &mut Rng) -> Arc {
        let start = if rng.index(4) == 0 {
            target(shapes, rng)
        } else {
            offset + rng.vector() * 1.5
        };
        let mut step = match rng.index(8) {
            0 => rng.vector(),
            _ => target(shapes, rng) - start,
        };
        let start = match rng.index(4) {
            0 => {
                step[rng.index(3)] = 0.0;
                step[rng.index(3)] *= -0.0;
                target(shapes, rng) - step * 0.7
            }
            _ => start,
        };
        let scale = [1.0, 1.0, 3.0, 0.0, 1e3][rng.index(5)];
        Arc::line(start, step, scale)
    }

    /// Returns the intersections of a line with all triangles and all other shapes, in the order
    /// of the shapes.
    fn all_hits(shapes: &[Shape], arc: &Arc, range: [f64; 2]) -> Vec<(usize, Intersection)> {
        let ends = [arc.start(), arc.end()];
        let mut hits = Vec::new();
        for (i, shape) in shapes.iter().enumerate() {
            if let Shape::Mesh(mesh) = shape {
                let Some(test) = LineTest::new(mesh, ends, range) else {
                    continue;
                };
                let triangles = 0..mesh.triangles().len();
                hits.extend(triangles.filter_map(|k| Some((i, mesh.meet(&test, k)?))));
            } else {
                hits.extend(shape.intersect(arc, range).map(|hit| (i, hit)));
            }
        }
        hits
    }

    /// The search finds the nearest of all triangles that the exact test finds, to the last bit.
    /// Lines run through corners and sides, along axes, within the planes of triangles, and far
    /// beyond the scene; some are points.
    #[test]
    fn lines_meet_the_triangles_of_all_meshes() {
        let mut rng = Rng(71);
        let mut found = [0; 2];
        for distance in [0.0, 0.0, 1e3, 1e6] {
            let offset = DVec3::new(1.0, -0.7, 0.3) * distance;
            let shapes = scene(offset, &mut rng);
            let lines = LineSearch::new(&shapes).unwrap();
            let entries = lines.groups.iter().flat_map(|group| group.entries);
            let is_whole = |e: &Entry| e.shape != u32::MAX && e.triangle().is_none();
            assert_eq!(entries.filter(is_whole).count(), 3);
            let accel = Accel::new(&shapes);
            for _ in 0..10_000 {
                let arc = line(&shapes, offset, &mut rng);
                let range = [0.1, 1.0].map(|to: f64| to * rng.uniform() * rng.uniform());
                let range = [range[0], 1.0 - range[1]];
                let hits = all_hits(&shapes, &arc, range);
                let limit = hits
                    .iter()
                    .fold(f64::INFINITY, |t, (_, hit)| t.min(hit.theta))
                    + 1e-12;
                let expected =
                    hits.iter()
                        .filter(|(_, hit)| hit.theta <= limit)
                        .min_by(|(i, a), (j, b)| {
                            let by_theta = a.theta.total_cmp(&b.theta);
                            i.cmp(j).then(by_theta).then(a.primitive.cmp(&b.primitive))
                        });
                let first = accel.first(&shapes, &arc, range, [None; 2]);
                let parts = |(i, hit): &(usize, Intersection)| match &shapes[*i] {
                    Shape::Mesh(_) => (*i, hit.primitive, hit.theta, hit.local),
                    // Other shapes round differently if the range ends elsewhere.
                    _ => (*i, hit.primitive, hit.theta as f32 as f64, DVec3::ZERO),
                };
                assert_eq!(first.as_ref().map(parts), expected.map(parts), "{arc:?}");
                let end = range[1];
                let counts = |shape: usize, theta: f64| shape % 3 != 1 && theta < 0.7 * end;
                let hits = all_hits(&shapes, &arc, [0.0, end]);
                let any = accel.any_hit(&shapes, &arc, end, [None; 2], counts);
                assert_eq!(any, hits.iter().any(|(i, hit)| counts(*i, hit.theta)));
                found[0] += u32::from(first.is_some());
                found[1] += u32::from(any);
            }
        }
        // More than a quarter of the lines meet something.
        assert!(
            found.iter().all(|n| (10_000..40_000).contains(n)),
            "{found:?}"
        );
    }
}
