//! Fields, rays and connections, beside closed forms, tables that share no code with them, and finite differences.
//!
//! One program, as linking many takes longer than most of them run.

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
