//! Observers of light: images and meters, and more that they tell of paths than their power.

pub mod derivative;
pub mod film;
pub(crate) mod fold;
pub mod meter;
pub mod polarization;
pub mod sidebands;
pub mod tagging;
