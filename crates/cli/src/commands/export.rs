//! `morgana export`.

use crate::args::ExportArgs;
use crate::command_error::{CommandError, show};
use crate::load::read;
use crate::output::say;
use io::diagnostic::shown;
use io::features::Features;
use io::{Diagnostic, Diagnostics, json, xml};
use std::path::Path;
use std::process::ExitCode;

/// Writes a scene in the format of Mitsuba 3.
pub fn export(args: &ExportArgs) -> Result<ExitCode, CommandError> {
    let mut diagnostics = Diagnostics::new();
    let scene = read(&args.scene, &mut diagnostics)?;
    let folder = args.output.parent().filter(|p| !p.as_os_str().is_empty());
    let scene = scene.relocated(folder.unwrap_or(Path::new(".")));
    let text = if io::is_json(&args.output) {
        json::write(&scene)
    } else {
        xml::write(&scene).map_err(|e| CommandError::Usage(format!("{e}: write a .json file")))?
    };
    io::atomic::write_bytes(&args.output, text.as_bytes())?;
    let own = Features::of(&scene).own;
    if !own.is_empty() {
        let message = format!("Mitsuba 3 does not have: {}", own.join(", "));
        let help = String::from(
            "morgana reads the file as it is; Mitsuba refuses it until these are gone",
        );
        diagnostics.push(Diagnostic::note(message).help(help));
    }
    show(&diagnostics);
    say(&format!("{}: written", shown(&args.output)))?;
    Ok(ExitCode::SUCCESS)
}
