//! Connections along all branches (docs/theory.md#branches), and the probability that connections
//! discover a branch.

use super::arcs::ConnectionArcs;
use super::ray::{Connection, same_length, same_way};
use super::search::Search;
use super::straight;
use super::target::ConnectionTarget;
use crate::path::segment::{EdgeGeometry, Vertex};
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::Scene;
use eikonal::connect::Piece;
use glam::DVec3;
use smallvec::SmallVec;
use std::ops::ControlFlow;

/// Values of connections, each with a weight; rarely more than one.
pub(crate) type Weighted<T> = SmallVec<[(T, f64); 1]>;

/// A branch between two vertices that a random walk found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FoundBranch<'g> {
    /// Geometry of the branch.
    pub geometry: &'g EdgeGeometry,
    /// Unit direction in which the branch leaves the vertex that connections are made from.
    pub direction: DVec3,
    /// Optical length of the branch. It separates branches that leave a plane in the same
    /// direction.
    pub optical_length: Option<f64>,
}

impl Connection {
    /// Connects a vertex to a target along all branches (docs/theory.md#branches) and evaluates
    /// each branch with `evaluate`. Returns the values, each with a weight.
    ///
    /// Sums of value times weight are unbiased. Rays found from deterministic starts have weight 1.
    /// Other rays have the reciprocal of the probability of finding them as their weight. Blocked
    /// rays, and rays for which `evaluate` returns `None`, are left out. Every attempt and its
    /// outcome is counted.
    pub fn each<T>(
        scene: &Scene,
        vertex: &Vertex,
        target: &ConnectionTarget,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        evaluate: impl Fn(&Connection) -> Option<T>,
    ) -> Weighted<T> {
        let evaluate = |connection: &Connection, _: ConnectionArcs| evaluate(connection);
        Connection::each_with_arcs(scene, vertex, target, sampler, ws, evaluate)
    }

    /// Does the work of [`Connection::each`]; `evaluate` also receives the arcs of the connection.
    pub(crate) fn each_with_arcs<T>(
        scene: &Scene,
        vertex: &Vertex,
        target: &ConnectionTarget,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        mut evaluate: impl FnMut(&Connection, ConnectionArcs) -> Option<T>,
    ) -> Weighted<T> {
        // Without ray bending there is at most one branch, in closed form.
        if scene.is_straight() {
            ws.stats.connections.certified += 1;
            let connection = straight::connect(scene, vertex, target, ws);
            let arcs = ConnectionArcs::Line(&ws.line);
            let value = connection.and_then(|connection| evaluate(&connection, arcs));
            return value.map(|value| (value, 1.0)).into_iter().collect();
        }
        let tolerance = ws.tolerance();
        // Connect from the deterministic starts, with weight 1.
        let search = Search::new(scene, vertex, target);
        let mut values = SmallVec::new();
        let mut known: SmallVec<[Connection; 2]> = SmallVec::new();
        let _ = search.certain(&mut |candidate| {
            let Some(connection) = search.attempt(&candidate, ws) else {
                return ControlFlow::Continue(());
            };
            // Skip a branch that an earlier start found.
            if known.iter().any(|k| k.is_branch_of(tolerance, &connection)) {
                return ControlFlow::Continue(());
            }
            let place = known.len();
            known.push(connection);
            let connection = &mut known[place];
            let pieces = ws.solver.pieces().iter().map(Piece::ends);
            if connection.passes(scene, vertex, target, pieces, &mut ws.stats) {
                let arcs = ConnectionArcs::Ray(ws.solver.pieces());
                values.extend(evaluate(connection, arcs).map(|value| (value, 1.0)));
            }
            ControlFlow::Continue(())
        });
        // Search for further branches with probability q: one random start, weight N/q,
        // eq. (sum over branches).
        if search.has_all(!known.is_empty()) {
            ws.stats.connections.certified += 1;
        // Planted error "further branches dropped: the estimators disagree", found by morgana-transport/transport::agreement::branches::estimators_agree_on_all_branches:
        // } else if sampler.next_1d() < 0.0 {
        // Planted error "further branches dropped", found by morgana-transport/transport::branches::branches_are_summed:
        // } else if sampler.next_1d() < 0.0 {
        } else if sampler.next_1d() < ws.search {
            let other = |connection: &Connection| {
                !known.iter().any(|k| k.is_branch_of(tolerance, connection))
            };
            let found = search.at_random(sampler, ws, other, evaluate);
            // Planted error "probability of the search not divided out", found by morgana-transport/transport::branches::branches_are_summed:
            // values.extend(found.map(|(value, weight)| (value, weight)));
            values.extend(found.map(|(value, weight)| (value, weight / ws.search)));
        }
        // Planted error "branches averaged instead of summed" (2 lines), found by morgana-transport/transport::branches::branches_are_summed:
        // let values: Weighted<T> = values;
        // let share = 1.0 / values.len().max(1) as f64;
        // values.into_iter().map(|(v, w)| (v, w * share)).collect()
        // }
        values
    }

    /// Returns the probability that connections from a vertex to a target discover a branch that a
    /// random walk found (docs/theory.md#connection-and-chance).
    pub(crate) fn discovery(
        scene: &Scene,
        vertex: &Vertex,
        target: &ConnectionTarget,
        branch: &FoundBranch,
        ws: &mut Workspace,
    ) -> f64 {
        if scene.is_straight() {
            return 1.0;
        }
        let search = Search::new(scene, vertex, target);
        if search.has_all(true) {
            return 1.0;
        }
        let tolerance = ws.tolerance();
        let same = |connection: Connection| {
            let length = branch.optical_length;
            same_way(tolerance, connection.direction, branch.direction)
                && length.is_none_or(|s| same_length(tolerance, s, connection.optical_length))
        };
        let found = search.certain(&mut |candidate| {
            if search.solve(&candidate, ws).is_some_and(same) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        match found {
            ControlFlow::Break(()) => 1.0,
            ControlFlow::Continue(()) => ws.random_discovery(branch.geometry),
        }
    }
}
