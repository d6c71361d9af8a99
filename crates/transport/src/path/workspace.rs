//! Storage and counts of one thread, and what its paths have been told.

use super::energy_balance::ParticleBalance;
use super::learnt::{
    AdjointEstimate, AdjointTraining, NeeRates, NeeTraining, StrategyRates, StrategyWork,
};
use super::segment::EdgeGeometry;
use crate::scene::MediumId;
use crate::stats::Stats;
use crate::stop::Stop;
use eikonal::ray::Arc;
use eikonal::{Solver, Tolerance};
use serde::{Deserialize, Serialize};

/// Probability with which connections that may not be unique are searched for further branches,
/// unless it is chosen otherwise.
const SEARCH: f64 = 0.25;
/// How often a random start leads to a branch, at a guess for multiple importance sampling, and by
/// what factor each reflection makes that rarer.
const DISCOVERY: f64 = 0.05;
const DISCOVERY_REFLECTED: f64 = 0.02;

/// An arc of a ray within one medium.
#[derive(Clone, Copy, Debug)]
pub struct RayPart {
    /// The curve, of which only θ ≤ `theta_end` belongs to the ray.
    pub arc: Arc,
    /// See `arc`.
    pub theta_end: f64,
    /// The medium.
    pub medium: MediumId,
}

/// Storage and counts of one thread.
#[derive(Debug)]
pub struct Workspace {
    /// Finds connections.
    pub solver: Solver<MediumId>,
    /// What has happened so far.
    pub stats: Stats,
    /// What has become of the particles followed since it was last taken.
    pub particle_balance: ParticleBalance,
    /// Probability in (0, 1] with which a connection that may not be unique is searched for further
    /// branches. Any value is unbiased.
    pub search: f64,
    /// Probabilities with which vertices are connected to emitters. Any values are unbiased.
    pub rates: NeeRates,
    /// What a pilot finds out about them.
    pub nee_training: Option<Box<NeeTraining>>,
    /// Probabilities with which strategies of bidirectional estimators are used. Any values are unbiased.
    pub strategies: StrategyRates,
    /// Work for these strategies so far.
    pub strategy_work: StrategyWork,
    /// What paths may still bring. Any values are unbiased.
    pub adjoint: AdjointEstimate,
    /// How paths begin.
    pub first_vertex: FirstVertexTechniques,
    /// What happened where the last sample whose path was split was split.
    pub split: Option<SplitSample>,
    /// What a pilot finds out about adjoint estimates.
    pub adjoint_training: Option<Box<AdjointTraining>>,
    /// Whether all work is to be given up, so that nothing is found any more.
    pub stop: Stop,
    /// Parts of the straight connection last made.
    pub(in crate::path) line: Vec<RayPart>,
    /// Parts of the edge last sampled up to its end, if [they were to be kept](super::Sampling::parts).
    pub edge_parts: Vec<RayPart>,
}

/// What is done on the first edges of paths from the sensor to have less left to chance.
/// See docs/theory.md#first-vertex-techniques.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FirstVertexTechniques {
    /// Number of first edges that collide for certain where they would leave the scene. Any number is unbiased in a
    /// scene that is [dark](crate::Scene::is_dark) around.
    pub forced_collisions: u32,
    /// Whether paths are split where their first edge meets a smooth dielectric: one is refracted, one reflected. Unbiased either way.
    pub splitting: bool,
}

/// A sample whose path was split.
#[derive(Clone, Copy, Debug)]
pub struct SplitSample {
    /// Number of contributions that came before those of the reflected path.
    pub before: usize,
    /// Probability with which a path that is not split is reflected there.
    pub reflectance: f64,
    /// Work of the workspace up to the reflected path.
    pub cost: f64,
}

impl Workspace {
    /// A fresh workspace for rays of a given tolerance.
    pub fn new(tolerance: Tolerance) -> Self {
        Workspace {
            solver: Solver::new(tolerance),
            stats: Stats::default(),
            particle_balance: ParticleBalance::default(),
            search: SEARCH,
            rates: NeeRates::default(),
            nee_training: None,
            strategies: StrategyRates::default(),
            strategy_work: StrategyWork::default(),
            adjoint: AdjointEstimate::default(),
            first_vertex: FirstVertexTechniques::default(),
            split: None,
            adjoint_training: None,
            stop: Stop::default(),
            line: Vec::new(),
            edge_parts: Vec::new(),
        }
    }

    /// How accurate rays are.
    pub fn tolerance(&self) -> Tolerance {
        self.solver.tolerance()
    }

    /// The counts, with the solver's work in them.
    pub fn stats(&self) -> Stats {
        let mut stats = self.stats;
        stats.work += self.solver.work;
        stats
    }

    /// What a branch that must be found at random counts for in the combination of estimators, where
    /// one that is found for certain counts 1. A find with probability P is worth N/q with a variance
    /// of about 2/(qP), as if qP/2 samples had been taken; P itself is not known, and any guess of it
    /// is unbiased that depends on the branch alone.
    pub(in crate::path) fn random_discovery(&self, geometry: &EdgeGeometry) -> f64 {
        self.search * DISCOVERY * DISCOVERY_REFLECTED.powi(geometry.reflections.min(64) as i32)
    }
}
