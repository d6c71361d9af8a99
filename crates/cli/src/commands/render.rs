//! `morgana render`.

use super::measure::measure;
use crate::args::RenderArgs;
use crate::command_error::{CommandError, warn};
use crate::config::ImageFormat;
use crate::driver::{Driver, TimeLimit};
use crate::interrupt::Interrupt;
use crate::job::Job;
use crate::keeper::{self, Keeper, Kept};
use crate::output::say;
use crate::preview::{Canvas, Preview};
use crate::progress::ProgressGoal;
use crate::report::Report;
use crate::shard::Shard;
use crate::watched::Watched;
use crate::{config, load, overwrites, results};
use io::clock::Stopped;
use io::part::{Body, BodyRef, Header};
use io::{Loaded, Run};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use transport::render::{Progress, RenderOptions, State};
use view::LiveProgress;

/// Renders a scene and writes its images, or its part; or measures. What is left open is chosen as it was for another render, if there was one, and
/// what was chosen stays in `chosen`.
pub fn picture(
    args: &RenderArgs,
    chosen: &mut Option<Header>,
    interrupt: &Interrupt,
) -> Result<ExitCode, CommandError> {
    let time = TimeLimit::start(args.time);
    let pool = pool(args.threads)?;
    let job = Job::of(args);
    let limits = args.scene.memory.limits();
    let loaded = job.load_in_time(limits, &time, interrupt)?;
    let shard = shard(args, &loaded)?;
    let driver = Driver {
        pool: &pool,
        interrupt,
        quiet: args.outputs.quiet,
    };
    if !loaded.instruments.is_empty() {
        return measure(args, &job, &loaded, shard, &driver, &time);
    }
    if args.particles.is_some() {
        let message = "--particles is for scenes with meters; for a camera it is --spp";
        return Err(CommandError::Usage(message.into()));
    }
    let images = images(args, &loaded, shard)?;
    let written: Vec<PathBuf> = images.iter().map(|(path, _)| path.clone()).collect();
    overwrites::check_read(&written, &loaded.files)?;
    if !args.outputs.quiet {
        load::warn(&loaded);
    }
    // Other limits replace the scene's number of samples, but not that of the command line.
    let requested = match (args.time, args.target_error, shard) {
        (None, None, _) | (.., Some(_)) => Some(loaded.samples),
        _ => args.spp.map(|_| loaded.samples),
    };
    let mut run = Run {
        total: requested,
        shard,
        time: time.left(),
        ..job.run(&loaded)
    };
    let started = Instant::now();
    run.check(limits)?;
    let kept = kept(args, shard)?;
    match kept.as_ref().and_then(Kept::header).or(chosen.as_ref()) {
        Some(header) => run.choose_as(header),
        None if driver.choose(&mut run).is_break() => {
            warn("interrupted before the first sample: nothing is written");
            return Ok(interrupt.status());
        }
        None => {}
    }
    run.check(limits)?;
    let options = run.options();
    let header = chosen.insert(job.header(&run)).clone();
    let (mut keeper, state) = keep(kept, header, |keeper, body| match body {
        Body::Image(state) if state.fits(&loaded.groups, &options) => Ok(*state),
        _ => Err(keeper.misfit()),
    })?;
    let mut preview = preview(args, &loaded)?;
    let watched = watched(args, &loaded, interrupt)?;
    let mut state = state.unwrap_or_else(|| State::new(&loaded.groups, &options));
    let goal = ProgressGoal {
        // The choice of the integrator counts, too.
        time: time.left(),
        ..progress_goal(args, &options, &state, &loaded)
    };
    let ((), stopped) = driver.drive(goal, |handle, clock| {
        state.advance(&loaded.groups, &options, handle, |progress| {
            if let Some(preview) = &mut preview {
                preview.update(progress.film);
            }
            if let Some(watched) = &watched {
                watched.update(progress.film, live_progress(progress, &goal));
            }
            if let Some(keeper) = &mut keeper {
                keeper.update(BodyRef::Image(progress.state));
            }
            clock.look(progress.done >= progress.total)
        });
    });
    let stopped = stopped.or(state.reached().then_some(Stopped::Target));
    let saved = keeper
        .iter_mut()
        .try_for_each(|k| k.save(BodyRef::Image(&state)));
    let rendering = state.into_rendering(&loaded.groups);
    let report = Report {
        job: &job,
        run: &run,
        rendering: &rendering,
        requested,
        elapsed: keeper.map_or(started.elapsed(), |k| k.elapsed()),
        threads: Some(pool.current_num_threads()),
        stopped,
    };
    let written = match shard {
        None => results::write_images(&args.outputs, &images, &report),
        Some(_) => results::write_stats(&args.outputs, || report.json()).map(|()| None),
    };
    if let Some(preview) = preview {
        preview.finish(&rendering.film);
    }
    let exposure = written?;
    saved?;
    if !args.outputs.quiet {
        say(&format!("{}{}", name(shard), report.line(exposure)))?;
    }
    if let Some(watched) = watched {
        watched.finish(&rendering.film);
    }
    Ok(match stopped {
        Some(Stopped::Interrupted) => interrupt.status(),
        _ => ExitCode::SUCCESS,
    })
}

/// Which part of the samples is wanted.
fn shard(args: &RenderArgs, loaded: &Loaded) -> Result<Option<[u64; 2]>, CommandError> {
    let keep = &args.keep;
    if keep.resume && keep.checkpoint.is_none() && keep.shard.is_none() {
        let message = "--resume continues a --checkpoint or a --shard: give one of them";
        return Err(CommandError::Usage(message.into()));
    }
    let shard = keep.shard.map(Shard::resolve).transpose();
    match shard.map_err(CommandError::Usage)? {
        Some([_, count]) if count > loaded.samples => Err(CommandError::Usage(format!(
            "there are more shards, {count}, than samples, {}",
            loaded.samples
        ))),
        shard => Ok(shard),
    }
}

/// Where a run is to be kept, if it is, and what was kept of it before.
pub fn kept(args: &RenderArgs, shard: Option<[u64; 2]>) -> Result<Option<Kept>, CommandError> {
    let path = keeper::path(&args.keep, &args.outputs.output, &args.scene.path, shard)?;
    path.map(|path| Kept::open(path, &args.keep)).transpose()
}

/// What keeps the run from now on, and what was kept of it before; `fitting` takes what fits.
pub fn keep<S>(
    kept: Option<Kept>,
    header: Header,
    fitting: impl Fn(&Keeper, Body) -> Result<S, CommandError>,
) -> Result<(Option<Keeper>, Option<S>), CommandError> {
    let Some(kept) = kept else {
        return Ok((None, None));
    };
    let (keeper, body) = kept.keep(header)?;
    let state = body.map(|body| fitting(&keeper, body)).transpose()?;
    Ok((Some(keeper), state))
}

/// How a report of a shard begins.
pub fn name(shard: Option<[u64; 2]>) -> String {
    shard.map_or(String::new(), |[index, count]| {
        format!("shard {index} of {count}: ")
    })
}

/// The images to write: none of a shard.
fn images(
    args: &RenderArgs,
    loaded: &Loaded,
    shard: Option<[u64; 2]>,
) -> Result<Vec<(PathBuf, ImageFormat)>, CommandError> {
    if shard.is_some() {
        return Ok(Vec::new());
    }
    let mut images = config::images(&args.outputs, &args.scene.path)?;
    check_colours(&args.outputs.output, loaded, &mut images)?;
    Ok(images)
}

/// The viewer that is to show the render, if there is one.
fn preview(args: &RenderArgs, loaded: &Loaded) -> Result<Option<Preview>, CommandError> {
    let film = loaded.scene().film();
    let open = |address: &String| {
        let canvas = Canvas {
            name: load::file_name(&args.scene.path),
            size: [film.width, film.height].map(|n| n as u32),
            channels: loaded.channel_names.clone(),
        };
        Preview::open(address, canvas)
    };
    args.tev.as_ref().map(open).transpose()
}

/// The page that is to show the render, if there is one.
fn watched(
    args: &RenderArgs,
    loaded: &Loaded,
    interrupt: &Interrupt,
) -> Result<Option<Watched>, CommandError> {
    let name = load::file_name(&args.scene.path);
    let open = || Watched::open(name, loaded.channel_names.clone(), interrupt);
    args.view.then(open).transpose()
}

/// How far a render has got, for those who watch it.
fn live_progress(progress: &Progress, goal: &ProgressGoal) -> LiveProgress {
    LiveProgress {
        done: progress.done as f64,
        total: goal.spp.map(|spp| spp as f64),
        time: goal.time,
    }
}

/// Quantities other than light have no colours: nobody gets a PNG of them.
pub fn check_colours(
    asked: &[PathBuf],
    loaded: &Loaded,
    images: &mut Vec<(PathBuf, ImageFormat)>,
) -> Result<(), CommandError> {
    let is_png = |(_, format): &(PathBuf, ImageFormat)| *format == ImageFormat::Png;
    if loaded.renderer.is_light() {
        return Ok(());
    }
    if !asked.is_empty() && images.iter().any(is_png) {
        let message = "the integrator aov has no colours to show in a PNG: write .exr or .npy";
        return Err(CommandError::Usage(message.into()));
    }
    images.retain(|image| !is_png(image));
    Ok(())
}

fn pool(threads: Option<usize>) -> Result<ThreadPool, CommandError> {
    // Zero leaves the number to rayon: that of the processors.
    let builder = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    builder
        .build()
        .map_err(|e| CommandError::Runtime(format!("cannot start threads: {e}")))
}

/// How far the render of a state has to go.
fn progress_goal(
    args: &RenderArgs,
    options: &RenderOptions,
    state: &State,
    loaded: &Loaded,
) -> ProgressGoal {
    let film = loaded.scene().film();
    ProgressGoal {
        samples_per_spp: (film.width * film.height * loaded.groups.len()) as u64,
        spp: (options.samples < u64::MAX).then_some(options.samples),
        before: state.done().count(),
        unit: "spp",
        time: args.time,
    }
}
