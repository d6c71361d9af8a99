//! The commands, one file each.

mod compare;
mod connect;
mod info;
mod measure;
mod plot;
mod render;
mod shell;
mod tonemap;
mod trace;

pub use compare::compare;
pub use connect::connect;
pub use info::info;
pub use plot::plot;
pub use render::render;
pub use shell::{completions, man};
pub use tonemap::tonemap;
pub use trace::trace;
