//! `morgana merge`.

use crate::args::MergeArgs;
use crate::command_error::CommandError;
use crate::config;
use crate::job::Job;
use crate::output::say;
use crate::report::Report;
use crate::results::Files;
use io::diagnostic::shown;
use io::part::{Body, Header, Part};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// Merges parts, and writes the files that a render in one piece would have written.
pub fn merge(args: &MergeArgs) -> Result<ExitCode, CommandError> {
    let outputs = &args.outputs.output;
    let is_part = |path: &std::path::PathBuf| path.extension().is_some_and(|e| e == "part");
    if let [path] = &outputs[..]
        && is_part(path)
    {
        return remain_a_part(args, path);
    }
    if outputs.iter().any(is_part) {
        let message = "write only the .part file: make images from it later by morgana merge";
        return Err(CommandError::Usage(message.into()));
    }
    let Part { header, body } = read(&args.parts)?;
    check_complete(args, &header, &body)?;
    let mut job = Job::of_part(&header)?;
    let moved = args.scene.as_ref();
    job.scene = moved.unwrap_or(&job.scene).clone();
    check_scene(&job, args)?;
    let loaded = job.load(args.memory.limits())?;
    let mut run = job.run(&loaded);
    run.choose_as(&header);
    run.adopt_batches(&header);
    let agrees = header.agrees(&run.header());
    agrees.map_err(|e| {
        CommandError::Usage(format!(
            "the parts do not belong to '{}': {e}",
            shown(&job.scene)
        ))
    })?;
    run.check(args.memory.limits())?;
    if run.has_meters() && args.outputs.strategies.is_some() {
        let message =
            "--strategies is for pictures, but the parts have readings of meters: leave it out";
        return Err(CommandError::Usage(message.into()));
    }
    let files = Files::of(&args.outputs, &job.scene, &loaded)?;
    let is_picture = !run.has_meters();
    if is_picture && args.outputs.strategies.is_some() && !job.strategies {
        let message = "the parts do not separate strategies: render them with --strategies";
        return Err(CommandError::Usage(message.into()));
    }
    if !run.fits(&body) {
        // The header agrees, but the contents do not: this occurs only in a forged file.
        let message = "the parts do not fit their scene: they are damaged; render them again";
        return Err(CommandError::Usage(message.into()));
    }
    let outcome = run.finish(body)?;
    let report = Report {
        job: &job,
        run: &run,
        result: &outcome,
        requested: header.total,
        elapsed: Duration::try_from_secs_f64(header.seconds).unwrap_or_default(),
        threads: None,
        stopped: None,
    };
    let text = files.write(&args.outputs, &report)?;
    if !args.outputs.quiet {
        let wrote = files.wrote(&args.outputs, None);
        say(&format!("{text}\n{wrote}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes the merged part.
fn remain_a_part(args: &MergeArgs, path: &Path) -> Result<ExitCode, CommandError> {
    config::check_writable(path)?;
    read(&args.parts)?.write(path)?;
    if !args.outputs.quiet {
        say(&format!("wrote {}", shown(path)))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Reads and merges all parts.
fn read(paths: &[std::path::PathBuf]) -> Result<Part, CommandError> {
    let mut whole: Option<Part> = None;
    for path in paths {
        let part = Part::read(path)?;
        match &mut whole {
            None => whole = Some(part),
            Some(whole) => {
                let refuse = |e| {
                    format!(
                        "'{}' does not belong to '{}': {e}",
                        shown(path),
                        shown(&paths[0])
                    )
                };
                whole
                    .merge(&part)
                    .map_err(|e| CommandError::Usage(refuse(e)))?;
            }
        }
    }
    whole.ok_or_else(|| CommandError::Usage("there are no parts".into()))
}

/// Refuses an incomplete result without `--partial`. Its image is correct, but has fewer samples
/// than requested.
fn check_complete(args: &MergeArgs, header: &Header, body: &Body) -> Result<(), CommandError> {
    let done = body.done().count();
    match header.total {
        Some(total) if done < total && !args.partial => Err(CommandError::Usage(format!(
            "{} of {total} samples are missing: morgana status lists them; --partial writes the result without them",
            total - done
        ))),
        _ if done == 0 => Err(CommandError::Usage(
            "the parts have no samples yet: let their renders run longer".into(),
        )),
        _ => Ok(()),
    }
}

fn check_scene(job: &Job, args: &MergeArgs) -> Result<(), CommandError> {
    if job.scene.exists() || args.scene.is_some() {
        return Ok(());
    }
    Err(CommandError::Usage(format!(
        "the scene is no longer at '{}': give its new path by --scene",
        shown(&job.scene)
    )))
}
