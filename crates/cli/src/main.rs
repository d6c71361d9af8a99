//! The `morgana` command.
fn main() {}
