//! Recorded steps of paths, to be followed later.

use glam::DVec3;

/// Step of a path. The arcs of steps are stored separately, because they are large.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Segment along the part with this index.
    Fly(usize),
    /// Scattering into this direction.
    Scatter(DVec3),
    /// Segment along the part of a connection with this index, which may be followed from its other
    /// end.
    Connect(usize),
}

impl Step {
    /// Returns the index of the step's part, if it has one.
    pub(super) fn part(&self) -> Option<usize> {
        match self {
            Step::Fly(i) | Step::Connect(i) => Some(*i),
            Step::Scatter(_) => None,
        }
    }
}
