//! Observers of light: images, meters, and quantities of paths beyond their power.

pub mod derivative;
pub mod film;
pub(crate) mod fold;
pub mod frequency_domain;
pub mod meter;
pub mod polarization;
pub mod sidebands;
pub mod tagging;
