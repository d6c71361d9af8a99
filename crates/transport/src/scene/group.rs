//! Emitters of one class, and the choice of one of them.
//!
//! A connection chooses an emitter in proportion to an estimate of its contribution. The estimate
//! is intensity over squared distance, times the cosine or the phase function along the chord. For
//! many emitters, the choice descends a tree of balls around them and weighs each branch as one
//! light (after A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive
//! Tree Splitting", 2018). The cost then grows as the logarithm of the number of emitters.
//! Estimates ignore occlusion and ray bending; therefore a fraction of the choices is uniform.
//!
//! Theory: docs/theory.md#choice-of-emitter.

use super::light_bounds::{LightBounds, Receiver};
use crate::emitter::Emitter;
use eikonal::Aabb;
use glam::DVec3;
use smallvec::SmallVec;
use std::cell::RefCell;
use std::ops::Range;

/// Fraction of uniform choices.
pub(super) const UNIFORM_FRACTION: f64 = 0.1;
/// Largest number of emitters that are weighed one by one.
const BUCKET: usize = 8;
/// A node of the tree: some emitters, weighed together.
#[derive(Clone, Debug)]
struct Node {
    content: Content,
    parent: usize,
    /// Ball around all near emitters; `None` for distant emitters, which are weighed one by one.
    ball: Option<(DVec3, f64)>,
    strength: f64,
}

#[derive(Clone, Debug)]
enum Content {
    Inner([usize; 2]),
    /// Range of a group's members.
    Leaf(Range<usize>),
}

/// An emitter of a group.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub emitter: usize,
    bounds: LightBounds,
    /// Node that holds the emitter.
    leaf: usize,
}

/// The emitters of one class.
#[derive(Clone, Debug, Default)]
pub(super) struct Group {
    /// Members in the order of the leaves.
    pub members: Vec<Member>,
    nodes: Vec<Node>,
}

impl Group {
    pub(super) fn new(lights: Vec<(usize, LightBounds)>) -> Self {
        let (near, far): (Vec<_>, Vec<_>) = lights.into_iter().partition(|(_, l)| l.is_near());
        let mut group = Group::default();
        if near.is_empty() || far.is_empty() {
            if !near.is_empty() {
                group.branch(near, 0);
            } else if !far.is_empty() {
                group.leaf(far, 0, None);
            }
            return group;
        }
        let root = group.push(0, None, 0.0);
        let children = [group.branch(near, root), group.leaf(far, root, None)];
        group.nodes[root].content = Content::Inner(children);
        group
    }

    /// Adds an empty node.
    fn push(&mut self, parent: usize, ball: Option<(DVec3, f64)>, strength: f64) -> usize {
        self.nodes.push(Node {
            content: Content::Leaf(0..0),
            parent,
            ball,
            strength,
        });
        self.nodes.len() - 1
    }

    fn leaf(
        &mut self,
        lights: Vec<(usize, LightBounds)>,
        parent: usize,
        ball: Option<(DVec3, f64)>,
    ) -> usize {
        let strength = lights.iter().map(|(_, l)| l.strength).sum();
        let leaf = self.push(parent, ball, strength);
        let first = self.members.len();
        let member = |(emitter, bounds)| Member {
            emitter,
            bounds,
            leaf,
        };
        self.members.extend(lights.into_iter().map(member));
        self.nodes[leaf].content = Content::Leaf(first..self.members.len());
        leaf
    }

    /// Adds a tree over lights, halved along the longest side of the box around their centres.
    fn branch(&mut self, mut lights: Vec<(usize, LightBounds)>, parent: usize) -> usize {
        let centers = lights.iter().map(|(_, l)| l.center);
        let all = centers.fold(Aabb::EMPTY, Aabb::include);
        let (center, size) = (all.center(), all.size());
        let reach = lights
            .iter()
            .map(|(_, l)| l.center.distance(center) + l.radius);
        let ball = (center, reach.fold(0.0, f64::max));
        if lights.len() <= BUCKET {
            return self.leaf(lights, parent, Some(ball));
        }
        let axis = size.max_position();
        lights.sort_by(|(_, a), (_, b)| a.center[axis].total_cmp(&b.center[axis]));
        let strength = lights.iter().map(|(_, l)| l.strength).sum();
        let upper = lights.split_off(lights.len() / 2);
        let node = self.push(parent, Some(ball), strength);
        let children = [self.branch(lights, node), self.branch(upper, node)];
        self.nodes[node].content = Content::Inner(children);
        node
    }
}

/// Choice among the emitters of a group, for a receiver of their light.
pub(crate) struct EmitterChoice<'a> {
    group: &'a Group,
    emitters: &'a [Emitter],
    receiver: &'a Receiver<'a>,
    /// Leaf whose members were weighed last, and their weights.
    last: RefCell<Option<(usize, LeafWeights)>>,
}

/// Estimated contributions of the members of a leaf.
struct LeafWeights {
    guesses: SmallVec<[f64; BUCKET]>,
    total: f64,
}

impl LeafWeights {
    /// Returns the position of the member that a uniform number chooses.
    fn choose(&self, u: f64) -> usize {
        let mut left = u * self.total;
        let passes = |guess: &f64| {
            left -= guess;
            left < 0.0
        };
        let last = self.guesses.len() - 1;
        self.guesses.iter().position(passes).unwrap_or(last)
    }

    /// Returns the probability with which [`LeafWeights::choose`] returns `place`.
    fn probability(&self, place: usize) -> f64 {
        if self.total > 0.0 {
            self.guesses[place] / self.total
        } else {
            f64::from(u8::from(place == self.guesses.len() - 1))
        }
    }
}

impl<'a> EmitterChoice<'a> {
    pub(super) fn new(group: &'a Group, emitters: &'a [Emitter], receiver: &'a Receiver) -> Self {
        EmitterChoice {
            group,
            emitters,
            receiver,
            last: RefCell::new(None),
        }
    }

    /// Returns the emitter that a uniform number chooses, and the probability of the choice.
    pub(crate) fn choose(&self, u: f64) -> (usize, f64) {
        let members = &self.group.members;
        if let [only] = &members[..] {
            return (only.emitter, 1.0);
        }
        let member = if u < UNIFORM_FRACTION {
            (u / UNIFORM_FRACTION * members.len() as f64) as usize
        } else {
            self.descend((u - UNIFORM_FRACTION) / (1.0 - UNIFORM_FRACTION))
        };
        let member = member.min(members.len() - 1);
        (members[member].emitter, self.probability(member))
    }

    /// Returns the probability with which [`EmitterChoice::choose`] chooses a member.
    pub(super) fn probability(&self, member: usize) -> f64 {
        match self.group.members.len() {
            1 => 1.0,
            n => UNIFORM_FRACTION / n as f64 + (1.0 - UNIFORM_FRACTION) * self.of_descent(member),
        }
    }

    fn guess(&self, member: usize) -> f64 {
        let member = &self.group.members[member];
        let emitter = &self.emitters[member.emitter];
        member.bounds.guess(emitter, self.receiver)
    }

    fn weights(&self, members: &Range<usize>) -> LeafWeights {
        let guesses: SmallVec<_> = members.clone().map(|m| self.guess(m)).collect();
        let total = guesses.iter().sum();
        LeafWeights { guesses, total }
    }

    /// Returns a result from the weights of a leaf with these members. The weights of the last leaf
    /// are stored.
    fn with_leaf<T>(
        &self,
        leaf: usize,
        members: &Range<usize>,
        result: impl FnOnce(&LeafWeights) -> T,
    ) -> T {
        let mut last = self.last.borrow_mut();
        let stored = last.take().filter(|(of, _)| *of == leaf);
        let (_, weights) = last.insert(stored.unwrap_or_else(|| (leaf, self.weights(members))));
        result(weights)
    }

    fn weight(&self, number: usize) -> f64 {
        let node = &self.group.nodes[number];
        match (node.ball, &node.content) {
            (Some((center, radius)), _) => node.strength * self.receiver.near(center, radius),
            (None, Content::Leaf(range)) => self.with_leaf(number, range, |w| w.total),
            (None, Content::Inner(_)) => 0.0,
        }
    }

    /// Returns the probability of choosing the first of two nodes.
    fn first(&self, children: &[usize; 2]) -> f64 {
        let [a, b] = children.map(|c| self.weight(c));
        if a + b > 0.0 { a / (a + b) } else { 0.5 }
    }

    /// Chooses a member by estimates.
    fn descend(&self, mut u: f64) -> usize {
        let mut at = 0;
        loop {
            match &self.group.nodes[at].content {
                Content::Inner(children) => {
                    let p = self.first(children);
                    let second = u >= p;
                    u = if second { (u - p) / (1.0 - p) } else { u / p };
                    at = children[usize::from(second)];
                }
                Content::Leaf(range) => {
                    return range.start + self.with_leaf(at, range, |w| w.choose(u));
                }
            }
        }
    }

    /// Returns the probability with which [`EmitterChoice::descend`] chooses a member.
    fn of_descent(&self, member: usize) -> f64 {
        let nodes = &self.group.nodes;
        let mut at = self.group.members[member].leaf;
        let mut p = match &nodes[at].content {
            Content::Leaf(range) => {
                self.with_leaf(at, range, |w| w.probability(member - range.start))
            }
            Content::Inner(_) => 0.0,
        };
        while at != 0 {
            let parent = nodes[at].parent;
            if let Content::Inner(children) = &nodes[parent].content {
                let first = self.first(children);
                p *= if at == children[0] {
                    first
                } else {
                    1.0 - first
                };
            }
            at = parent;
        }
        p
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spectrum;
    use crate::emitter::Surroundings;
    use crate::phase::Phase;

    /// Makes 60 points in a row and a sun, for a tree and a leaf of distant emitters.
    fn emitters() -> Vec<Emitter> {
        let point = |i: usize| Emitter::Point {
            position: DVec3::new(i as f64 * 0.3 - 9.0, 2.0, 0.1),
            intensity: Spectrum::splat(1.0 + (7 * i % 5) as f64),
        };
        let sun = Emitter::Directional {
            direction: -DVec3::Y,
            irradiance: Spectrum::ONE,
        };
        (0..60).map(point).chain([sun]).collect()
    }

    fn group(emitters: &[Emitter]) -> Group {
        let around = Surroundings {
            center: DVec3::ZERO,
            radius: 10.0,
        };
        let bounded = |(i, e)| (i, LightBounds::new(e, &around, &[]));
        Group::new(emitters.iter().enumerate().map(bounded).collect())
    }

    /// Evenly spread numbers choose every emitter with its probability, and probabilities sum to
    /// one. Choices are intervals of numbers, and a tree cuts each interval into about two; the
    /// round-off is 1e-3.
    #[test]
    fn choices_have_their_probabilities() {
        let (emitters, phase) = (emitters(), Phase::henyey_greenstein(0.8).unwrap());
        let group = group(&emitters);
        let x = DVec3::new(1.0, 0.0, 0.0);
        let volume = Receiver::Volume {
            x,
            direction: DVec3::Y,
            phase: &phase,
        };
        let surface = |normal, opaque| Receiver::Surface { x, normal, opaque };
        let (from, to) = (DVec3::new(-3.0, 0.0, 0.0), DVec3::new(3.0, 1.9, 0.2));
        let receivers = [
            volume,
            surface(DVec3::X, true),
            surface(-DVec3::Y, true),
            surface(-DVec3::Y, false),
            Receiver::Segment { from, to },
            Receiver::Segment { from, to: from },
        ];
        for receiver in &receivers {
            let choice = EmitterChoice::new(&group, &emitters, receiver);
            let mut counts = vec![0.0; emitters.len()];
            let n = 100_000;
            for i in 0..n {
                let (emitter, probability) = choice.choose((i as f64 + 0.5) / n as f64);
                assert!(probability > 0.0);
                counts[emitter] += 1.0 / n as f64;
            }
            let mut sum = 0.0;
            for (place, member) in group.members.iter().enumerate() {
                let probability = choice.probability(place);
                sum += probability;
                let count = counts[member.emitter];
                let error = (count - probability).abs();
                assert!(error < 1e-3, "{receiver:?}: {count} {probability}");
            }
            assert!((sum - 1.0).abs() < 1e-12, "{receiver:?}: {sum}");
        }
    }

    /// Near and bright emitters, and emitters in front of the surface, are chosen more often.
    #[test]
    fn guesses_know_distances_and_cosines() {
        let emitters = emitters();
        let group = group(&emitters);
        let receiver = Receiver::Surface {
            x: DVec3::new(0.0, 1.0, 0.0),
            normal: DVec3::X,
            opaque: true,
        };
        let choice = EmitterChoice::new(&group, &emitters, &receiver);
        let of = |emitter| {
            let place = group.members.iter().position(|m| m.emitter == emitter);
            choice.probability(place.unwrap())
        };
        // Emitter 10 is behind, 31 is at the left edge of the front side, and 59 is far away.
        assert!(of(10) < 0.01 && of(59) < 0.01, "{} {}", of(10), of(59));
        assert!((31..37).map(of).sum::<f64>() > 0.4);
    }
}
