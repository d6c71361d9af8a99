//! What happened during a render: counts that do not depend on the machine or on threads.

use eikonal::{Failure, Work};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Counts of one render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stats {
    /// Sensor subpaths.
    pub paths: u64,
    /// Edges that were sampled from one end.
    pub edges: u64,
    /// Of these, flights between collisions in volumes of voxels, which the walk through voxels has followed.
    pub in_voxels: u64,
    /// Steps and evaluations of rays, those of connections included.
    pub work: Work,
    /// Connections.
    pub connections: ConnectionCounts,
    /// Photons that were stored.
    pub photons: Photons,
    /// Edges that left their medium's field or circled for too long: counted, and scored zero.
    pub lost: u64,
    /// What was given up because it took too much work.
    pub over_budget: OverBudget,
    /// Samples that were not finite, or too bright for the single precision of images: counted, and scored zero.
    pub not_finite: u64,
}

/// Counts of what was given up because it took more work than it [may](crate::budget): the light is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OverBudget {
    /// Edges, and particles; counted in [`Stats::lost`].
    pub rays: u64,
    /// Connections.
    pub connections: u64,
    /// Edges along which there were too many photons.
    pub gathers: u64,
}

/// Counts of photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Photons {
    /// Those that media scatter.
    pub in_media: u64,
    /// Those on surfaces.
    pub on_surfaces: u64,
}

/// Counts of connections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConnectionCounts {
    /// Ends at emitters that were weighed against one another, of which one was connected to.
    pub candidates: u64,
    /// Pairs that were tried.
    pub attempts: u64,
    /// Rays found.
    pub found: u64,
    /// Rays found that an opaque or rough surface blocks; counted in `found`.
    pub occluded: u64,
    /// Rays found that arrive on the wrong side of a surface or through the wrong medium, and count
    /// for nothing; counted in `found`.
    pub discarded: u64,
    /// The iteration did not converge.
    pub not_converged: u64,
    /// A shot left the field.
    pub ray_lost: u64,
    /// The target lay on a caustic, or coincided with the start.
    pub degenerate: u64,
    /// Pairs that are known to be connected by one ray at most.
    pub certified: u64,
    /// Searches for further branches from a random start.
    pub searches: u64,
    /// Searches that found one.
    pub secondary: u64,
    /// Random starts that were spent on weighing these branches.
    pub trials: u64,
    /// Branches whose weighing was cut off: each counts for less than it should.
    pub capped: u64,
}

impl Stats {
    /// About how long all this takes, in units that depend on no clock, for choices between estimators: an
    /// evaluation of a field counts 1, some 60 ns.
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
    /// Share of the attempts for which no ray was found; 0 if there were none.
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
        self.in_voxels += o.in_voxels;
        self.work += o.work;
        self.connections += o.connections;
        self.photons.in_media += o.photons.in_media;
        self.photons.on_surfaces += o.photons.on_surfaces;
        self.lost += o.lost;
        self.over_budget += o.over_budget;
        self.not_finite += o.not_finite;
    }
}
