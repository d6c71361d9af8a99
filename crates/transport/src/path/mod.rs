//! Paths: non-specular vertices and the edges between them.
//!
//! An edge is curved flow plus the specular events that it passes. This is the only place that says
//! which way light goes at each end of an edge, how long it is, and what its geometry term is.
//!
//! Which edges connections own is one rule (theory §7): an edge is *connectable* if every event on it
//! is the one that a shot would choose, i.e. pass where indices are declared matched, refraction at
//! smooth dielectrics wherever it is possible, and reflection where it is not. An edge found by chance
//! that ends on an emitter shares its contribution with the connection that finds the same edge, and
//! keeps all of it if none does.

mod attract;
mod edge;
mod equiangular;
mod link;
mod vertex;
mod walk;

pub use attract::{scatter, scatter_pdf};
pub use edge::{Edge, End, Span, Start};
pub use equiangular::Equiangular;
pub use link::{Link, environment_aim, transmittance};
pub use vertex::{Scatter, Vertex};
pub use walk::trace;

use crate::scene::MediumId;
use crate::stats::Stats;
use eikonal::{Solver, Tolerance};

/// Storage and counts of one thread.
#[derive(Debug)]
pub struct Workspace {
    /// Finds connections.
    pub solver: Solver<MediumId>,
    /// What has happened so far.
    pub stats: Stats,
}

impl Workspace {
    /// A fresh workspace for rays of a given tolerance.
    pub fn new(tolerance: Tolerance) -> Self {
        Workspace {
            solver: Solver::new(tolerance),
            stats: Stats::default(),
        }
    }

    /// The counts, with the solver's work in them.
    pub fn stats(&self) -> Stats {
        let mut stats = self.stats;
        stats.work += self.solver.work;
        stats
    }
}
