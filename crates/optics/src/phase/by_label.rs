//! Phase functions by label.

use super::Phase;
use crate::volume::LabelGrid;
use glam::DVec3;
use std::sync::Arc;

/// Phase function of the label at each position.
#[derive(Clone, Debug)]
pub struct PhaseByLabel {
    labels: Arc<LabelGrid>,
    phases: Vec<Phase>,
}

impl PhaseByLabel {
    /// Creates the phase function from `phases[label]`; labels beyond the end have the last one.
    /// Returns `None` if `phases` is empty or contains flakes.
    pub fn new(labels: Arc<LabelGrid>, phases: Vec<Phase>) -> Option<Self> {
        let has_flakes = phases.iter().any(|phase| phase.flakes().is_some());
        (!phases.is_empty() && !has_flakes).then_some(PhaseByLabel { labels, phases })
    }

    /// Returns the phase function at `x`.
    #[inline]
    pub(super) fn at(&self, x: DVec3) -> &Phase {
        self.numbered(usize::from(self.labels.at(x)))
    }

    /// Returns the phase function of a label, if `labels` is the grid of this phase function.
    pub(super) fn of_label(&self, labels: &Arc<LabelGrid>, label: usize) -> Option<&Phase> {
        Arc::ptr_eq(labels, &self.labels).then(|| self.numbered(label))
    }

    /// Returns all phase functions.
    pub(super) fn phases(&self) -> &[Phase] {
        &self.phases
    }

    fn numbered(&self, label: usize) -> &Phase {
        &self.phases[label.min(self.phases.len() - 1)]
    }

    /// Returns the memory of the labels and of nested grids, in bytes.
    pub(super) fn memory(&self) -> usize {
        let nested = self.phases.iter().map(Phase::memory).sum::<usize>();
        self.labels.memory() + nested
    }
}
