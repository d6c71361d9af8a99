//! A phase function for each label.

use super::Phase;
use crate::volume::LabelGrid;
use glam::DVec3;
use std::sync::Arc;

/// The phase function of the label at each place.
#[derive(Clone, Debug)]
pub struct PhaseByLabel {
    labels: Arc<LabelGrid>,
    phases: Vec<Phase>,
}

impl PhaseByLabel {
    /// `phases[label]`; labels beyond them have the last. `None` if there are none.
    pub fn new(labels: Arc<LabelGrid>, phases: Vec<Phase>) -> Option<Self> {
        (!phases.is_empty()).then_some(PhaseByLabel { labels, phases })
    }

    /// The phase function at `x`.
    #[inline]
    pub(super) fn at(&self, x: DVec3) -> &Phase {
        self.numbered(usize::from(self.labels.at(x)))
    }

    /// The phase function of a label, if labels are those of this grid.
    pub(super) fn of_label(&self, labels: &Arc<LabelGrid>, label: usize) -> Option<&Phase> {
        Arc::ptr_eq(labels, &self.labels).then(|| self.numbered(label))
    }

    /// All phase functions.
    pub(super) fn phases(&self) -> &[Phase] {
        &self.phases
    }

    fn numbered(&self, label: usize) -> &Phase {
        &self.phases[label.min(self.phases.len() - 1)]
    }

    /// Bytes held by the labels and by what varies within them.
    pub(super) fn memory(&self) -> usize {
        let nested = self.phases.iter().map(Phase::memory).sum::<usize>();
        self.labels.memory() + nested
    }
}
