//! The commands, one file each.

mod connect;
mod convert;
mod info;
mod measure;
mod plot;
mod render;
mod trace;

pub use connect::connect;
pub use convert::convert;
pub use info::info;
pub use plot::plot;
pub use render::render;
pub use trace::trace;
