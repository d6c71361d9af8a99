//! Walks on a GPU, compared with walks in double precision. They run on any GPU, also on Mesa's
//! software Vulkan; without one they are skipped, unless the environment variable
//! MORGANA_ALL_TESTS is set.

mod common;
mod fluence;
mod rays;
mod runs;
mod scenes;
mod slab;
