//! Tests of fields, rays and connections, by closed forms, independently computed tables, and
//! finite differences.
//!
//! All tests are one program, because linking many programs takes longer than most tests.

mod adjoint;
mod branches;
mod carried;
mod certificate;
mod collocation;
mod common;
mod condensed;
mod connections;
mod field_bounds;
mod field_derivatives;
mod field_grid;
mod field_noise;
mod field_sound;
mod field_values;
mod formulas;
mod grid_twins;
mod homogeneous;
mod interface;
mod modulation;
mod path_difference;
mod path_difference_field;
mod ray_accuracy;
mod rays;
mod steep;
mod work_counters;
