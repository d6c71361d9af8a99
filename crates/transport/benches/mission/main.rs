//! Costs of connections and samples where rays bend: through the wall of a lens, within it, through
//! sound, and through large grids.
//!
//! ```text
//! cargo bench -p morgana-transport --bench mission               # everything
//! cargo bench -p morgana-transport --bench mission -- fields     # one table: walls, fields, grids, renders
//! ```
//!
//! Times are processor times, medians over rounds in which the rows of a table take turns. All
//! other numbers are counts, equal on every machine.

#[path = "../../tests/transport/common/mod.rs"]
mod common;

mod clock;
mod fields;
mod grids;
mod renders;
mod walls;

fn main() {
    // Cargo passes `--bench` too.
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let tables: [(&str, fn()); 4] = [
        ("walls", walls::table),
        ("fields", fields::table),
        ("grids", grids::table),
        ("renders", renders::table),
    ];
    for (name, table) in tables {
        if wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str())) {
            table();
        }
    }
}
