//! Grids and tables with the places where they lie.

use crate::diagnostic::Location;
use glam::DAffine3;
use transport::scene::MediumId;

/// Quantity that a grid or table holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Index,
    /// The index, by one coordinate.
    Table,
    Extinction,
}

/// A grid, and where it lies.
#[derive(Clone)]
pub(super) struct Placed {
    pub quantity: Quantity,
    /// The medium, once it is known.
    pub medium: Option<MediumId>,
    /// From the unit cube.
    pub to_world: DAffine3,
    pub location: Location,
}

impl Placed {
    /// A grid of a medium that is not known yet.
    pub(super) fn new(quantity: Quantity, to_world: DAffine3, location: &Location) -> Self {
        Placed {
            quantity,
            medium: None,
            to_world,
            location: location.clone(),
        }
    }
}
