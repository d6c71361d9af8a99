//! `morgana completions` and `morgana man`: support for shells.

use crate::args::Args;
use crate::command_error::CommandError;
use clap::CommandFactory;
use clap_complete::{Shell, generate};
use io::diagnostic::shown;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// Prints a script that completes command lines.
pub fn completions(shell: Shell) -> Result<ExitCode, CommandError> {
    let mut script = Vec::new();
    generate(shell, &mut Args::command(), "morgana", &mut script);
    std::io::stdout().write_all(&script)?;
    Ok(ExitCode::SUCCESS)
}

/// Writes manual pages, one for each command and its subcommands.
pub fn man(folder: &Path) -> Result<ExitCode, CommandError> {
    clap_mangen::generate_to(Args::command(), folder)
        .map_err(|e| CommandError::Runtime(format!("cannot write to '{}': {e}", shown(folder))))?;
    Ok(ExitCode::SUCCESS)
}
