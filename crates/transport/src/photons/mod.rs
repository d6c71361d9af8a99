//! Photon maps, and the search for photons. Distances between points determine the blur of light
//! here, never its direction.

mod around;
mod follow;
mod kernel;
mod map;
mod photon;
mod pieces;
mod radii;
mod tree;

pub(crate) use around::{PhotonsAround, ScatteredLight};
pub(crate) use follow::{Followed, LightPaths};
pub use kernel::Kernel;
pub(crate) use map::PhotonMap;
pub use photon::Photon;
pub(crate) use photon::{is_indirect, stored};
pub(crate) use pieces::pieces;
pub use radii::Radii;
pub use tree::PhotonTree;
