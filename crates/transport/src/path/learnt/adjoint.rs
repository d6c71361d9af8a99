//! Estimates of the further contribution of paths and of its work, for Russian roulette
//! (docs/theory.md#russian-roulette).

use crate::path::segment::Start;
use serde::{Deserialize, Serialize};
use std::hint::select_unpredictable;

/// Position and direction in which a path continues: three coordinates each.
pub(super) type PhaseSpacePoint = [f64; AXES];
pub(super) const AXES: usize = 6;

/// Probability of survival of paths, per unit of throughput, as a function of position and
/// direction: a binary tree over both. Any values are unbiased, because no probability is zero.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AdjointEstimate(pub(super) Vec<Node>);

/// A node of the tree; the root is the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Node {
    /// Division of a cell. Points below `cut` along an axis belong to the next node, others to node
    /// `above`.
    Cut { axis: u8, cut: f64, above: u32 },
    /// Value of a cell.
    Cell(f64),
}

pub(super) fn place(start: &Start) -> PhaseSpacePoint {
    let (x, direction) = (start.x, start.direction);
    [x.x, x.y, x.z, direction.x, direction.y, direction.z]
}

impl AdjointEstimate {
    /// Returns the probability of survival per unit of throughput (summed over channels) at the
    /// start of an edge. It exceeds 1 if the benefit of the path exceeds its work. Returns `None`
    /// if there is no estimate.
    pub fn of(&self, start: &Start) -> Option<f64> {
        let place = place(start);
        let mut index = 0;
        // Indices grow, so that the loop ends even if the tree comes from a damaged file.
        loop {
            index = match *self.0.get(index)? {
                Node::Cell(value) => return Some(value),
                Node::Cut { axis, cut, above } => {
                    let (below, above) = (index + 1, (above as usize).max(index + 1));
                    let is_below = *place.get(usize::from(axis))? < cut;
                    select_unpredictable(is_below, below, above)
                }
            };
        }
    }
}
