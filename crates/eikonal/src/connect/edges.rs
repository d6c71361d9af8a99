//! Directions close to those in which rays just touch an interface, or just are reflected totally.

use super::family::RayFamily;
use super::solver::Solver;
use super::start::Reach;
use super::world::World;
use crate::interface::Rule;
use glam::DVec3;

/// Neighbours of a direction between which and it edges are looked for.
const NEIGHBOURS: usize = 6;
/// Each halves the interval in which an edge lies; then it is known to some 1e-9.
const HALVINGS: usize = 26;
/// Starts on either side of an edge, each closer to it by this factor: Newton's method finds a ray that
/// grazes an interface from starts at up to four times its own distance from the edge.
const CLOSER: f64 = 1.0 / 3.0;
/// The closest are at 1e-6 of the distance between directions.
const SIDES: i32 = 13;

/// Events in the last part of the reach may be beyond it for a ray close by.
const SURE: f64 = 0.8;
/// Where rays are scattered by so many surfaces that there are edges everywhere, a part of them does.
const MOST_EDGES: usize = 400;

/// What a ray meets: how far along it, which surface, and what it does there.
type History = Vec<(f64, usize, Rule)>;

/// Whether the rays do the same, as far as can be seen.
fn same(a: &History, b: &History, reach: &Reach) -> bool {
    let (short, long) = if a.len() < b.len() { (a, b) } else { (b, a) };
    let (common, more) = long.split_at(short.len());
    let alike = |(a, b): (&(f64, usize, Rule), &(f64, usize, Rule))| (a.1, a.2) == (b.1, b.2);
    short.iter().zip(common).all(alike) && more.iter().all(|e| e.0 > SURE * reach.optical_length)
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Directions that crowd against the edges between rays from `x` in `region` that meet different interfaces,
    /// or go on from them differently. At such an edge rays bend infinitely fast with their direction,
    /// so that an even grid finds few of the branches close to it.
    pub(super) fn edges<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        directions: &[DVec3],
        reach: &Reach,
    ) -> Vec<DVec3> {
        let mut history = |direction| self.history(world, x, region, direction, reach);
        let known: Vec<History> = directions.iter().map(|&d| history(d)).collect();
        let mut close = Vec::new();
        if known.windows(2).all(|pair| same(&pair[0], &pair[1], reach)) {
            return close;
        }
        let mut pairs = neighbours(directions);
        pairs.retain(|&(i, j)| !same(&known[i], &known[j], reach));
        for &(i, j) in pairs.iter().step_by(1 + pairs.len() / MOST_EDGES) {
            let (mut inner, mut outer) = (directions[i], directions[j]);
            for _ in 0..HALVINGS {
                let middle = (inner + outer).normalize();
                if same(&history(middle), &known[i], reach) {
                    inner = middle;
                } else {
                    outer = middle;
                }
            }
            for (edge, end) in [(inner, directions[i]), (outer, directions[j])] {
                let toward = |k| (edge + (end - edge) * CLOSER.powi(k)).normalize();
                close.extend((1..=SIDES).map(toward));
            }
        }
        close
    }

    fn history<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        direction: DVec3,
        reach: &Reach,
    ) -> History {
        let mut history = History::new();
        let family = RayFamily::Point { x, direction };
        // A ray that is lost counts as far as it went.
        let _ = self.follow(world, family, region, reach, &mut |_| false, |leg| {
            history.extend(leg.piece.event.map(|e| (leg.before, e.surface, e.rule)));
        });
        history
    }
}

/// Pairs of directions that are close to each other.
fn neighbours(directions: &[DVec3]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for (i, d) in directions.iter().enumerate() {
        let mut order: Vec<usize> = (0..directions.len()).filter(|&j| j != i).collect();
        let cosine = |j: &usize| -directions[*j].dot(*d);
        let nth = NEIGHBOURS.min(order.len().saturating_sub(1));
        order.select_nth_unstable_by(nth, |a, b| cosine(a).total_cmp(&cosine(b)));
        pairs.extend(
            order
                .into_iter()
                .take(nth)
                .filter(|&j| i < j)
                .map(|j| (i, j)),
        );
    }
    pairs
}
