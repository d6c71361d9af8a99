//! Shapes, compared with brute force, closed forms and finite differences.

mod accel;
mod hits;
mod mesh;
mod sampling;
mod support;
mod surface;
mod tessellation;
mod voxel_faces;
