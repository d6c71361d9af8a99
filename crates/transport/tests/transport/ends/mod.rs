//! Both ends of a path: sensors and emitters compared with the densities of their rays, and filters
//! with their densities.
//!
//! False alarms: 1.4e-4 for each of the seven families here, so at most 1e-3 together. Seeds are
//! fixed.

mod apertures;
mod emission;
mod filters;
mod parallel;
mod power;
mod sensors;
mod support;
mod textured;
