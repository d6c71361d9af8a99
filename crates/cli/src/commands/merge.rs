//! `morgana merge`.

use super::render::check_colours;
use crate::args::MergeArgs;
use crate::command_error::CommandError;
use crate::job::Job;
use crate::measured::Measured;
use crate::output::say;
use crate::report::Report;
use crate::{config, results};
use io::diagnostic::shown;
use io::part::{Body, Header, Part};
use io::{Loaded, Refusal, Run};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;
use transport::meter::Meter;
use transport::render::{MeasureState, State};

/// Puts parts together, and writes what a render in one piece would have.
pub fn merge(args: &MergeArgs) -> Result<ExitCode, CommandError> {
    let outputs = &args.outputs.output;
    let is_part = |path: &std::path::PathBuf| path.extension().is_some_and(|e| e == "part");
    if let [path] = &outputs[..]
        && is_part(path)
    {
        return remain_a_part(args, path);
    }
    if outputs.iter().any(is_part) {
        let message = "write a .part file alone: make images from it later";
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
    let agrees = header.agrees(&run.header());
    agrees.map_err(|e| {
        CommandError::Usage(format!(
            "the parts do not belong to '{}': {e}",
            shown(&job.scene)
        ))
    })?;
    match body {
        Body::Image(state) => merged_image(args, &job, &run, &header, *state),
        Body::Meters(state) => merged_readings(args, &job, &loaded, &header, *state),
    }
}

/// Writes one part.
fn remain_a_part(args: &MergeArgs, path: &Path) -> Result<ExitCode, CommandError> {
    config::check_writable(path)?;
    read(&args.parts)?.write(path)?;
    Ok(ExitCode::SUCCESS)
}

/// All parts together.
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

/// An image of fewer samples than were asked for is right, but nobody should get it unawares.
fn check_complete(args: &MergeArgs, header: &Header, body: &Body) -> Result<(), CommandError> {
    let done = body.done().count();
    match header.total {
        Some(total) if done < total && !args.partial => Err(CommandError::Usage(format!(
            "{} of {total} samples are missing: see morgana status, or write what there is with --partial",
            total - done
        ))),
        _ if done == 0 => Err(CommandError::Usage("the parts have no samples yet".into())),
        _ => Ok(()),
    }
}

fn check_scene(job: &Job, args: &MergeArgs) -> Result<(), CommandError> {
    if job.scene.exists() || args.scene.is_some() {
        return Ok(());
    }
    Err(CommandError::Usage(format!(
        "the scene is no longer at '{}': give its place with --scene",
        shown(&job.scene)
    )))
}

fn merged_image(
    args: &MergeArgs,
    job: &Job,
    run: &Run,
    header: &Header,
    state: State,
) -> Result<ExitCode, CommandError> {
    let loaded = run.loaded;
    let mut images = config::images(&args.outputs, &job.scene)?;
    check_colours(&args.outputs.output, loaded, &mut images)?;
    if args.outputs.strategies.is_some() && !job.strategies {
        let message = "the parts do not separate strategies: render them with --strategies";
        return Err(CommandError::Usage(message.into()));
    }
    if !state.fits(&loaded.groups, &run.options()) {
        return Err(misfit());
    }
    let rendering = state.into_rendering(&loaded.groups);
    let report = Report {
        job,
        run,
        rendering: &rendering,
        requested: header.total,
        elapsed: elapsed(header),
        threads: None,
        stopped: None,
    };
    let exposure = results::write_images(&args.outputs, &images, &report)?;
    if !args.outputs.quiet {
        say(&report.line(exposure))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn merged_readings(
    args: &MergeArgs,
    job: &Job,
    loaded: &Loaded,
    header: &Header,
    state: MeasureState,
) -> Result<ExitCode, CommandError> {
    let files = config::readings(&args.outputs, &job.scene, loaded.instruments.len())?;
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    if !state.fits(&loaded.groups, &meters) {
        return Err(misfit());
    }
    let measurement = state.into_measurement(&loaded.groups, &meters);
    let measured = Measured {
        job,
        loaded,
        measurement: &measurement.map_err(Refusal::Meters)?,
        elapsed: elapsed(header),
        threads: None,
        stopped: None,
    };
    results::write_readings(&args.outputs, &files, &measured)?;
    if !args.outputs.quiet {
        results::warn_of_dark(&measured);
        say(&measured.text())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The time of all parts together.
fn elapsed(header: &Header) -> Duration {
    Duration::try_from_secs_f64(header.seconds).unwrap_or_default()
}

/// The header agrees, but not what follows: only a forged file is like this.
fn misfit() -> CommandError {
    CommandError::Usage("the contents of the parts are not those of their scene".into())
}
