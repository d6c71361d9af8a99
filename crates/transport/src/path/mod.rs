//! Paths: non-specular vertices and the edges between them.
//!
//! An edge is curved flow plus the specular events that it passes. This is the only place that says
//! which way light goes at each end of an edge, how long it is, and what its geometry term is.
//!
//! Which edges connections own is one rule (docs/theory.md#connectable-edges): an edge is *connectable* if connections look
//! for its like, i.e. it passes where indices are declared matched, is refracted or totally reflected at
//! smooth dielectrics, or is reflected there no more often than the scene allows, and is no longer than
//! the scene's reach. Connections find all such edges: the one that a deterministic start leads to for
//! certain, others at random with a weight that makes up for it. So an edge that is connectable and was
//! found by chance shares its contribution with the connections that compete for it, and any
//! other edge keeps all of it.
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
pub(crate) use log::{EdgePart, FoundPath, Leaves, PathLog, SubpathEnd};
pub use random_walk::{
    FreeFlightEvent, Observer, RandomWalk, Survival, VoxelFlight, WalkEvent, WalkRay,
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
pub use walk::{FreeFlight, Sampling, TraceEnding, trace};
pub use workspace::{FirstVertexTechniques, RayPart, SplitSample, Workspace};
