//! Bounding-volume hierarchy over boxes.

use super::split::{self, Item, Node};
use super::sweep::{SingleRay, Sweep};
use eikonal::Aabb;
use glam::DVec3;
use smallvec::SmallVec;

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
    /// Box around all leaves.
    bounds: Aabb,
    /// Nodes, the root first; none if all leaves belong to one node.
    nodes: Vec<Wide>,
    /// Indices of the leaves in the list of boxes.
    leaves: Vec<u32>,
    center: DVec3,
    scale: f64,
}

/// Node with up to four children, whose boxes are tested together.
#[derive(Clone)]
#[repr(align(64))]
struct Wide {
    /// Lower and upper bounds of the children along each axis.
    sides: [[[f32; WIDTH]; 2]; 3],
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

impl Tree {
    /// Builds the hierarchy over `boxes`. A leaf is identified by its index in `boxes`.
    pub fn new(boxes: impl ExactSizeIterator<Item = Aabb> + Clone) -> Self {
        let all = boxes.clone().fold(Aabb::EMPTY, Aabb::union);
        let half = 0.5 * all.size().max_element();
        let mut tree = Tree {
            bounds: Aabb::EMPTY,
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
        let (nodes, leaves) = split::hierarchy(items.collect());
        tree.leaves = leaves;
        let root = &nodes[0];
        tree.bounds = bounds(root);
        let is_leaf = root.count > 0 || tree.leaves.is_empty();
        if !is_leaf {
            tree.widen(&nodes);
        }
        tree
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

    /// Maps a point to the coordinates of the hierarchy, in which all boxes fit in [−1, 1]³.
    pub(super) fn local(&self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// Returns the part of `range` in which the curve may be in the box around all leaves.
    pub(super) fn clip(&self, sweep: &Sweep, range: [f64; 2]) -> Option<[f64; 2]> {
        (!self.leaves.is_empty()).then(|| sweep.clip(&self.bounds, range))?
    }

    /// Calls `leaf` with each leaf that the curve may touch for a parameter in `range`, roughly in
    /// order. `leaf` returns the new end of the range.
    pub(super) fn visit(
        &self,
        sweep: &Sweep,
        range: [f64; 2],
        leaf: &mut impl FnMut(usize) -> f64,
    ) {
        if let Some([start, _]) = self.clip(sweep, range) {
            self.visit_clipped(sweep, [start, range[1]], leaf);
        }
    }

    /// Does the work of [`Tree::visit`] for a range that starts where the range of [`Tree::clip`]
    /// starts.
    #[inline]
    pub(super) fn visit_clipped(
        &self,
        sweep: &Sweep,
        [start, end]: [f64; 2],
        leaf: &mut impl FnMut(usize) -> f64,
    ) {
        if self.nodes.is_empty() {
            self.leaves.iter().for_each(|i| _ = leaf(*i as usize));
            return;
        }
        let ray = sweep.single(start);
        let mut end = ray.parameter(end);
        let mut stack: SmallVec<[(f32, Child); STACK]> = SmallVec::new();
        let mut next = Some(&self.nodes[0]);
        loop {
            if let Some(node) = next.take() {
                node.push_children(&ray, end, &mut stack);
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
                let leaves = child.first as usize..(child.first + child.count) as usize;
                for &i in &self.leaves[leaves] {
                    end = ray.parameter(leaf(i as usize));
                }
            }
        }
    }

    /// Calls `leaf` with all leaves whose boxes may share a point with `b`, and possibly with
    /// others nearby, until a call returns true. Returns true if a call did.
    pub fn any_near(&self, b: &Aabb, leaf: &mut impl FnMut(usize) -> bool) -> bool {
        let local = Aabb {
            min: self.local(b.min),
            max: self.local(b.max),
        };
        if self.leaves.is_empty() || !self.bounds.overlaps(&local) {
            return false;
        }
        if self.nodes.is_empty() {
            return self.leaves.iter().any(|i| leaf(*i as usize));
        }
        let mut stack: SmallVec<[u32; STACK]> = SmallVec::new();
        stack.push(0);
        while let Some(node) = stack.pop() {
            for child in self.nodes[node as usize].near(&local) {
                if child.count == 0 {
                    stack.push(child.first);
                    continue;
                }
                let leaves = child.first as usize..(child.first + child.count) as usize;
                if self.leaves[leaves].iter().any(|i| leaf(*i as usize)) {
                    return true;
                }
            }
        }
        false
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
        sides: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
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
        let enter = ray.enter(&self.sides, end);
        let first = stack.len();
        for (enter, child) in enter.into_iter().zip(self.children) {
            if enter <= end {
                // Insert in descending order of the parameters.
                let mut place = stack.len();
                stack.push((enter, child));
                while place > first && stack[place - 1].0 < enter {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = (enter, child);
            }
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

/// Returns the box of a node.
fn bounds(node: &Node) -> Aabb {
    Aabb {
        min: node.min.into(),
        max: node.max.into(),
    }
}
