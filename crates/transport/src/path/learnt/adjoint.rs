//! What paths may still bring where they go on, and how worthwhile it is to find out: for Russian roulette
//! (docs/theory.md#russian-roulette).

use crate::path::segment::Start;
use serde::{Deserialize, Serialize};
use std::hint::select_unpredictable;

/// Where and in which direction a path goes on: three coordinates each.
pub(super) type PhaseSpacePoint = [f64; AXES];
pub(super) const AXES: usize = 6;

/// With which probability paths should survive, per unit of throughput, by the place where they go on: a binary tree over
/// positions and directions. Any values are unbiased, since no probability is zero.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AdjointEstimate(pub(super) Vec<Node>);

/// A node of the tree; the root is the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Node {
    /// Places below `cut` along an axis belong to the next node, others to node `above`.
    Cut { axis: u8, cut: f64, above: u32 },
    /// The value of a cell.
    Cell(f64),
}

pub(super) fn place(start: &Start) -> PhaseSpacePoint {
    let (x, direction) = (start.x, start.direction);
    [x.x, x.y, x.z, direction.x, direction.y, direction.z]
}

impl AdjointEstimate {
    /// The probability, per unit of throughput (summed over channels), with which a path should go on at the start of an
    /// edge: more than 1 if it is worth more than its work. `None` if nothing is known.
    pub fn of(&self, start: &Start) -> Option<f64> {
        let place = place(start);
        let mut index = 0;
        // Indices grow, so that there is an end even if the tree comes from a damaged file.
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
