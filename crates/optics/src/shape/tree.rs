//! Bounding-volume hierarchy over boxes.

use super::split::{self, Costs, Item, Node};
use super::sweep::{SingleRay, Sweep};
use eikonal::Aabb;
use glam::{DVec3, Vec3, Vec4};
use smallvec::SmallVec;
use std::ops::Range;

/// Growth of the boxes. The hierarchy maps their coordinates to [−1, 1] and stores them in single
/// precision. The growth exceeds the rounding of a stored coordinate (6e-8). It also exceeds the
/// rounding of the traversal: of the point where the curve enters the root (6e-8), of the distance
/// from there to a side (1.2e-7), and of this distance times the reciprocal of the direction
/// (2.4e-7).
const PAD: f64 = 1e-6;

/// Number of children of a node.
const WIDTH: usize = 4;

/// Entries of the stack of a traversal before it takes memory from the heap. A node adds at most
/// three.
const STACK: usize = 64;

/// Index of a missing child.
const NONE: u32 = u32::MAX;

/// Hierarchy of conservative boxes: a traversal visits every leaf whose box a curve may touch.
#[derive(Clone)]
pub struct Tree {
    hierarchy: Hierarchy,
    /// Indices of the boxes to which the leaves of the hierarchy refer.
    leaves: Vec<u32>,
}

/// Nodes of a hierarchy, whose leaves are ranges of a list.
#[derive(Clone)]
pub(super) struct Hierarchy {
    frame: Frame,
    /// Nodes, the root first; none if the whole list belongs to one leaf.
    nodes: Vec<Wide>,
    /// Length of the list.
    count: u32,
}

/// Coordinates in which a box fits in [−1, 1]³.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// The box in these coordinates, grown by [`PAD`] and rounded.
    bounds: Aabb,
    center: DVec3,
    scale: f64,
}

/// Node with up to four children, whose boxes are tested together.
#[derive(Clone)]
#[repr(align(64))]
struct Wide {
    /// Lower and upper bounds of the children along each axis.
    sides: [[Vec4; 2]; 3],
    children: [Child; WIDTH],
}

/// Child of a node.
#[derive(Clone, Copy)]
struct Child {
    /// Index of the first leaf, or of a node; [`NONE`] for a missing child.
    first: u32,
    /// Number of leaves; 0 for a node.
    count: u32,
}

impl Frame {
    pub(super) fn around(all: &Aabb) -> Self {
        let half = 0.5 * all.size().max_element();
        let mut frame = Frame {
            bounds: Aabb::EMPTY,
            center: all.center(),
            scale: if half > 0.0 { half.recip() } else { 1.0 },
        };
        let [min, max] = frame.padded(all);
        frame.bounds = Aabb {
            min: min.into(),
            max: max.into(),
        };
        frame
    }

    /// Returns the corners of a box in these coordinates, grown by [`PAD`].
    fn padded(&self, b: &Aabb) -> [Vec3; 2] {
        [self.local(b.min) - PAD, self.local(b.max) + PAD].map(|p| p.as_vec3())
    }

    /// Maps a point to these coordinates.
    #[inline]
    pub(super) fn local(&self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// Returns a length in these coordinates.
    pub(super) fn local_length(&self, length: f64) -> f64 {
        length * self.scale
    }

    /// Returns the sweep of a line between two points.
    #[inline]
    pub(super) fn line(&self, ends: &[DVec3; 2]) -> Sweep {
        Sweep::new(&ends.map(|p| self.local(p)))
    }

    /// Returns the part of `range` in which the curve may be in the box.
    #[inline]
    pub(super) fn clip(&self, sweep: &Sweep, range: [f64; 2]) -> Option<[f64; 2]> {
        sweep.clip(&self.bounds, range)
    }
}

impl Hierarchy {
    /// Builds the hierarchy over `boxes`, all of which lie in `frame`. Returns it with the indices
    /// of the boxes in the order of the leaves.
    pub(super) fn new(
        frame: Frame,
        boxes: impl ExactSizeIterator<Item = Aabb>,
        costs: Costs,
    ) -> (Self, Vec<u32>) {
        let items = boxes.zip(0..).map(|(b, place)| {
            let [min, max] = frame.padded(&b);
            Item { min, max, place }
        });
        let (nodes, places) = split::hierarchy(items.collect(), costs);
        let mut hierarchy = Hierarchy {
            frame,
            nodes: Vec::new(),
            count: places.len() as u32,
        };
        if nodes[0].count == 0 && !places.is_empty() {
            hierarchy.widen(&nodes);
        }
        (hierarchy, places)
    }

    /// Adds a wide node for the root of a binary hierarchy and for all wide nodes below it.
    fn widen(&mut self, nodes: &[Node]) {
        let mut roots = vec![0];
        self.nodes.push(Wide::EMPTY);
        let mut done = 0;
        while done < roots.len() {
            let children = widened(nodes, roots[done]);
            for (k, child) in children.into_iter().enumerate() {
                let node = &nodes[child];
                let child_of_wide = if node.count > 0 {
                    Child {
                        first: node.first,
                        count: node.count,
                    }
                } else {
                    roots.push(child);
                    self.nodes.push(Wide::EMPTY);
                    Child {
                        first: roots.len() as u32 - 1,
                        count: 0,
                    }
                };
                self.nodes[done].set(k, node, child_of_wide);
            }
            done += 1;
        }
        self.nodes.shrink_to_fit();
    }

    pub(super) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns the number of leaves.
    pub(super) fn leaves(&self) -> usize {
        let children = self.nodes.iter().flat_map(|node| &node.children);
        children.filter(|child| child.count > 0).count().max(1)
    }

    /// Replaces the range of each leaf by `new`.
    pub(super) fn renumber(&mut self, mut new: impl FnMut(Range<u32>) -> Range<u32>) {
        self.count = if self.nodes.is_empty() {
            new(0..self.count).len() as u32
        } else {
            0
        };
        let children = self.nodes.iter_mut().flat_map(|node| &mut node.children);
        for child in children.filter(|child| child.count > 0) {
            let range = new(child.leaf());
            (child.first, child.count) = (range.start, range.len() as u32);
        }
    }

    /// Calls `leaf` with the range of each leaf that a ray may touch before the parameter `end`,
    /// roughly in order. `leaf` returns the new end.
    #[inline]
    pub(super) fn visit(
        &self,
        ray: &SingleRay,
        mut end: f32,
        leaf: &mut impl FnMut(Range<u32>, f32) -> f32,
    ) {
        if self.nodes.is_empty() {
            leaf(0..self.count, end);
            return;
        }
        let mut stack: SmallVec<[(f32, Child); STACK]> = SmallVec::new();
        let mut next = Some(&self.nodes[0]);
        loop {
            if let Some(node) = next.take() {
                node.push_children(ray, end, &mut stack);
            }
            let Some((enter, child)) = stack.pop() else {
                return;
            };
            if enter > end {
                continue;
            }
            if child.count == 0 {
                next = Some(&self.nodes[child.first as usize]);
            } else {
                end = leaf(child.leaf(), end);
            }
        }
    }

    /// Calls `leaf` with the ranges of all leaves whose boxes may share a point with `b`, and
    /// possibly with others nearby, until a call returns true. Returns true if a call did.
    fn any_near(&self, b: &Aabb, leaf: &mut impl FnMut(Range<u32>) -> bool) -> bool {
        let local = Aabb {
            min: self.frame.local(b.min),
            max: self.frame.local(b.max),
        };
        if !self.frame.bounds.overlaps(&local) {
            return false;
        }
        if self.nodes.is_empty() {
            return leaf(0..self.count);
        }
        let mut stack: SmallVec<[u32; STACK]> = SmallVec::new();
        stack.push(0);
        while let Some(node) = stack.pop() {
            for child in self.nodes[node as usize].near(&local) {
                if child.count == 0 {
                    stack.push(child.first);
                } else if leaf(child.leaf()) {
                    return true;
                }
            }
        }
        false
    }
}

impl Tree {
    /// Builds the hierarchy over `boxes`. A leaf is identified by its index in `boxes`.
    pub fn new(boxes: impl ExactSizeIterator<Item = Aabb> + Clone) -> Self {
        let frame = Frame::around(&boxes.clone().fold(Aabb::EMPTY, Aabb::union));
        let (hierarchy, leaves) = Hierarchy::new(frame, boxes, Costs::SINGLE);
        Tree { hierarchy, leaves }
    }

    pub(super) fn frame(&self) -> &Frame {
        &self.hierarchy.frame
    }

    /// Calls `leaf` with each leaf that the curve may touch for a parameter in `range`, roughly in
    /// order. `leaf` returns the new end of the range.
    pub(super) fn visit(
        &self,
        sweep: &Sweep,
        range: [f64; 2],
        leaf: &mut impl FnMut(usize) -> f64,
    ) {
        if self.leaves.is_empty() {
            return;
        }
        if let Some([start, _]) = self.frame().clip(sweep, range) {
            self.visit_clipped(sweep, [start, range[1]], leaf);
        }
    }

    /// Does the work of [`Tree::visit`] for a range that starts where the range of [`Frame::clip`]
    /// starts.
    #[inline]
    pub(super) fn visit_clipped(
        &self,
        sweep: &Sweep,
        [start, end]: [f64; 2],
        leaf: &mut impl FnMut(usize) -> f64,
    ) {
        if self.hierarchy.nodes.is_empty() {
            self.leaves.iter().for_each(|i| _ = leaf(*i as usize));
            return;
        }
        let ray = sweep.single(start);
        let end = ray.parameter(end);
        self.hierarchy.visit(&ray, end, &mut |range, end| {
            let leaves = &self.leaves[range.start as usize..range.end as usize];
            let ends = leaves.iter().map(|i| ray.parameter(leaf(*i as usize)));
            ends.last().unwrap_or(end)
        });
    }

    /// Calls `leaf` with all leaves whose boxes may share a point with `b`, and possibly with
    /// others nearby, until a call returns true. Returns true if a call did.
    pub fn any_near(&self, b: &Aabb, leaf: &mut impl FnMut(usize) -> bool) -> bool {
        !self.leaves.is_empty()
            && self.hierarchy.any_near(b, &mut |range| {
                let leaves = &self.leaves[range.start as usize..range.end as usize];
                leaves.iter().any(|i| leaf(*i as usize))
            })
    }
}

impl Child {
    fn leaf(self) -> Range<u32> {
        self.first..self.first + self.count
    }
}

/// Returns up to four descendants that replace the children of a node of a binary hierarchy. The
/// largest box is divided first.
fn widened(nodes: &[Node], root: usize) -> SmallVec<[usize; WIDTH]> {
    let pair = |node: usize| [nodes[node].first as usize, nodes[node].first as usize + 1];
    let mut children: SmallVec<[usize; WIDTH]> = SmallVec::from_slice(&pair(root));
    while children.len() < WIDTH {
        let area = |child: usize| {
            let s = nodes[child].max - nodes[child].min;
            s.x * s.y + s.y * s.z + s.z * s.x
        };
        let inner = (0..children.len()).filter(|k| nodes[children[*k]].count == 0);
        let Some(largest) = inner.max_by(|a, b| area(children[*a]).total_cmp(&area(children[*b])))
        else {
            break;
        };
        let [first, second] = pair(children[largest]);
        children[largest] = first;
        children.push(second);
    }
    children
}

impl Wide {
    const EMPTY: Wide = Wide {
        sides: [[Vec4::INFINITY, Vec4::NEG_INFINITY]; 3],
        children: [Child {
            first: NONE,
            count: 0,
        }; WIDTH],
    };

    fn set(&mut self, k: usize, node: &Node, child: Child) {
        for (axis, [low, high]) in self.sides.iter_mut().enumerate() {
            (low[k], high[k]) = (node.min[axis], node.max[axis]);
        }
        self.children[k] = child;
    }

    /// Pushes the children that a ray may enter before the parameter `end`, the nearest last.
    #[inline]
    fn push_children(
        &self,
        ray: &SingleRay,
        end: f32,
        stack: &mut SmallVec<[(f32, Child); STACK]>,
    ) {
        let (enter, mut met) = ray.enter(&self.sides, end);
        let enter = enter.to_array();
        let first = stack.len();
        while met != 0 {
            let k = met.trailing_zeros() as usize;
            met &= met - 1;
            // Insert in descending order of the parameters.
            let mut place = stack.len();
            stack.push((enter[k], self.children[k]));
            while place > first && stack[place - 1].0 < enter[k] {
                stack[place] = stack[place - 1];
                place -= 1;
            }
            stack[place] = (enter[k], self.children[k]);
        }
    }

    /// Returns the children whose boxes overlap a box.
    fn near(&self, b: &Aabb) -> impl Iterator<Item = Child> + '_ {
        let (min, max) = (b.min, b.max);
        let overlaps = move |k: usize| {
            self.sides.iter().enumerate().all(|(axis, [low, high])| {
                f64::from(low[k]) <= max[axis] && f64::from(high[k]) >= min[axis]
            })
        };
        let children = self.children.into_iter().enumerate();
        children.filter_map(move |(k, child)| overlaps(k).then_some(child))
    }
}

impl std::fmt::Debug for Tree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tree")
            .field("leaves", &self.leaves.len())
            .finish_non_exhaustive()
    }
}
