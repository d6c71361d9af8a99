//! Bsdfs, textures, emitters and shapes from files, and instances in scene files: what becomes of them, and what is
//! refused.

mod bsdfs;
mod lights;
mod shapes;
mod support;
mod textures;
