//! `morgana check`.

use crate::args::CheckArgs;
use crate::command_error::CommandError;
use crate::load::{load_as_it_is, warn};
use crate::output::say;
use io::Run;
use io::diagnostic::shown;
use std::process::ExitCode;

/// Loads a scene as a render would, and says what there is to say about it.
pub fn check(args: &CheckArgs) -> Result<ExitCode, CommandError> {
    let loaded = load_as_it_is(&args.scene)?;
    warn(&loaded);
    Run::new(&loaded).check(args.scene.memory.limits())?;
    let film = loaded.scene().film();
    let what = match loaded.instruments.len() {
        0 => format!("{} × {} pixels", film.width, film.height),
        1 => "1 meter".into(),
        n => format!("{n} meters"),
    };
    let warnings = match loaded.warnings.iter().count() {
        0 => "no warnings".to_owned(),
        1 => "1 warning or note".into(),
        n => format!("{n} warnings and notes"),
    };
    let name = shown(&args.scene.path);
    say(&format!("{name}: can be used ({what}; {warnings})"))?;
    Ok(ExitCode::SUCCESS)
}
