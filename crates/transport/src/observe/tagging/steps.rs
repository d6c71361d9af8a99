//! Steps of ways of which note is taken, to be followed later.

use glam::DVec3;

/// A step of a way. The parts along which it goes are kept apart: they are large.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Along the part with this number.
    Fly(usize),
    /// Scattering into this direction.
    Scatter(DVec3),
    /// Along that of a connection, which may be followed from its other end.
    Connect(usize),
}

impl Step {
    /// The number of its part, if it goes along one.
    pub(super) fn part(&self) -> Option<usize> {
        match self {
            Step::Fly(i) | Step::Connect(i) => Some(*i),
            Step::Scatter(_) => None,
        }
    }
}
