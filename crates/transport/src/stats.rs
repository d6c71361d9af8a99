//! Counts of events during a render; independent of the machine and of threads.

use eikonal::{Failure, Work};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Counts of events during one render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stats {
    /// Number of sensor subpaths.
    pub paths: u64,
    /// Number of edges that were sampled from one end.
    pub edges: u64,
    /// Number of those edges that were flights between collisions in volumes of voxels or tetrahedra,
    /// followed by the walk through cells.
    pub in_cells: u64,
    /// Steps and evaluations of rays, including connections.
    pub work: Work,
    /// Counts of connections.
    pub connections: ConnectionCounts,
    /// Counts of stored photons.
    pub photons: Photons,
    /// Number of edges that left their medium's field or circled for too long; they score zero.
    pub lost: u64,
    /// Counts of computations that exceeded their budget.
    pub over_budget: OverBudget,
    /// Number of samples that were not finite, or too bright for the single precision of images;
    /// they score zero.
    pub not_finite: u64,
}

/// Counts of computations that were abandoned because they took more work than their
/// [budget](crate::budget). Their light is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OverBudget {
    /// Number of edges and particles; also counted in [`Stats::lost`].
    pub rays: u64,
    /// Number of connections.
    pub connections: u64,
    /// Number of edges with too many photons along them.
    pub gathers: u64,
}

/// Numbers of photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Photons {
    /// Number of photons at collisions in media.
    pub in_media: u64,
    /// Number of photons on surfaces.
    pub on_surfaces: u64,
}

/// Counts of connections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConnectionCounts {
    /// Number of connection ends that were candidates; one of several candidates is connected.
    pub candidates: u64,
    /// Number of pairs of ends that were tried.
    pub attempts: u64,
    /// Number of connecting rays that were found.
    pub found: u64,
    /// Number of connecting rays that an opaque or rough surface blocks.
    pub occluded: u64,
    /// Number of connecting rays without contribution, because they arrive on the wrong side of a
    /// surface or through the wrong medium.
    pub discarded: u64,
    /// Number of iterations that did not converge.
    pub not_converged: u64,
    /// Number of attempts in which a trial ray left the field.
    pub ray_lost: u64,
    /// Number of attempts whose target lay on a caustic or coincided with the start.
    pub degenerate: u64,
    /// Number of pairs that are known to be connected by at most one ray.
    pub certified: u64,
    /// Number of searches for further branches from a random start.
    pub searches: u64,
    /// Number of searches from a random start that found a branch.
    pub secondary: u64,
    /// Number of random starts that estimate the weights of branches.
    pub trials: u64,
    /// Number of branches whose weight estimate was cut off; their contribution is too small.
    pub capped: u64,
}

impl Stats {
    /// Returns the estimated cost in units that do not depend on a clock, for choices between
    /// estimators. An evaluation of a field costs 1, about 60 ns.
    pub fn cost(&self) -> f64 {
        let work = &self.work;
        let counts = [
            (10.0, self.edges),
            (2.0, self.connections.candidates),
            (3.0, self.connections.attempts),
            (16.0, work.shots),
            (6.0, work.steps),
            (1.0, work.evaluations),
        ];
        counts
            .iter()
            .map(|(cost, count)| cost * *count as f64)
            .sum()
    }

    /// Counts the outcome of a connection.
    pub fn count<T>(&mut self, outcome: &Result<T, Failure>) {
        let connections = &mut self.connections;
        connections.attempts += 1;
        match outcome {
            Ok(_) => connections.found += 1,
            Err(Failure::NotConverged) => connections.not_converged += 1,
            Err(Failure::RayLost) => connections.ray_lost += 1,
            Err(Failure::OverBudget) => self.over_budget.connections += 1,
            Err(Failure::Caustic | Failure::Coincident | Failure::TooFar) => {
                connections.degenerate += 1
            }
        }
    }
}

impl ConnectionCounts {
    /// Returns the fraction of the attempts that found no ray; 0 if there were none.
    pub fn failure_rate(&self) -> f64 {
        match self.attempts {
            0 => 0.0,
            n => 1.0 - self.found as f64 / n as f64,
        }
    }
}

impl AddAssign for ConnectionCounts {
    fn add_assign(&mut self, o: Self) {
        self.candidates += o.candidates;
        self.attempts += o.attempts;
        self.found += o.found;
        self.occluded += o.occluded;
        self.discarded += o.discarded;
        self.not_converged += o.not_converged;
        self.ray_lost += o.ray_lost;
        self.degenerate += o.degenerate;
        self.certified += o.certified;
        self.searches += o.searches;
        self.secondary += o.secondary;
        self.trials += o.trials;
        self.capped += o.capped;
    }
}

impl AddAssign for OverBudget {
    fn add_assign(&mut self, o: Self) {
        self.rays += o.rays;
        self.connections += o.connections;
        self.gathers += o.gathers;
    }
}

impl AddAssign for Stats {
    fn add_assign(&mut self, o: Self) {
        self.paths += o.paths;
        self.edges += o.edges;
        self.in_cells += o.in_cells;
        self.work += o.work;
        self.connections += o.connections;
        self.photons.in_media += o.photons.in_media;
        self.photons.on_surfaces += o.photons.on_surfaces;
        self.lost += o.lost;
        self.over_budget += o.over_budget;
        self.not_finite += o.not_finite;
    }
}
