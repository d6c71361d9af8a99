//! What connections and samples cost where rays bend: through the wall of a lens, within it, and through sound.
//!
//! ```text
//! cargo bench -p morgana-transport --bench mission
//! ```
//!
//! Times are processor time, medians over rounds in which the rows of a table take turns. All other
//! numbers are counts, the same on every machine.

#[path = "../../tests/common/mod.rs"]
mod common;
#[path = "../../tests/common/fan.rs"]
mod fan;
#[path = "../../tests/common/lens.rs"]
mod lens;

mod clock;
mod fields;
mod renders;
mod walls;

fn main() {
    walls::table();
    fields::table();
    renders::table();
}
