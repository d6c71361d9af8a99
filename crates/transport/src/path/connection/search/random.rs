//! Connections from random starts, and their weights.

use super::{Candidate, Search};
use crate::budget::{STEPS_PER_SEARCH, TRIALS_PER_SEARCH};
use crate::connection_end::ConnectionEnd;
use crate::path::connection::arcs::ConnectionArcs;
use crate::path::connection::ray::Connection;
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use eikonal::connect::{Piece, RayFamily, random_direction, random_foot};
use glam::DVec3;

impl Search<'_> {
    /// Draws a random start: a ray, and the distance along it to one of its close approaches to the
    /// end point.
    fn random(&self, sampler: &mut Sampler, ws: &mut Workspace) -> Option<Candidate> {
        let u = [sampler.next_1d(), sampler.next_1d(), sampler.next_1d()];
        let scene = self.scene;
        let reach = scene.branch_reach();
        let mut uniform = || sampler.next_1d();
        let x = self.vertex.position();
        match self.target.end {
            ConnectionEnd::Point { position, .. } => {
                let direction = random_direction(position - x, u);
                let place = self.vertex.start(scene, direction);
                let family = RayFamily::Point {
                    x: place.x,
                    direction,
                };
                let (start, arrival) = ws.solver.approach(
                    scene,
                    family,
                    place.medium,
                    position,
                    reach,
                    &mut uniform,
                )?;
                let (end_point, facing) = self.end_point(position, arrival);
                Some(Candidate::new(start, place, end_point, facing))
            }
            ConnectionEnd::Plane {
                through, direction, ..
            } => {
                let on_plane = |p: DVec3| p - direction * (p - through).dot(direction);
                let (center, radius) = self.target.disc;
                let foot = random_foot(on_plane(x), direction, center, radius, u);
                let family = RayFamily::Plane { x: foot, direction };
                let (start, arrival) = ws.solver.approach(
                    scene,
                    family,
                    scene.medium_at(foot),
                    x,
                    reach,
                    &mut uniform,
                )?;
                Some(self.arriving(start, arrival))
            }
        }
    }

    /// Finds a branch from a random start, other than the known branches. Returns the branch's
    /// value and an unbiased estimate of the reciprocal of the probability of finding the branch.
    /// The estimate is the number of further random starts until the branch is found again (Booth
    /// 2007; Zeltner et al. 2020; docs/theory.md#branches).
    pub(crate) fn at_random<T>(
        &self,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        other: impl Fn(&Connection) -> bool,
        mut evaluate: impl FnMut(&Connection, ConnectionArcs) -> Option<T>,
    ) -> Option<(T, f64)> {
        ws.stats.connections.searches += 1;
        let connection = self.try_random(sampler, ws).filter(other)?;
        let connection = Connection {
            discovery: if self.has_all(true) {
                1.0
            } else {
                ws.random_discovery(&connection.geometry)
            },
            ..connection
        };
        ws.stats.connections.secondary += 1;
        let pieces = ws.solver.pieces().iter().map(Piece::ends);
        let (vertex, target) = (self.vertex, self.target);
        let mut clear = connection;
        if !clear.passes(self.scene, vertex, target, pieces, &mut ws.stats) {
            return None;
        }
        let value = evaluate(&clear, ConnectionArcs::Ray(ws.solver.pieces()))?;
        let (before, mut trials) = (ws.solver.work.steps, 0);
        // Estimate 1/P by repeated random starts. Beyond the budget the weight is too small; this
        // is counted.
        while trials < TRIALS_PER_SEARCH && ws.solver.work.steps - before < STEPS_PER_SEARCH {
            trials += 1;
            ws.stats.connections.trials += 1;
            let again = self.try_random(sampler, ws);
            if again.is_some_and(|l| l.is_branch_of(ws.tolerance(), &connection)) {
                // Planted error "reciprocal probability of a branch replaced by one", found by morgana-transport/transport::branches::branches_are_summed:
                // return Some((value, f64::from(trials.min(1))));
                return Some((value, f64::from(trials)));
            }
        }
        ws.stats.connections.capped += 1;
        Some((value, f64::from(trials)))
    }

    fn try_random(&self, sampler: &mut Sampler, ws: &mut Workspace) -> Option<Connection> {
        if ws.stop.is_raised() {
            return None;
        }
        let candidate = self.random(sampler, ws)?;
        self.solve(&candidate, ws)
    }
}
