//! Loading the scene of a command.

use crate::args::SceneArgs;
use crate::command_error::{CommandError, show, warn as warn_of};
use crate::driver::TimeLimit;
use crate::interrupt::Interrupt;
use io::{Diagnostic, Diagnostics, LoadOptions, Loaded, SceneDescription};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Loads a scene with the given options.
pub fn load(scene: &Path, options: &LoadOptions) -> Result<Loaded, CommandError> {
    check_defines(&options.defines)?;
    Ok(io::load_scene(scene, options)?)
}

/// Loads a scene like [`load`], until the user interrupts the program or the time is over. Like a
/// pass over the image, loading that ends soon after the limit is not given up.
pub fn load_in_time(
    scene: &Path,
    options: &LoadOptions,
    limit: &TimeLimit,
    interrupt: &Interrupt,
) -> Result<Loaded, CommandError> {
    check_defines(&options.defines)?;
    let (path, own) = (scene.to_owned(), options.clone());
    let loaded = options.loading.watch(
        move || io::load_scene(&path, &own),
        || match limit.exceeded() {
            _ if interrupt.requested() => ControlFlow::Break(None),
            Some(time) => ControlFlow::Break(Some(time)),
            None => ControlFlow::Continue(()),
        },
    );
    let failed = |e| CommandError::Runtime(format!("cannot start threads: {e}"));
    let stage = || options.loading.stage();
    match loaded.map_err(failed)? {
        ControlFlow::Continue(loaded) => Ok(loaded?),
        ControlFlow::Break(None) => {
            warn_of(&format!(
                "interrupted while {}: no file was written",
                stage()
            ));
            Err(CommandError::Interrupted(interrupt.status()))
        }
        ControlFlow::Break(Some(time)) => Err(CommandError::Runtime(format!(
            "the time limit of {time:?} was reached while {}: raise --time",
            stage()
        ))),
    }
}

/// Reads a scene file without assembling the scene. Warnings go to `diagnostics`.
pub fn read(
    args: &SceneArgs,
    diagnostics: &mut Diagnostics,
) -> Result<SceneDescription, CommandError> {
    check_defines(&args.defines)?;
    let scene = io::read_scene(&args.path, &args.defines, args.memory.limits(), diagnostics);
    diagnostics.silence(&args.silence);
    scene.ok_or_else(|| std::mem::take(diagnostics).into())
}

/// Loads a scene with the command's parameters.
pub fn load_as_it_is(args: &SceneArgs) -> Result<Loaded, CommandError> {
    load(&args.path, &options(args))
}

/// Returns the options for loading a command's scene.
pub fn options(args: &SceneArgs) -> LoadOptions {
    LoadOptions {
        defines: args.defines.clone(),
        silenced: args.silence.clone(),
        limits: args.memory.limits(),
        ..LoadOptions::default()
    }
}

/// Loads a scene like [`load_as_it_is`], and shows warnings on the standard error.
pub fn load_with_warnings(args: &SceneArgs) -> Result<Loaded, CommandError> {
    let loaded = load_as_it_is(args)?;
    show(&loaded.warnings);
    Ok(loaded)
}

/// Shows a scene's warnings, and a note of differences from Mitsuba, on the standard error.
pub fn warn(loaded: &Loaded) {
    show(&loaded.warnings);
    show(&loaded.note_of_differences());
}

/// Returns the name of a scene file without its folder. Outputs contain this name, because they
/// should not depend on the folder.
pub fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// Returns the name of an output: the scene file's name without folder and extension, followed by
/// `end`. Names that are not UTF-8 do not change.
pub fn named_after(scene: &Path, end: &str) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or_default().to_owned();
    name.push(end);
    name.into()
}

/// Refuses duplicate parameters.
pub fn check_defines(defines: &[(String, String)]) -> Result<(), CommandError> {
    let mut diagnostics = Diagnostics::new();
    for (i, (name, _)) in defines.iter().enumerate() {
        if defines[..i].iter().any(|(other, _)| other == name) {
            diagnostics.push(Diagnostic::error(format!("-D {name} is given twice")));
        }
    }
    if diagnostics.has_errors() {
        Err(diagnostics.into())
    } else {
        Ok(())
    }
}
