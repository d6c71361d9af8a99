//! What descriptions say of the two sides of a surface, before it is settled.

use crate::diagnostic::Location;
use transport::scene::MediumId;

/// What a shape's description says of its two sides.
#[derive(Default)]
pub(super) struct Wish {
    pub interior: Option<MediumId>,
    pub exterior: Option<MediumId>,
    pub indices: Option<Indices>,
}

/// What a dielectric says of the indices on its sides.
#[derive(Clone, Debug)]
pub(super) struct Indices {
    pub inner: Option<f64>,
    pub outer: Option<f64>,
    pub location: Location,
}
