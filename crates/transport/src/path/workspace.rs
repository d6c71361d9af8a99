//! Storage, counts and learnt estimates of one thread.

use super::energy_balance::ParticleBalance;
use super::learnt::{
    AdjointEstimate, AdjointTraining, NeeRates, NeeTraining, StrategyRates, StrategyWork,
};
use super::segment::EdgeGeometry;
use crate::scene::MediumId;
use crate::stats::Stats;
use crate::stop::Stop;
use eikonal::ray::{Arc, ShortRay};
use eikonal::{Solver, Tolerance};
use serde::{Deserialize, Serialize};

/// Default probability of searching a connection that may not be unique for further branches.
const SEARCH_PROBABILITY: f64 = 0.25;
/// Assumed probability that a random start leads to a branch, for MIS weights, and the factor by
/// which each reflection reduces it.
const DISCOVERY_PROBABILITY: f64 = 0.05;
const DISCOVERY_PER_REFLECTION: f64 = 0.02;

/// An arc of a ray within one medium.
#[derive(Clone, Copy, Debug)]
pub struct RayPart {
    /// Curve of the arc. Only the part θ ≤ `theta_end` belongs to the ray.
    pub arc: Arc,
    /// Value of θ at which the ray ends on `arc`.
    pub theta_end: f64,
    /// Medium of the arc.
    pub medium: MediumId,
}

/// Storage, counts and learnt estimates of one thread.
#[derive(Debug)]
pub struct Workspace {
    /// Solver that finds connections.
    pub solver: Solver<MediumId>,
    /// Counts so far.
    pub stats: Stats,
    /// Energy balance of the particles followed since the balance was last reset.
    pub particle_balance: ParticleBalance,
    /// Probability in (0, 1] of searching a connection that may not be unique for further branches.
    /// Any value is unbiased.
    pub search: f64,
    /// Probabilities with which vertices are connected to emitters. Any values are unbiased.
    pub rates: NeeRates,
    /// Data of a pilot about `rates`.
    pub nee_training: Option<Box<NeeTraining>>,
    /// Probabilities with which strategies of bidirectional estimators are used. Any values are
    /// unbiased.
    pub strategies: StrategyRates,
    /// Work for strategies of bidirectional estimators so far.
    pub strategy_work: StrategyWork,
    /// Estimate of the further contribution of paths, for Russian roulette. Any values are
    /// unbiased.
    pub adjoint: AdjointEstimate,
    /// Techniques for the first vertices of paths.
    pub first_vertex: FirstVertexTechniques,
    /// Last sample whose path was split, if any.
    pub split: Option<SplitSample>,
    /// Data of a pilot about `adjoint`.
    pub adjoint_training: Option<Box<AdjointTraining>>,
    /// Signal to stop all work. Once the signal is raised, searches end without results.
    pub stop: Stop,
    /// Parts of the last straight connection.
    pub(in crate::path) line: Vec<RayPart>,
    /// Parts of the last sampled edge up to its end, if [requested](super::Sampling::parts).
    pub edge_parts: Vec<RayPart>,
    /// Last curved free flight of the current walk, at its end.
    pub(in crate::path) last_flight: Option<ShortRay>,
}

/// Techniques that reduce the variance of the first edges of paths from the sensor. See
/// docs/theory.md#first-vertex-techniques.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FirstVertexTechniques {
    /// Number of first edges that are forced to collide where they would leave the scene. Any
    /// number is unbiased in a scene that is [dark](crate::Scene::is_dark) around.
    pub forced_collisions: u32,
    /// True if paths are split where the first edge meets a smooth dielectric: one path is
    /// refracted, one reflected. Both settings are unbiased.
    pub splitting: bool,
}

/// A sample with a split path.
#[derive(Clone, Copy, Debug)]
pub struct SplitSample {
    /// Number of contributions before the contributions of the reflected path.
    pub before: usize,
    /// Probability with which an unsplit path is reflected at the split.
    pub reflectance: f64,
    /// Work of the workspace before the reflected path.
    pub cost: f64,
}

impl Workspace {
    /// Makes a workspace for rays of a given tolerance.
    pub fn new(tolerance: Tolerance) -> Self {
        Workspace {
            solver: Solver::new(tolerance),
            stats: Stats::default(),
            particle_balance: ParticleBalance::default(),
            search: SEARCH_PROBABILITY,
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
            last_flight: None,
        }
    }

    /// Returns the tolerance of rays.
    pub fn tolerance(&self) -> Tolerance {
        self.solver.tolerance()
    }

    /// Returns the counts, including the solver's work.
    pub fn stats(&self) -> Stats {
        let mut stats = self.stats;
        stats.work += self.solver.work;
        stats
    }

    /// Returns the discovery probability of a branch that only random starts find; a branch from a
    /// deterministic start has 1. A find with probability P has the weight N/q with a variance of
    /// about 2/(qP), as if qP/2 samples had been taken. P itself is unknown. Any estimate of P that
    /// depends only on the branch is unbiased.
    pub(in crate::path) fn random_discovery(&self, geometry: &EdgeGeometry) -> f64 {
        self.search
            * DISCOVERY_PROBABILITY
            * DISCOVERY_PER_REFLECTION.powi(geometry.reflections.min(64) as i32)
    }
}
