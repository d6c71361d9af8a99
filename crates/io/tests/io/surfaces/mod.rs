//! Bsdfs, textures, emitters, shapes and instances from scene files: accepted and refused ones.

mod bsdfs;
mod lights;
mod shapes;
mod support;
mod textures;
