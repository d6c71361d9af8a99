//! Top-down construction of bounding-volume hierarchies by the surface area heuristic (J. Goldsmith
//! and J. Salmon, "Automatic creation of object hierarchies for ray tracing", 1987), with boxes
//! sorted into bins (I. Wald, "On fast construction of SAH-based bounding volume hierarchies",
//! 2007). Depth and time are bounded for every list of boxes.

use glam::Vec3;
use std::ops::Range;

/// Largest number of levels below the root.
pub(super) const MAX_DEPTH: u32 = 64;

/// Largest number of bins for the centres of boxes along an axis.
const MAX_BINS: usize = 16;

/// Largest number of boxes in a leaf, unless they cannot be separated.
const MAX_LEAF_BOXES: usize = 4;

/// Costs of a traversal, which decide where a hierarchy ends.
#[derive(Clone, Copy)]
pub(super) struct Costs {
    /// Number of boxes of a leaf whose contents are tested together.
    pub together: usize,
    /// Cost of a visit to a node, relative to the test of what is tested together.
    pub visit: f32,
}

impl Costs {
    /// Costs of leaves whose contents are tested one by one. The four boxes of a node are tested
    /// together. With a cost of 3 and up to eight boxes in a leaf, pictures of meshes took a tenth
    /// more time.
    pub(super) const SINGLE: Costs = Costs {
        together: 1,
        visit: 0.6,
    };

    /// Returns the number of tests of a leaf with `count` boxes.
    fn tests(&self, count: usize) -> f32 {
        count.div_ceil(self.together) as f32
    }
}

/// Box of the list, with its index in the list.
#[derive(Clone, Copy)]
pub(super) struct Item {
    pub min: Vec3,
    pub max: Vec3,
    pub place: u32,
}

/// Node of the hierarchy: a box, and its leaves or children.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub min: Vec3,
    pub max: Vec3,
    /// Index of the first leaf, or of the first of two children.
    pub first: u32,
    /// Number of leaves; 0 for a node with children.
    pub count: u32,
}

/// Box around other boxes, in single precision. Its corners are corners of boxes in the list, so
/// nothing is rounded.
#[derive(Clone, Copy)]
struct Bounds {
    min: Vec3,
    max: Vec3,
}

/// Hierarchy under construction.
struct Builder {
    /// Boxes in the order of the leaves.
    items: Vec<Item>,
    nodes: Vec<Node>,
    costs: Costs,
}

/// Node that may still be split.
struct Task {
    node: usize,
    part: Range<usize>,
    /// Number of further levels allowed below the node.
    levels: u32,
}

/// Number of boxes whose centres fall into a bin, and the box around these boxes.
type Bin = (u32, Bounds);

/// Map from the centres of boxes to bins, along all axes.
struct Binning {
    min: Vec3,
    /// Bins per length; not finite along axes on which all centres coincide.
    scale: Vec3,
    count: usize,
}

/// Split of boxes into those whose centres fall into bins up to `bin` along `axis`, and the rest.
#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    bin: usize,
    /// Sum over both parts of the number of tests times half the area of the box around them.
    cost: f32,
    /// Boxes around the two parts.
    around: [Bounds; 2],
}

/// Builds the hierarchy. Returns its nodes, and the indices of the boxes to which the leaves refer.
pub(super) fn hierarchy(items: Vec<Item>, costs: Costs) -> (Vec<Node>, Vec<u32>) {
    let whole = 0..items.len();
    let mut builder = Builder {
        nodes: Vec::with_capacity(items.len()),
        items,
        costs,
    };
    let root = leaf(builder.around(whole.clone()), &whole);
    builder.nodes.push(root);
    let mut tasks = vec![Task {
        node: 0,
        part: whole,
        levels: MAX_DEPTH,
    }];
    while let Some(task) = tasks.pop() {
        if let Some((middle, around)) = builder.divide(&task) {
            let first = builder.nodes.len();
            builder.nodes[task.node].first = first as u32;
            builder.nodes[task.node].count = 0;
            let parts = [task.part.start..middle, middle..task.part.end];
            for (k, part) in parts.into_iter().enumerate() {
                builder.nodes.push(leaf(around[k], &part));
                tasks.push(Task {
                    node: first + k,
                    part,
                    levels: task.levels - 1,
                });
            }
        }
    }
    builder.nodes.shrink_to_fit();
    let places = builder.items.iter().map(|item| item.place);
    (builder.nodes, places.collect())
}

fn leaf(around: Bounds, part: &Range<usize>) -> Node {
    Node {
        min: around.min,
        max: around.max,
        first: part.start as u32,
        count: part.len() as u32,
    }
}

impl Builder {
    fn around(&self, part: Range<usize>) -> Bounds {
        let boxes = self.items[part].iter().map(Item::bounds);
        boxes.fold(Bounds::EMPTY, Bounds::union)
    }

    /// Reorders a part so that the boxes of each child are contiguous. Returns the start of the
    /// second child and the boxes around both children, or `None` for a leaf.
    fn divide(&mut self, task: &Task) -> Option<(usize, [Bounds; 2])> {
        let part = task.part.clone();
        if part.len() < 2 {
            return None;
        }
        // Find the cheapest split, and make a leaf if it costs no more.
        let binning = Binning::of(&self.items[part.clone()]);
        let best = self.best_split(part.clone(), &binning);
        let cost = best.map_or(f32::INFINITY, |split| split.cost);
        let node = &self.nodes[task.node];
        let area = Bounds {
            min: node.min,
            max: node.max,
        }
        .half_area();
        let saved = self.costs.tests(part.len()) - self.costs.visit;
        if part.len() <= MAX_LEAF_BOXES && area * saved <= cost {
            return None;
        }
        // Leave enough levels for splitting each child by halves.
        let fits = |larger: usize| larger < part.len() && larger.ilog2() + 2 <= task.levels;
        if let Some(split) = best {
            let low = self.partition(part.clone(), &binning, &split);
            if fits(low.max(part.len() - low)) {
                return Some((part.start + low, split.around));
            }
        }
        // Otherwise split the part by halves.
        let middle = self.halve(task);
        let parts = [part.start..middle, middle..part.end];
        Some((middle, parts.map(|part| self.around(part))))
    }

    /// Returns the cheapest split of a part, along an axis on which centres differ.
    fn best_split(&self, part: Range<usize>, binning: &Binning) -> Option<Split> {
        let count = binning.count;
        let mut bins: [[Bin; MAX_BINS]; 3] = [[(0, Bounds::EMPTY); MAX_BINS]; 3];
        for item in &self.items[part] {
            for (bins, bin) in bins.iter_mut().zip(binning.bins(item)) {
                bins[bin] = join(bins[bin], (1, item.bounds()));
            }
        }
        let splits = bins.iter().enumerate().filter_map(|(axis, bins)| {
            let mut above: [Bin; MAX_BINS + 1] = [(0, Bounds::EMPTY); MAX_BINS + 1];
            for k in (0..count).rev() {
                above[k] = join(bins[k], above[k + 1]);
            }
            let mut below = (0, Bounds::EMPTY);
            let splits = (0..count - 1).filter_map(|bin| {
                below = join(below, bins[bin]);
                let parts = [below, above[bin + 1]];
                let cost = |(n, b): &Bin| self.costs.tests(*n as usize) * b.half_area();
                parts.iter().all(|p| p.0 > 0).then(|| Split {
                    axis,
                    bin,
                    cost: parts.iter().map(cost).sum(),
                    around: parts.map(|p| p.1),
                })
            });
            splits.min_by(|a, b| a.cost.total_cmp(&b.cost))
        });
        splits.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Reorders a part by a split, and returns the number of boxes in its first half.
    fn partition(&mut self, part: Range<usize>, binning: &Binning, split: &Split) -> usize {
        let items = &mut self.items[part];
        let (mut low, mut high) = (0, items.len());
        while low < high {
            if binning.bins(&items[low])[split.axis] <= split.bin {
                low += 1;
            } else {
                high -= 1;
                items.swap(low, high);
            }
        }
        low
    }

    /// Divides a part into halves along the longest axis of its box, and returns the start of the
    /// second half.
    fn halve(&mut self, task: &Task) -> usize {
        let node = &self.nodes[task.node];
        let axis = (node.max - node.min).max_position();
        let half = task.part.len() / 2;
        let center = |item: &Item| item.center()[axis];
        let items = &mut self.items[task.part.clone()];
        items.select_nth_unstable_by(half, |a, b| {
            center(a).total_cmp(&center(b)).then(a.place.cmp(&b.place))
        });
        task.part.start + half
    }
}

impl Item {
    fn bounds(&self) -> Bounds {
        Bounds {
            min: self.min,
            max: self.max,
        }
    }

    fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    fn union(self, other: Bounds) -> Bounds {
        Bounds {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    fn half_area(&self) -> f32 {
        let s = self.max - self.min;
        s.x * s.y + s.y * s.z + s.z * s.x
    }
}

impl Binning {
    /// Creates bins that divide the box around the centres of `items`. There are at least two bins.
    fn of(items: &[Item]) -> Self {
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let centers = items.iter().map(Item::center);
        let (min, max) = centers.fold(empty, |(min, max), c| (min.min(c), max.max(c)));
        let count = (2 * items.len()).min(MAX_BINS);
        Binning {
            min,
            scale: count as f32 / (max - min),
            count,
        }
    }

    /// Returns the bins of an item along each axis; the first bin along axes on which all centres
    /// coincide.
    fn bins(&self, item: &Item) -> [usize; 3] {
        let place = (item.center() - self.min) * self.scale;
        place.to_array().map(|x| (x as usize).min(self.count - 1))
    }
}

fn join((n, a): Bin, (m, b): Bin) -> Bin {
    (n + m, a.union(b))
}
