//! The standard output.

use crate::command_error::CommandError;
use io::diagnostic::escaped;
use std::io::Write;

/// Prints lines of text, made [`safe`].
pub fn say(text: &str) -> Result<(), CommandError> {
    std::io::stdout().write_all(safe(text).as_bytes())?;
    Ok(())
}

/// Returns lines of text in which names from files cannot control the terminal.
pub fn safe(text: &str) -> String {
    text.lines().map(|line| escaped(line) + "\n").collect()
}
