//! Requests of descriptions for the two sides of a surface.

use crate::diagnostic::Location;
use transport::scene::MediumId;

/// Media and indices that a shape's description requests for its two sides.
#[derive(Default)]
pub(super) struct SideRequest {
    pub interior: Option<MediumId>,
    pub exterior: Option<MediumId>,
    pub indices: Option<Indices>,
}

/// Indices that a dielectric requests for its two sides.
#[derive(Clone, Debug)]
pub(super) struct Indices {
    pub inner: Option<f64>,
    pub outer: Option<f64>,
    pub location: Location,
}
