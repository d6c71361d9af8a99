//! Directions close to the directions of rays that graze an interface, or are at the critical angle
//! of total reflection.

use super::family::RayFamily;
use super::solver::Solver;
use super::start::Reach;
use super::world::World;
use crate::interface::Rule;
use glam::DVec3;

/// Number of neighbours of each direction; edges are searched between a direction and its
/// neighbours.
const NEIGHBOURS: usize = 6;
/// Number of halvings of the interval that contains an edge; they locate the edge to about 1e-9.
const HALVINGS: usize = 26;
/// Ratio of the distances from an edge of consecutive initial guesses on either side of it.
/// Newton's method finds a grazing ray from guesses at up to four times the ray's own distance from
/// the edge.
const GUESS_DISTANCE_RATIO: f64 = 1.0 / 3.0;
/// Number of guesses on each side of an edge; the closest are at 1e-6 of the distance between
/// directions.
const GUESSES_PER_SIDE: i32 = 13;

/// Fraction of the reach in which the events of two rays must agree. Events in the last part may
/// lie beyond the reach of a neighbouring ray.
const COMPARED_FRACTION: f64 = 0.8;
/// Maximum number of edges that are refined. Where many surfaces scatter rays, almost all
/// directions are close to edges, and a part of the edges suffices.
const MAX_EDGES: usize = 400;

/// Interfaces that a ray meets. Each entry holds the optical length up to the interface, its
/// surface, and the event there.
type History = Vec<(f64, usize, Rule)>;

/// Returns true if two rays have the same events, except near the end of their reach.
fn same(a: &History, b: &History, reach: &Reach) -> bool {
    let (short, long) = if a.len() < b.len() { (a, b) } else { (b, a) };
    let (common, more) = long.split_at(short.len());
    let alike = |(a, b): (&(f64, usize, Rule), &(f64, usize, Rule))| (a.1, a.2) == (b.1, b.2);
    short.iter().zip(common).all(alike)
        && more
            .iter()
            .all(|e| e.0 > COMPARED_FRACTION * reach.optical_length)
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Returns directions that accumulate at the edges between rays from `x` in `region` that meet
    /// different interfaces, or leave them differently. At an edge, the derivative of a ray with
    /// respect to its direction is infinite. An even grid of directions therefore finds few of the
    /// branches close to an edge.
    pub(super) fn edges<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        directions: &[DVec3],
        reach: &Reach,
    ) -> Vec<DVec3> {
        // Trace a ray in each direction, and record its events.
        let mut history = |direction| self.history(world, x, region, direction, reach);
        let known: Vec<History> = directions.iter().map(|&d| history(d)).collect();
        let mut close = Vec::new();
        if known.windows(2).all(|pair| same(&pair[0], &pair[1], reach)) {
            return close;
        }
        // Find neighbouring directions with different events.
        let mut pairs = neighbours(directions);
        pairs.retain(|&(i, j)| !same(&known[i], &known[j], reach));
        for &(i, j) in pairs.iter().step_by(1 + pairs.len() / MAX_EDGES) {
            // Bisect to the edge, and place directions on either side of it.
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
                let toward = |k| (edge + (end - edge) * GUESS_DISTANCE_RATIO.powi(k)).normalize();
                close.extend((1..=GUESSES_PER_SIDE).map(toward));
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
        // Keep the events of a lost ray up to its end.
        let _ = self.follow(world, family, region, reach, &mut |_| false, |segment| {
            history.extend(
                segment
                    .piece
                    .event
                    .map(|e| (segment.before, e.surface, e.rule)),
            );
        });
        history
    }
}

/// Returns pairs of directions that are close to each other.
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
