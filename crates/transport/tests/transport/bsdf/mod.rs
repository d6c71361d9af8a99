//! Tests of the BSDFs. False alarms below 1e-3 in all; each module states its own.

mod anisotropy;
mod common;
mod facets;
mod physics;
mod reference;
mod roughness;
mod sampling;
mod shading;
