//! Search for the nearest hit among many shapes.

use super::line_search::{Entry, LineSearch};
use super::mesh::LineTest;
use super::sweep::{Four, Sweep};
use super::tree::Tree;
use super::voxel_faces::FacesOfGrid;
use super::{Intersection, Shape};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::OnceLock;

/// Largest number of shapes for which a linear search is faster than a hierarchy.
const MAX_LINEAR_SHAPES: usize = 8;

/// Difference in θ up to which two hits count as one event. The event belongs to the shape that
/// comes first in the list.
const TIE_TOLERANCE: f64 = 1e-12;

/// Indices of shapes that the arc is known not to intersect.
pub type Except = [Option<usize>; 2];

/// Finds the nearest hit among a fixed list of shapes.
#[derive(Clone, Debug)]
pub struct Accel {
    search: Search,
    count: usize,
    /// Search for straight lines, `None` if the shapes need none. It is built on first use, because
    /// scenes without straight lines need none.
    lines: OnceLock<Option<LineSearch>>,
    /// Label grids whose faces are among the shapes.
    grids: Vec<FacesOfGrid>,
}

#[derive(Clone, Debug)]
enum Search {
    Linear(Vec<Four>),
    Tree(Tree),
}

impl Accel {
    /// Creates an accelerator for these shapes, in this order.
    pub fn new(shapes: &[Shape]) -> Self {
        let boxes: Vec<Aabb> = shapes.iter().map(Shape::aabb).collect();
        let search = if shapes.len() > MAX_LINEAR_SHAPES {
            Search::Tree(Tree::new(boxes.iter().copied()))
        } else {
            // Grow the boxes to cover the rounding of the box test.
            let grow = |b: &Aabb| b.grown(1e-9 * (b.diagonal() + b.center().length()));
            let boxes: Vec<Aabb> = boxes.iter().map(grow).collect();
            Search::Linear(boxes.chunks(4).map(Four::new).collect())
        };
        Accel {
            search,
            count: shapes.len(),
            lines: OnceLock::new(),
            grids: FacesOfGrid::all(shapes),
        }
    }

    /// Returns the intersection with the smallest θ in (theta_min, theta_max], and the index of its
    /// shape. Among intersections within 1e-12 of the nearest, the shape that comes first in the
    /// list wins. Shapes in `except` are skipped.
    ///
    /// `shapes` must be the list for which the accelerator was made.
    pub fn first(
        &self,
        shapes: &[Shape],
        arc: &Arc,
        [theta_min, theta_max]: [f64; 2],
        except: Except,
    ) -> Option<(usize, Intersection)> {
        let mut nearest = Nearest {
            theta: f64::INFINITY,
            first: None,
            ties: Vec::new(),
        };
        let mut walked: SmallVec<[usize; 2]> = SmallVec::new();
        let mut test = |nearest: &mut Nearest, i: usize| {
            let range = [theta_min, nearest.end(theta_max)];
            let found = match &shapes[i] {
                // A single walk finds the first intersection with all faces of a grid.
                Shape::VoxelFaces(faces) if arc.is_straight() => {
                    let grid = self.grids.iter().position(|grid| grid.has(faces));
                    let grid = grid.filter(|grid| !walked.contains(grid));
                    grid.and_then(|grid| {
                        walked.push(grid);
                        let place = |labels| self.grids[grid].place(labels);
                        faces.first_of_line(arc, range, place)
                    })
                }
                shape => shape
                    .intersect(arc, range)
                    .map(|intersection| (i, intersection)),
            };
            if let Some((i, intersection)) = found {
                nearest.add(i, intersection);
            }
            nearest.end(theta_max)
        };
        let range = [theta_min, theta_max];
        if let Some(lines) = self.lines(shapes, arc) {
            let mut meshes = MeshTests::new(arc, range);
            lines.visit(meshes.ends, range, &mut |entry| {
                let i = entry.shape as usize;
                if except.contains(&Some(i)) {
                    return nearest.end(theta_max);
                }
                match meshes.meet(shapes, entry) {
                    None => return test(&mut nearest, i),
                    Some(Some(intersection)) => nearest.add(i, intersection),
                    Some(None) => {}
                }
                nearest.end(theta_max)
            });
        } else {
            self.visit(arc, range, except, &mut |i| test(&mut nearest, i));
        }
        nearest.choose()
    }

    /// Returns true if the arc intersects a shape outside `except` at a θ in (0, theta_max], and
    /// `counts` accepts the first intersection with it. Where `counts` accepts a later intersection
    /// with a mesh, it must accept the first one.
    ///
    /// `shapes` must be the list for which the accelerator was made.
    pub fn any_hit(
        &self,
        shapes: &[Shape],
        arc: &Arc,
        theta_max: f64,
        except: Except,
        counts: impl Fn(usize, f64) -> bool,
    ) -> bool {
        let mut found = false;
        let range = [0.0, theta_max];
        let mut test = |i: usize, intersection: Option<Intersection>| {
            found |= intersection.is_some_and(|m| counts(i, m.theta));
            if found { f64::NEG_INFINITY } else { theta_max }
        };
        if let Some(lines) = self.lines(shapes, arc) {
            let mut meshes = MeshTests::new(arc, range);
            lines.visit(meshes.ends, range, &mut |entry| {
                let i = entry.shape as usize;
                if except.contains(&Some(i)) {
                    return theta_max;
                }
                let met = meshes.meet(shapes, entry);
                test(i, met.unwrap_or_else(|| shapes[i].intersect(arc, range)))
            });
        } else {
            self.visit(arc, range, except, &mut |i| {
                test(i, shapes[i].intersect(arc, range))
            });
        }
        found
    }

    /// Returns the search for straight lines if the arc is straight and the shapes have one.
    #[inline]
    fn lines(&self, shapes: &[Shape], arc: &Arc) -> Option<&LineSearch> {
        if !arc.is_straight() {
            return None;
        }
        self.lines.get_or_init(|| LineSearch::new(shapes)).as_ref()
    }

    /// Calls `test` with each shape that the arc may intersect in a range of θ. `test` returns the
    /// new end of the range.
    #[inline]
    fn visit(
        &self,
        arc: &Arc,
        range: [f64; 2],
        except: Except,
        test: &mut impl FnMut(usize) -> f64,
    ) {
        if self.count == 1 {
            // With one shape, the test of its box would cost as much as the shape.
            if !except.contains(&Some(0)) {
                test(0);
            }
            return;
        }
        let ends = [arc.start(), arc.end()];
        match &self.search {
            Search::Linear(boxes) => {
                let bit = |place: Option<usize>| place.map_or(0, |i| 1 << i);
                let all = (1 << self.count) - 1;
                let wanted = all & !bit(except[0]) & !bit(except[1]);
                let sweep = sweep(arc, &ends, |p| p);
                linear(boxes, wanted, &sweep, range, test);
            }
            Search::Tree(tree) => {
                let mut end = range[1];
                let test = &mut |i| {
                    if !except.contains(&Some(i)) {
                        end = test(i);
                    }
                    end
                };
                tree.visit(&sweep(arc, &ends, |p| tree.frame().local(p)), range, test);
            }
        }
    }
}

fn sweep(arc: &Arc, ends: &[DVec3; 2], map: impl Fn(DVec3) -> DVec3) -> Sweep {
    if arc.is_straight() {
        Sweep::new(&ends.map(map))
    } else {
        Sweep::new(&arc.control().map(map))
    }
}

/// Tests the boxes of the shapes in `wanted`, which has one bit per shape.
fn linear(
    boxes: &[Four],
    wanted: u32,
    sweep: &Sweep,
    [from, mut to]: [f64; 2],
    test: &mut impl FnMut(usize) -> f64,
) {
    for (group, four) in boxes.iter().enumerate() {
        let enter = four.enter(sweep, [from, to]);
        let met = |k: usize| u32::from(enter[k] <= to) << k;
        let mut left = (met(0) | met(1) | met(2) | met(3)) & (wanted >> (4 * group));
        while left != 0 {
            let k = left.trailing_zeros() as usize;
            left &= left - 1;
            if enter[k] <= to {
                to = test(4 * group + k);
            }
        }
    }
}

/// Tests of a line against the triangles of several meshes.
struct MeshTests {
    ends: [DVec3; 2],
    range: [f64; 2],
    /// Index of the last tested shape, and the test for it unless the line misses its box.
    last: Option<(u32, Option<LineTest>)>,
}

impl MeshTests {
    #[inline]
    fn new(line: &Arc, range: [f64; 2]) -> Self {
        MeshTests {
            ends: [line.start(), line.end()],
            range,
            last: None,
        }
    }

    /// Returns the intersection with a triangle; `None` if the entry is a whole shape.
    #[inline]
    fn meet(&mut self, shapes: &[Shape], entry: Entry) -> Option<Option<Intersection>> {
        let (Shape::Mesh(mesh), Some(i)) = (&shapes[entry.shape as usize], entry.triangle()) else {
            return None;
        };
        if self
            .last
            .as_ref()
            .is_none_or(|(shape, _)| *shape != entry.shape)
        {
            let test = LineTest::new(mesh, self.ends, self.range);
            self.last = Some((entry.shape, test));
        }
        let (_, test) = self.last.as_ref()?;
        Some(test.as_ref().and_then(|test| mesh.meet(test, i)))
    }
}

/// All hits that may be one event with the nearest hit. The choice among them does not depend on
/// the order in which they are added.
struct Nearest {
    /// The smallest θ.
    theta: f64,
    first: Option<(usize, Intersection)>,
    /// Other hits that were one event with the nearest hit when they were added. There are hardly
    /// ever any.
    ties: Vec<(usize, Intersection)>,
}

impl Nearest {
    /// Returns the end of the range in which a hit still matters.
    fn end(&self, theta_max: f64) -> f64 {
        theta_max.min(self.theta + TIE_TOLERANCE)
    }

    fn add(&mut self, i: usize, hit: Intersection) {
        if hit.theta > self.theta + TIE_TOLERANCE {
            return;
        }
        self.theta = self.theta.min(hit.theta);
        let limit = self.theta + TIE_TOLERANCE;
        match &mut self.first {
            Some((_, h)) if h.theta <= limit => self.ties.push((i, hit)),
            first => *first = Some((i, hit)),
        }
    }

    fn hits(&self) -> impl Iterator<Item = &(usize, Intersection)> {
        self.first.iter().chain(&self.ties)
    }

    fn choose(self) -> Option<(usize, Intersection)> {
        if self.ties.is_empty() {
            self.first
        } else {
            let limit = self.theta + TIE_TOLERANCE;
            let hits = self.hits().filter(|(_, h)| h.theta <= limit);
            hits.min_by(|(i, a), (j, b)| i.cmp(j).then_with(|| a.order(b)))
                .copied()
        }
    }
}
