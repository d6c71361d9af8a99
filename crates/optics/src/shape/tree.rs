//! Bounding-volume hierarchy over boxes.

use super::split::{self, Item, Node};
use super::sweep::Sweep;
use eikonal::Aabb;
use glam::DVec3;

/// Growth of the boxes. The hierarchy maps their coordinates to [−1, 1] and stores them in single
/// precision. The growth is several times the rounding of a stored coordinate (6e-8) and of the
/// traversal in double precision (1e-13 for a segment a thousand times as long as the hierarchy).
const PAD: f64 = 4e-7;

/// Hierarchy of conservative boxes: traversal in double precision visits every leaf whose box a
/// curve may touch.
#[derive(Clone)]
pub struct Tree {
    /// The root, followed by pairs of children.
    nodes: Vec<Node>,
    /// Indices of the leaves in the list of boxes.
    leaves: Vec<u32>,
    center: DVec3,
    scale: f64,
}

impl Tree {
    /// Builds the hierarchy over `boxes`. A leaf is identified by its index in `boxes`.
    pub fn new(boxes: impl ExactSizeIterator<Item = Aabb> + Clone) -> Self {
        let all = boxes.clone().fold(Aabb::EMPTY, Aabb::union);
        let half = 0.5 * all.size().max_element();
        let mut tree = Tree {
            nodes: Vec::new(),
            leaves: Vec::new(),
            center: all.center(),
            scale: if half > 0.0 { half.recip() } else { 1.0 },
        };
        let items = boxes.zip(0..).map(|(b, place)| Item {
            min: (tree.local(b.min) - PAD).as_vec3(),
            max: (tree.local(b.max) + PAD).as_vec3(),
            place,
        });
        (tree.nodes, tree.leaves) = split::hierarchy(items.collect());
        tree
    }

    /// Maps a point to the coordinates of the hierarchy, in which all boxes fit in [−1, 1]³.
    pub(super) fn local(&self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// Returns the part of `range` in which the curve may be in the box around all leaves.
    pub(super) fn clip(&self, sweep: &Sweep, range: [f64; 2]) -> Option<[f64; 2]> {
        sweep.clip(&bounds(self.nodes.first()?), range)
    }

    /// Calls `leaf` with each leaf that the curve may touch for a parameter in `range`, roughly in
    /// order. `leaf` returns the new end of the range.
    pub(super) fn visit(
        &self,
        sweep: &Sweep,
        range: [f64; 2],
        leaf: &mut impl FnMut(usize) -> f64,
    ) {
        if let Some(root) = self.nodes.first()
            && sweep.clip(&bounds(root), range).is_some()
        {
            let mut walk = Walk {
                tree: self,
                sweep,
                range,
                leaf,
            };
            walk.node(root);
        }
    }
}

impl Tree {
    /// Calls `leaf` with all leaves whose boxes may share a point with `b`, and possibly with
    /// others nearby, until a call returns true. Returns true if a call did.
    pub fn any_near(&self, b: &Aabb, leaf: &mut impl FnMut(usize) -> bool) -> bool {
        let local = Aabb {
            min: self.local(b.min),
            max: self.local(b.max),
        };
        !self.leaves.is_empty() && self.any_below(&self.nodes[0], &local, leaf)
    }

    /// Visits a node and its descendants, at most [`DEPTH`](super::split::DEPTH) levels.
    fn any_below(&self, node: &Node, b: &Aabb, leaf: &mut impl FnMut(usize) -> bool) -> bool {
        let first = node.first as usize;
        if !bounds(node).overlaps(b) {
            false
        } else if node.count > 0 {
            let mut leaves = self.leaves[first..first + node.count as usize].iter();
            leaves.any(|i| leaf(*i as usize))
        } else {
            let mut children = self.nodes[first..first + 2].iter();
            children.any(|child| self.any_below(child, b, leaf))
        }
    }
}

impl std::fmt::Debug for Tree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tree")
            .field("leaves", &self.leaves.len())
            .finish_non_exhaustive()
    }
}

struct Walk<'a, F> {
    tree: &'a Tree,
    sweep: &'a Sweep,
    range: [f64; 2],
    leaf: &'a mut F,
}

impl<F: FnMut(usize) -> f64> Walk<'_, F> {
    /// Visits a node and its descendants, at most [`DEPTH`](super::split::DEPTH) levels.
    fn node(&mut self, node: &Node) {
        let first = node.first as usize;
        if node.count > 0 {
            let leaves = first..first + node.count as usize;
            for &i in &self.tree.leaves[leaves] {
                self.range[1] = (self.leaf)(i as usize);
            }
            return;
        }
        let children = &self.tree.nodes[first..first + 2];
        let enter = [self.enter(&children[0]), self.enter(&children[1])];
        let order = if enter[1] < enter[0] { [1, 0] } else { [0, 1] };
        for k in order {
            if enter[k] <= self.range[1] {
                self.node(&children[k]);
            }
        }
    }

    fn enter(&self, node: &Node) -> f64 {
        self.sweep
            .clip(&bounds(node), self.range)
            .map_or(f64::INFINITY, |[enter, _]| enter)
    }
}

#[inline]
fn bounds(node: &Node) -> Aabb {
    Aabb {
        min: node.min.into(),
        max: node.max.into(),
    }
}
