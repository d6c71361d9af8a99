//! `morgana export`.

use crate::args::ExportArgs;
use crate::command_error::{CommandError, show};
use crate::load::read;
use crate::output::say;
use io::diagnostic::shown;
use io::features::Features;
use io::{Diagnostic, Diagnostics, WriteError};
use std::process::ExitCode;

/// Writes a scene in the format of Mitsuba 3.
pub fn export(args: &ExportArgs) -> Result<ExitCode, CommandError> {
    let mut diagnostics = Diagnostics::new();
    let scene = read(&args.scene, &mut diagnostics)?.with_extinctions();
    io::write_scene(&scene, &args.output).map_err(|error| match error {
        WriteError::File(error) => error.into(),
        _ => CommandError::Usage(error.to_string()),
    })?;
    let own = Features::of(&scene).own;
    if !own.is_empty() {
        let message = format!("Mitsuba 3 does not have: {}", own.join(", "));
        let help = "morgana reads this file; for Mitsuba, remove these features";
        diagnostics.push(Diagnostic::note(message).help(help.to_owned()));
    }
    show(&diagnostics);
    say(&format!("{}: written", shown(&args.output)))?;
    Ok(ExitCode::SUCCESS)
}
