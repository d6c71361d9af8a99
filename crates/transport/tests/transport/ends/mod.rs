//! Both ends of a path: sensors against the densities of their rays, emitters against those of the
//! light that they send out, filters against theirs.
//!
//! False alarms: 1.4e-4 for each of the seven families here, so at most 1e-3 together. Seeds are fixed.

mod apertures;
mod emission;
mod filters;
mod parallel;
mod power;
mod sensors;
mod support;
mod textured;
