//! The standard output.

use crate::command_error::CommandError;
use io::diagnostic::escaped;
use std::io::Write;

/// Prints lines of text, [`safe`].
pub fn say(text: &str) -> Result<(), CommandError> {
    std::io::stdout().write_all(safe(text).as_bytes())?;
    Ok(())
}

/// Lines of text in which no name that comes from a file can drive the terminal.
pub fn safe(text: &str) -> String {
    text.lines().map(|line| escaped(line) + "\n").collect()
}
