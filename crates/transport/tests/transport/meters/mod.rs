//! Meters, compared with closed forms, independent tallies, each other, and the conservation of
//! power.
//!
//! Statistical tests compare at a family-wise false-alarm rate of 1e-3 each, by z with the standard
//! errors that the meters report.

mod checks;
mod closed_forms;
mod colour_derivatives;
mod conservation;
mod cutting;
mod derivatives;
mod emission_derivatives;
mod free_flights;
mod frequency_domain;
mod gates;
mod instants;
mod pictures;
mod records;
mod reproducible;
mod sidebands;
mod slabs;
pub mod support;
mod tagged;
mod tallies;
