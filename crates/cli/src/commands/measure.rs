//! `morgana render` for a scene with meters in place of a camera.

use super::render::{keep, kept, name};
use crate::args::RenderArgs;
use crate::command_error::CommandError;
use crate::driver::{Driver, TimeLimit};
use crate::job::Job;
use crate::measured::Measured;
use crate::output::say;
use crate::progress::ProgressGoal;
use crate::{config, load, overwrites, results};
use io::clock::Stopped;
use io::image::exposure::Exposure;
use io::part::{Body, BodyRef};
use io::{Loaded, Refusal, Run};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use transport::render::MeasureState;

/// Measures and writes what the meters have read, or the part of it.
pub fn measure(
    args: &RenderArgs,
    job: &Job,
    loaded: &Loaded,
    shard: Option<[u64; 2]>,
    driver: &Driver,
    time: &TimeLimit,
) -> Result<ExitCode, CommandError> {
    check(args)?;
    let files = match shard {
        None => config::readings(&args.outputs, &args.scene.path, loaded.instruments.len())?,
        Some(_) => Vec::new(),
    };
    let written: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
    overwrites::check_read(&written, &loaded.files)?;
    if !args.outputs.quiet {
        load::warn(loaded);
    }
    // A time limit replaces the scene's number of particles, but not that of the command line.
    let requested = match (args.time, shard) {
        (Some(_), None) => args.particles.map(|_| loaded.samples),
        _ => Some(loaded.samples),
    };
    let whole = Run {
        total: requested,
        shard,
        ..job.run(loaded)
    };
    let (options, meters) = (whole.measure_options(), loaded.meters());
    let kept = kept(args, shard)?;
    let (mut keeper, state) = keep(kept, job.header(&whole), |keeper, body| match body {
        Body::Meters(state) if state.fits(&loaded.groups, &meters) => Ok(*state),
        _ => Err(keeper.misfit()),
    })?;
    let started = Instant::now();
    let state = state.map_or_else(|| MeasureState::new(&loaded.groups, &meters), Ok);
    let mut state = state.map_err(Refusal::Meters)?;
    let goal = ProgressGoal {
        samples_per_spp: loaded.groups.len() as u64,
        spp: (options.particles < u64::MAX).then_some(options.particles),
        before: state.done().count(),
        unit: "particles",
        time: time.left(),
    };
    let (advanced, stopped) = driver.drive(goal, |handle, clock| {
        let on_pass = |state: &MeasureState| {
            if let Some(keeper) = &mut keeper {
                keeper.update(BodyRef::Meters(state));
            }
            clock.look(state.done().count() >= options.particles)
        };
        state.advance(&loaded.groups, &meters, &options, handle, on_pass)
    });
    advanced.map_err(Refusal::Meters)?;
    let saved = keeper
        .iter_mut()
        .try_for_each(|k| k.save(BodyRef::Meters(&state)));
    let measurement = state.into_measurement(&loaded.groups, &meters);
    let measured = Measured {
        job,
        loaded,
        measurement: &measurement.map_err(Refusal::Meters)?,
        elapsed: keeper.map_or(started.elapsed(), |k| k.elapsed()),
        threads: Some(driver.pool.current_num_threads()),
        stopped,
    };
    match shard {
        None => results::write_readings(&args.outputs, &files, &measured)?,
        Some(_) => results::write_stats(&args.outputs, || measured.json())?,
    }
    saved?;
    if !args.outputs.quiet {
        results::warn_of_dark(&measured);
        say(&format!("{}{}", name(shard), measured.text()))?;
    }
    Ok(match stopped {
        Some(Stopped::Interrupted) => driver.interrupt.status(),
        _ => ExitCode::SUCCESS,
    })
}

/// Options that are for pictures.
fn check(args: &RenderArgs) -> Result<(), CommandError> {
    let wrong = [
        (
            args.spp.is_some(),
            "--spp",
            ": the number of particles is --particles",
        ),
        (
            args.integrator.is_some(),
            "--integrator",
            ": meters follow particles",
        ),
        (args.sampler.is_some(), "--sampler", ""),
        (args.adaptive, "--adaptive", ""),
        (args.outputs.strategies.is_some(), "--strategies", ""),
        (args.target_error.is_some(), "--target-error", ""),
        (
            args.outputs.tone.exposure != Exposure::Auto,
            "--exposure",
            "",
        ),
        (args.tev.is_some(), "--tev", ""),
        (args.view, "--view", ""),
    ];
    match wrong.iter().find(|(given, ..)| *given) {
        Some((_, option, why)) => Err(CommandError::Usage(format!(
            "{option} is for pictures, but the scene has meters in place of a camera{why}"
        ))),
        None => Ok(()),
    }
}
