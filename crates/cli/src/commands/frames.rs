//! `morgana render --frames`: the frames of a sequence, one after the other.

use super::render::render_once;
use crate::args::{Frames, PLACEHOLDER, RenderArgs};
use crate::command_error::CommandError;
use crate::interrupt::Interrupt;
use crate::output::say;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Renders a scene, or measures; for a sequence, every frame.
pub fn render(args: &RenderArgs) -> Result<ExitCode, CommandError> {
    let interrupt = Interrupt::watch()?;
    match args.machines.frames {
        None => render_once(args, &mut None, &interrupt),
        Some(frames) => sequence(args, frames, &interrupt),
    }
}

/// Renders frames with the choices that a pilot makes for the first frame. A resumed sequence skips
/// frames whose files exist.
fn sequence(
    args: &RenderArgs,
    frames: Frames,
    interrupt: &Interrupt,
) -> Result<ExitCode, CommandError> {
    check(args)?;
    let mut chosen = None;
    for number in frames.numbers() {
        let frame = of_frame(args, &number);
        let done = |path: &PathBuf| path.is_file();
        if args.machines.keep.resume && frame.outputs.output.iter().all(done) {
            continue;
        }
        if !args.outputs.quiet {
            say(&format!("frame {number}"))?;
        }
        let code = render_once(&frame, &mut chosen, interrupt)?;
        if interrupt.requested() {
            return Ok(code);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses sequences whose frames would overwrite each other's files or be equal.
fn check(args: &RenderArgs) -> Result<(), CommandError> {
    let usage = |message: String| Err(CommandError::Usage(message));
    if args.machines.keep.checkpoint.is_some() || args.machines.keep.shard.is_some() {
        return usage(
            "--frames continues at the first missing file: leave out --checkpoint and --shard"
                .into(),
        );
    }
    let outputs = &args.outputs;
    let files = outputs
        .output
        .iter()
        .chain(&outputs.stats)
        .chain(&outputs.strategies);
    if outputs.output.is_empty() || files.into_iter().any(|path| !holds(path)) {
        return usage(format!(
            "each frame needs its own files: put {PLACEHOLDER} into their names, such as -o picture_{PLACEHOLDER}.exr"
        ));
    }
    if !args
        .scene
        .defines
        .iter()
        .any(|(_, value)| value.contains(PLACEHOLDER))
    {
        return usage(format!(
            "all frames would be equal: put {PLACEHOLDER} into the value of a parameter, such as -D file=flow_{PLACEHOLDER}.vti"
        ));
    }
    Ok(())
}

fn holds(path: &Path) -> bool {
    path.to_str().is_some_and(|path| path.contains(PLACEHOLDER))
}

/// Returns the arguments of a frame.
fn of_frame(args: &RenderArgs, number: &str) -> RenderArgs {
    // Only UTF-8 names contain the number: see `holds`.
    let named = |path: &PathBuf| match path.to_str() {
        Some(text) => PathBuf::from(text.replace(PLACEHOLDER, number)),
        None => path.clone(),
    };
    let mut frame = args.clone();
    frame.machines.frames = None;
    // `--resume` concerns the frames here, not a checkpoint.
    frame.machines.keep.resume = false;
    for (_, value) in &mut frame.scene.defines {
        *value = value.replace(PLACEHOLDER, number);
    }
    let outputs = &mut frame.outputs;
    outputs.output = outputs.output.iter().map(named).collect();
    outputs.stats = outputs.stats.as_ref().map(named);
    outputs.strategies = outputs.strategies.as_ref().map(named);
    frame
}
