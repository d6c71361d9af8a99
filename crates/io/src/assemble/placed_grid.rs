//! Grids and tables with their positions.

use crate::diagnostic::Location;
use glam::DAffine3;
use transport::scene::MediumId;

/// Quantity that a grid or table holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Index,
    /// Index as a function of one coordinate.
    Table,
    Extinction,
}

/// Grid with its position.
#[derive(Clone)]
pub(super) struct Placed {
    pub quantity: Quantity,
    /// Medium of the grid, once it is known.
    pub medium: Option<MediumId>,
    /// Map from the unit cube to the world.
    pub to_world: DAffine3,
    pub location: Location,
}

impl Placed {
    /// Makes a placed grid whose medium is not known yet.
    pub(super) fn new(quantity: Quantity, to_world: DAffine3, location: &Location) -> Self {
        Placed {
            quantity,
            medium: None,
            to_world,
            location: location.clone(),
        }
    }
}
