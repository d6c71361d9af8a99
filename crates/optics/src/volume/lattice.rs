//! Positions of the samples of a grid.

use eikonal::field::Placement;
use glam::{DAffine3, DMat3, DVec3};

/// Returns the map from the unit cube to sample indices.
pub(super) fn to_samples(size: [usize; 3], placement: Placement) -> DAffine3 {
    let size = DVec3::from_array(size.map(|n| n as f64));
    match placement {
        Placement::Centers => DAffine3 {
            matrix3: DMat3::from_diagonal(size),
            translation: DVec3::splat(-0.5),
        },
        Placement::Nodes => DAffine3::from_scale(size - 1.0),
    }
}
