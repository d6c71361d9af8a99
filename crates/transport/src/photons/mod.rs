//! Photon maps, and the search for photons. Distances here say how light is blurred, never where it goes.

mod kernel;
mod map;
mod pieces;
mod tree;

pub use kernel::Kernel;
pub use map::Photon;
pub(crate) use map::{PhotonMap, PhotonSite};
pub(crate) use pieces::pieces;
pub use tree::Tree;
