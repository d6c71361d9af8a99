//! Labels of which a medium is made.

use crate::Spectrum;
use crate::volume::LabelGrid;
use std::sync::Arc;

/// Parts of a medium that records of detected light tell apart.
#[derive(Clone, Debug)]
pub struct MediumLabels {
    /// For each place the number of one of the labels in the `list`.
    pub grid: Arc<LabelGrid>,
    /// The labels.
    pub list: Vec<MediumLabel>,
}

/// One of the labels of a medium.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumLabel {
    /// Name used in records.
    pub name: String,
    /// Absorption coefficient μ_a per unit length.
    pub absorption: Spectrum,
}
