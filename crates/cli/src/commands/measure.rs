//! `morgana render` for a scene with meters in place of a camera.

use crate::args::RenderArgs;
use crate::failure::{Failure, show};
use crate::measured::Measured;
use crate::progress::{self, Goal};
use crate::report::Stopped;
use crate::{config, interrupt, load};
use io::arrays::{Context, arrays};
use io::{Diagnostic, Diagnostics, Loaded};
use rayon::ThreadPool;
use std::io::Write;
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;
use transport::meter::Meter;
use transport::render::{self, MeasureError, MeasureOptions, Measurement};

/// Measures and writes what the meters have read.
pub fn measure(args: &RenderArgs, loaded: &Loaded, pool: &ThreadPool) -> Result<ExitCode, Failure> {
    check(args)?;
    let files = config::readings(args, loaded.instruments.len())?;
    if !args.quiet {
        load::warn(loaded);
    }
    let interrupted = interrupt::watch()?;
    let started = Instant::now();
    let (measurement, stopped) = run(args, loaded, pool, &interrupted)?;
    let measured = Measured {
        args,
        loaded,
        measurement: &measurement,
        elapsed: started.elapsed(),
        threads: pool.current_num_threads(),
        stopped,
    };
    let context = Context {
        instruments: &loaded.instruments,
        measurement: &measurement,
        channels: &loaded.channel_names,
    };
    let readings = arrays(&context, measured.attributes());
    let readings = files
        .iter()
        .map(|(path, format)| readings.write(path, *format));
    let stats = args
        .stats
        .iter()
        .map(|path| io::atomic::write(path, |file| writeln!(file, "{:#}", measured.json())));
    let failed: Vec<String> = readings
        .chain(stats)
        .filter_map(Result::err)
        .map(|e| e.to_string())
        .collect();
    if !failed.is_empty() {
        return Err(Failure::Runtime(failed.join("\n")));
    }
    if !args.quiet {
        warn(&measured);
        writeln!(std::io::stdout(), "{}", measured.text())?;
    }
    Ok(match stopped {
        Some(Stopped::Interrupted) => ExitCode::from(interrupt::STATUS),
        _ => ExitCode::SUCCESS,
    })
}

/// Options that are for pictures.
fn check(args: &RenderArgs) -> Result<(), Failure> {
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
        (args.strategies.is_some(), "--strategies", ""),
        (args.target_error.is_some(), "--target-error", ""),
        (args.tone.exposure != 0.0, "--exposure", ""),
        (args.tev.is_some(), "--tev", ""),
    ];
    match wrong.iter().find(|(given, ..)| *given) {
        Some((_, option, why)) => Err(Failure::Usage(format!(
            "{option} is for pictures, but the scene has meters in place of a camera{why}"
        ))),
        None => Ok(()),
    }
}

fn run(
    args: &RenderArgs,
    loaded: &Loaded,
    pool: &ThreadPool,
    interrupted: &AtomicBool,
) -> Result<(Measurement, Option<Stopped>), Failure> {
    // A time limit replaces the scene's number of particles, but not that of the command line.
    let requested = match args.time {
        Some(_) => args.particles.map(|_| loaded.samples),
        None => Some(loaded.samples),
    };
    let goal = Goal {
        samples_per_spp: loaded.groups.len() as u64,
        spp: requested,
        unit: "particles",
        time: args.time,
    };
    let (max_depth, rr_depth) = loaded.integrator.depths();
    let options = MeasureOptions {
        particles: requested.unwrap_or(u64::MAX),
        seed: args.seed,
        max_depth,
        rr_depth,
    };
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let (counter, started) = (AtomicU64::new(0), Instant::now());
    let mut stopped = None;
    let on_pass = |done| {
        if interrupted.load(Ordering::Relaxed) {
            stopped = Some(Stopped::Interrupted);
        } else if args.time.is_some_and(|t| started.elapsed() >= t) {
            stopped = Some(Stopped::Time);
        }
        match stopped {
            Some(_) if done < options.particles => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    };
    let measurement = std::thread::scope(|scope| {
        let _drawing = (!args.quiet).then(|| progress::draw(scope, goal, &counter, interrupted));
        pool.install(|| render::measure(&loaded.groups, &meters, &options, &counter, on_pass))
    });
    match measurement {
        Ok(measurement) => Ok((measurement, stopped)),
        Err(error @ MeasureError::Dark) => Err(Failure::Usage(error.to_string())),
        Err(error @ MeasureError::Memory(_)) => Err(Failure::Runtime(error.to_string())),
    }
}

/// Says which meters have received nothing.
fn warn(measured: &Measured) {
    let mut warnings = Diagnostics::new();
    for name in measured.dark() {
        let message = format!("the meter '{name}' received no light");
        let help = "check where it is, and whether light can get there".to_owned();
        warnings.push(Diagnostic::warning(message).help(help));
    }
    show(&warnings);
}
