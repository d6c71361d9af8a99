//! Paths: non-specular vertices and the edges between them.
//!
//! An edge is a curved ray with the specular events along it. Only this module computes the
//! directions of light at the ends of an edge, its length and its geometry term.
//!
//! One rule decides which edges connections find (docs/theory.md#connectable-edges). An edge is
//! *connectable* if connections search for edges like it:
//!
//! - it passes declared index matches, and is refracted or totally reflected at smooth dielectrics;
//! - it is reflected at smooth dielectrics, where refraction is possible, no more often than the
//!   scene allows;
//! - it is no longer than the scene's reach.
//!
//! Connections find all connectable edges. Deterministic starts lead to some of them with
//! certainty. Random starts find the others, with a weight that corrects for the probability of
//! finding them. A connectable edge that a random walk found therefore shares its contribution with
//! the competing connections, by MIS weights. Any other edge keeps its full contribution.
//!
//! Theory: docs/theory.md#edges-and-geometry-terms.

mod connection;
mod energy_balance;
mod learnt;
mod log;
mod random_walk;
mod segment;
mod subpath;
mod walk;
mod workspace;

pub use connection::{Connection, ConnectionTarget, transmittance};
pub(crate) use connection::{ConnectionArcs, FoundBranch, Weighted, environment_end};
pub use energy_balance::{BalanceSums, BalanceTotals, EnergyBalance, ParticleBalance, Share};
pub(crate) use learnt::NeeSlot;
pub use learnt::{
    AdjointEstimate, AdjointTraining, Levels, NeeRates, NeeTraining, PathTally, StrategyFind,
    StrategyKind, StrategyRates, StrategySample, StrategyShares, StrategyTraining, StrategyWork,
};
pub(crate) use log::{BranchPoint, EdgePart, FoundPath, PathLog, SubpathEnd};
pub use random_walk::{
    CellCollision, CellDetail, CellRun, FreeFlightEvent, Observer, RandomWalk, Survival, WalkEvent,
    WalkRay,
};
pub(crate) use segment::share;
pub use segment::{
    Edge, EdgeGeometry, End, Point, Span, Split, Start, TransportMode, Vertex, lead_in,
};
pub(crate) use segment::{Equiangular, surface_at};
pub use subpath::{Bounds, PathVertex, emit, guess};
pub(crate) use subpath::{EmitterEnd, EndChoice, Resampling};
pub(crate) use subpath::{Escape, LightPath, PathEdge, Subpath, scatter, scatter_pdf, sensor_path};
pub(crate) use walk::choose_channel;
pub(crate) use walk::{
    Continuation, EmittedAlong, FollowedRay, RayObserver, SeenSurface, UnscatteredRay, follow,
    gather_along, gather_in_view, see,
};
pub use walk::{FreeFlight, FreeLeg, Sampling, TraceEnding, trace};
pub use workspace::{FirstVertexTechniques, RayPart, SplitSample, Workspace};
