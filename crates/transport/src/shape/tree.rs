//! A bounding-volume hierarchy over boxes.

use super::sweep::Sweep;
use eikonal::Aabb;
use glam::DVec3;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use std::time::Duration;

/// Growth of the boxes, whose coordinates the hierarchy maps to [−1, 1] and stores in single
/// precision: several times the rounding of a stored coordinate (6e-8) and of the traversal in
/// double precision (1e-13 for a segment a thousand times as long as everything).
const PAD: f64 = 4e-7;

/// A hierarchy whose boxes are conservative: traversal in double precision visits every leaf whose
/// box a curve may touch.
#[derive(Clone)]
pub(super) struct Tree {
    bvh: Bvh2,
    center: DVec3,
    scale: f64,
}

impl Tree {
    /// The hierarchy over at least one box; leaves are named by their place in `boxes`.
    pub(super) fn new(boxes: &[Aabb]) -> Self {
        let all = boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(*b));
        let half = 0.5 * all.size().max_element();
        let mut tree = Tree {
            bvh: Bvh2::default(),
            center: all.center(),
            scale: if half > 0.0 { half.recip() } else { 1.0 },
        };
        let stored: Vec<_> = boxes.iter().map(|b| tree.store(b)).collect();
        let params = BvhBuildParams::medium_build();
        let mut build_time = Duration::ZERO;
        tree.bvh = build_bvh2(&stored, params, &mut build_time);
        tree
    }

    fn store(&self, b: &Aabb) -> obvhs::aabb::Aabb {
        obvhs::aabb::Aabb::new(
            (self.local(b.min) - PAD).as_vec3a(),
            (self.local(b.max) + PAD).as_vec3a(),
        )
    }

    /// A point in the coordinates of the hierarchy, where everything fits in [−1, 1]³.
    pub(super) fn local(&self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// The part of `range` in which the curve may be in the box around everything.
    pub(super) fn clip(&self, sweep: &Sweep, range: [f64; 2]) -> Option<[f64; 2]> {
        sweep.clip(&bounds(self.bvh.nodes.first()?), range)
    }

    /// Calls `leaf` with each leaf that the curve may touch for a parameter in `range`, roughly in
    /// order; `leaf` returns the end of the range that is still of interest.
    pub(super) fn visit(
        &self,
        sweep: &Sweep,
        range: [f64; 2],
        leaf: &mut impl FnMut(usize) -> f64,
    ) {
        if let Some(root) = self.bvh.nodes.first()
            && sweep.clip(&bounds(root), range).is_some()
        {
            let mut walk = Walk {
                bvh: &self.bvh,
                sweep,
                range,
                leaf,
            };
            walk.node(root);
        }
    }
}

impl std::fmt::Debug for Tree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tree")
            .field("leaves", &self.bvh.primitive_indices.len())
            .finish_non_exhaustive()
    }
}

struct Walk<'a, F> {
    bvh: &'a Bvh2,
    sweep: &'a Sweep,
    range: [f64; 2],
    leaf: &'a mut F,
}

impl<F: FnMut(usize) -> f64> Walk<'_, F> {
    fn node(&mut self, node: &Bvh2Node) {
        let first = node.first_index as usize;
        if node.is_leaf() {
            let leaves = first..first + node.prim_count as usize;
            for &i in &self.bvh.primitive_indices[leaves] {
                self.range[1] = (self.leaf)(i as usize);
            }
            return;
        }
        let children = &self.bvh.nodes[first..first + 2];
        let enter = [self.enter(&children[0]), self.enter(&children[1])];
        let order = if enter[1] < enter[0] { [1, 0] } else { [0, 1] };
        for k in order {
            if enter[k] <= self.range[1] {
                self.node(&children[k]);
            }
        }
    }

    fn enter(&self, node: &Bvh2Node) -> f64 {
        self.sweep
            .clip(&bounds(node), self.range)
            .map_or(f64::INFINITY, |[enter, _]| enter)
    }
}

fn bounds(node: &Bvh2Node) -> Aabb {
    let b = node.aabb();
    Aabb {
        min: DVec3::from(glam::Vec3::from(b.min)),
        max: DVec3::from(glam::Vec3::from(b.max)),
    }
}
