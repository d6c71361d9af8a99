//! Figures of results: curves and maps, as SVG or PNG.

mod curves;
mod figure;
mod map;
mod slice;
mod sources;

pub use curves::{Curves, Series};
pub use figure::{Figure, Format, write};
pub use map::Map;
pub use slice::{Section, slice};
pub use sources::{ProfileLine, convergence, histogram, picture, profile};
