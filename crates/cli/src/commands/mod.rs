//! The commands, one file each.

mod connect;
mod info;
mod measure;
mod render;
mod trace;

pub use connect::connect;
pub use info::info;
pub use render::render;
pub use trace::trace;
