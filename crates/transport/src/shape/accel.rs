//! The nearest hit among many shapes.

use super::sweep::Sweep;
use super::tree::Tree;
use super::{Hit, Shape};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::DVec3;

/// Up to so many shapes a linear search is faster than a hierarchy.
const FEW: usize = 8;

/// Hits closer in θ than this are one event, of the shape that comes first.
const TIE: f64 = 1e-12;

/// Finds the nearest hit among a fixed list of shapes.
#[derive(Clone, Debug)]
pub struct Accel(Search);

#[derive(Clone, Debug)]
enum Search {
    Linear(Vec<Aabb>),
    Tree(Tree),
}

impl Accel {
    /// An accelerator for these shapes, in this order.
    pub fn new(shapes: &[Shape]) -> Self {
        let boxes: Vec<Aabb> = shapes.iter().map(Shape::aabb).collect();
        Accel(if shapes.len() > FEW {
            Search::Tree(Tree::new(&boxes))
        } else {
            // The margin covers the rounding of the box test.
            let grow = |b: &Aabb| b.grown(1e-9 * (b.diagonal() + b.center().length()));
            Search::Linear(boxes.iter().map(grow).collect())
        })
    }

    /// The hit with the smallest θ in (theta_min, theta_max] and the index of its shape. Of hits
    /// within 1e-12 of the nearest, the one on the shape that comes first in the list.
    ///
    /// `shapes` must be the list that the accelerator was made for.
    pub fn first_hit(
        &self,
        shapes: &[Shape],
        arc: &Arc,
        theta_min: f64,
        theta_max: f64,
    ) -> Option<(usize, Hit)> {
        let mut nearest = Nearest::default();
        let mut test = |i: usize| {
            let end = nearest.end(theta_max);
            if let Some(hit) = shapes[i].first_hit(arc, theta_min, end) {
                nearest.add(i, hit);
            }
            nearest.end(theta_max)
        };
        let ends = [arc.start(), arc.end()];
        match &self.0 {
            Search::Linear(boxes) => {
                let sweep = sweep(arc, &ends, |p| p);
                linear(boxes, &sweep, [theta_min, theta_max], &mut test);
            }
            Search::Tree(tree) => {
                let sweep = sweep(arc, &ends, |p| tree.local(p));
                tree.visit(&sweep, [theta_min, theta_max], &mut test);
            }
        }
        nearest.choose()
    }
}

fn sweep(arc: &Arc, ends: &[DVec3; 2], map: impl Fn(DVec3) -> DVec3) -> Sweep {
    if arc.is_straight() {
        Sweep::new(&ends.map(map))
    } else {
        Sweep::new(&arc.control().map(map))
    }
}

fn linear(boxes: &[Aabb], sweep: &Sweep, mut range: [f64; 2], test: &mut impl FnMut(usize) -> f64) {
    for (i, b) in boxes.iter().enumerate() {
        if sweep.clip(b, range).is_some() {
            range[1] = test(i);
        }
    }
}

/// All hits that may be one event with the nearest. Which one is chosen does not depend on the
/// order in which they are added.
#[derive(Default)]
struct Nearest {
    first: Option<(usize, Hit)>,
    /// Others that may be one event with it: hardly ever any.
    ties: Vec<(usize, Hit)>,
}

impl Nearest {
    fn theta(&self) -> f64 {
        self.hits().fold(f64::INFINITY, |t, (_, h)| t.min(h.theta))
    }

    /// The end of the range where a hit still matters.
    fn end(&self, theta_max: f64) -> f64 {
        theta_max.min(self.theta() + TIE)
    }

    fn add(&mut self, i: usize, hit: Hit) {
        let limit = hit.theta.min(self.theta()) + TIE;
        self.ties.retain(|(_, h)| h.theta <= limit);
        match &mut self.first {
            Some((_, h)) if h.theta <= limit => self.ties.push((i, hit)),
            first => *first = Some((i, hit)),
        }
    }

    fn hits(&self) -> impl Iterator<Item = &(usize, Hit)> {
        self.first.iter().chain(&self.ties)
    }

    fn choose(self) -> Option<(usize, Hit)> {
        self.hits().min_by_key(|(i, _)| *i).copied()
    }
}
