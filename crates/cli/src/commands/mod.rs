//! Commands, one file each.

mod check;
mod compare;
mod connect;
mod convert;
mod denoise;
mod export;
mod frames;
mod info;
mod mcx;
mod merge;
mod plot;
mod render;
mod schema;
mod shell;
mod status;
mod tonemap;
mod trace;
mod view;

pub use check::check;
pub use compare::compare;
pub use connect::connect;
pub use convert::convert;
pub use denoise::denoise;
pub use export::export;
pub use frames::render;
pub use info::info;
pub use mcx::{is_name as is_mcx, mcx};
pub use merge::merge;
pub use plot::plot;
pub use schema::schema;
pub use shell::{completions, man};
pub use status::status;
pub use tonemap::tonemap;
pub use trace::trace;
pub use view::view;
