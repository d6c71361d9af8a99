//! Photon maps, and the search for photons. Distances here say how light is blurred, never where it goes.

mod kernel;
mod map;
mod pieces;
mod tree;

pub use kernel::Kernel;
pub use map::{Photon, PhotonMap, PhotonSite};
pub use pieces::{GatherPiece, pieces};
pub use tree::Tree;
