//! Builds bounding-volume hierarchies from the top by the surface area heuristic (J. Goldsmith and J. Salmon,
//! "Automatic creation of object hierarchies for ray tracing", 1987), with boxes sorted into bins (I. Wald, "On fast
//! construction of SAH-based bounding volume hierarchies", 2007). Depth and time are bounded for every list of boxes.

use eikonal::Aabb;
use glam::Vec3;
use std::ops::Range;

/// Largest number of levels below the root.
pub(super) const DEPTH: u32 = 64;

/// Largest number of bins for the centres of boxes along an axis.
const BINS: usize = 16;

/// Largest number of boxes in a leaf, unless they cannot be separated.
const LEAF: usize = 8;

/// Cost of a visit to a node, relative to the test of a leaf's box and shape.
const VISIT: f64 = 3.0;

/// A box and what it holds.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub min: Vec3,
    pub max: Vec3,
    /// First of its leaves, or of its two children.
    pub first: u32,
    /// Number of leaves; 0 for a node with children.
    pub count: u32,
}

/// A hierarchy in the making.
pub(super) struct Builder {
    boxes: Vec<Aabb>,
    order: Vec<u32>,
    nodes: Vec<Node>,
}

/// A node without children yet.
struct Task {
    node: usize,
    part: Range<usize>,
    /// Levels that may still be below it.
    levels: u32,
}

/// Boxes whose centres fall into the bins up to `bin` along `axis`, and the others.
#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    bin: usize,
    /// Expected number of box tests in both parts, times the area of the whole.
    cost: f64,
}

impl Builder {
    /// A builder for at least one box.
    pub(super) fn new(boxes: Vec<Aabb>) -> Self {
        Builder {
            order: (0..boxes.len() as u32).collect(),
            nodes: Vec::with_capacity(boxes.len()),
            boxes,
        }
    }

    /// The nodes, and the order of the boxes to which their leaves refer.
    pub(super) fn build(mut self) -> (Vec<Node>, Vec<u32>) {
        let whole = 0..self.boxes.len();
        let root = self.leaf(whole.clone());
        self.nodes.push(root);
        let mut tasks = vec![Task {
            node: 0,
            part: whole,
            levels: DEPTH,
        }];
        while let Some(task) = tasks.pop() {
            if let Some(middle) = self.divide(&task) {
                let first = self.nodes.len();
                self.nodes[task.node].first = first as u32;
                self.nodes[task.node].count = 0;
                let parts = [task.part.start..middle, middle..task.part.end];
                for (k, part) in parts.into_iter().enumerate() {
                    let node = self.leaf(part.clone());
                    self.nodes.push(node);
                    tasks.push(Task {
                        node: first + k,
                        part,
                        levels: task.levels - 1,
                    });
                }
            }
        }
        (self.nodes, self.order)
    }

    fn leaf(&self, part: Range<usize>) -> Node {
        let around = self.around(part.clone());
        Node {
            min: around.min.as_vec3(),
            max: around.max.as_vec3(),
            first: part.start as u32,
            count: part.len() as u32,
        }
    }

    fn around(&self, part: Range<usize>) -> Aabb {
        let boxes = self.order[part].iter().map(|i| self.boxes[*i as usize]);
        boxes.fold(Aabb::EMPTY, |a, b| a.union(b))
    }

    /// Reorders a part so that its two children are beside each other, and returns where the second one starts; `None`
    /// for a leaf.
    fn divide(&mut self, task: &Task) -> Option<usize> {
        let part = task.part.clone();
        if part.len() == 1 {
            return None;
        }
        let centers = self.order[part.clone()].iter();
        let centers = Aabb::around(centers.map(|i| self.boxes[*i as usize].center()));
        let axes = (0..3).filter(|axis| centers.size()[*axis] > 0.0);
        let best = axes.filter_map(|axis| self.best_split(part.clone(), &centers, axis));
        let best = best.min_by(|a, b| a.cost.total_cmp(&b.cost));
        let cost = best.map_or(f64::INFINITY, |split| split.cost);
        let area = half_area(&self.around(part.clone()));
        if part.len() <= LEAF && area * (part.len() as f64 - VISIT) <= cost {
            return None;
        }
        let middle = best.map_or(part.start, |split| {
            part.start + self.partition(part.clone(), &centers, split)
        });
        let larger = (middle - part.start).max(part.end - middle);
        // As many levels as halving takes must be left.
        let fits = larger < part.len() && larger.ilog2() + 2 <= task.levels;
        Some(if fits { middle } else { self.halve(part) })
    }

    /// The cheapest split along an axis in which centres differ.
    fn best_split(&self, part: Range<usize>, centers: &Aabb, axis: usize) -> Option<Split> {
        let count = bins_for(part.len());
        let mut bins = [(0, Aabb::EMPTY); BINS];
        for i in &self.order[part] {
            let b = &self.boxes[*i as usize];
            let bin = &mut bins[bin(b, centers, axis, count)];
            *bin = (bin.0 + 1, bin.1.union(*b));
        }
        let join = |(n, a): (usize, Aabb), (m, b): (usize, Aabb)| (n + m, a.union(b));
        let mut above = [(0, Aabb::EMPTY); BINS + 1];
        for k in (0..count).rev() {
            above[k] = join(bins[k], above[k + 1]);
        }
        let mut below = (0, Aabb::EMPTY);
        let splits = (0..count - 1).filter_map(|k| {
            below = join(below, bins[k]);
            let parts = [below, above[k + 1]];
            let cost = |(n, b): &(usize, Aabb)| *n as f64 * half_area(b);
            parts.iter().all(|p| p.0 > 0).then(|| Split {
                axis,
                bin: k,
                cost: parts.iter().map(cost).sum(),
            })
        });
        splits.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Reorders a part by a split and returns the number of boxes in its first half.
    fn partition(&mut self, part: Range<usize>, centers: &Aabb, split: Split) -> usize {
        let (boxes, count) = (&self.boxes, bins_for(part.len()));
        let (low, high): (Vec<u32>, Vec<u32>) = self.order[part.clone()]
            .iter()
            .partition(|i| bin(&boxes[**i as usize], centers, split.axis, count) <= split.bin);
        self.order[part.start..part.start + low.len()].copy_from_slice(&low);
        self.order[part.start + low.len()..part.end].copy_from_slice(&high);
        low.len()
    }

    /// Divides a part into two of equal size along the longest axis of its box, and returns where the second one starts.
    fn halve(&mut self, part: Range<usize>) -> usize {
        let axis = self.around(part.clone()).size().max_position();
        let boxes = &self.boxes;
        let center = |i: &u32| boxes[*i as usize].center()[axis];
        let half = part.len() / 2;
        self.order[part.clone()]
            .select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)).then(a.cmp(b)));
        part.start + half
    }
}

fn half_area(b: &Aabb) -> f64 {
    let s = b.size();
    s.x * s.y + s.y * s.z + s.z * s.x
}

/// Number of bins for so many boxes, at least two.
fn bins_for(boxes: usize) -> usize {
    (2 * boxes).min(BINS)
}

/// The bin of a box among `count` bins that divide the box of all centres along an axis.
fn bin(b: &Aabb, centers: &Aabb, axis: usize, count: usize) -> usize {
    let place = (b.center()[axis] - centers.min[axis]) / centers.size()[axis];
    ((place * count as f64) as usize).min(count - 1)
}
