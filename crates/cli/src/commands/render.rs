//! `morgana render`.

use crate::args::RenderArgs;
use crate::command_error::{CommandError, warn};
use crate::driver::{Driver, TimeLimit};
use crate::interrupt::Interrupt;
use crate::job::Job;
use crate::keeper::{self, PartFile};
use crate::output::say;
use crate::preview::{Canvas, Preview};
use crate::progress::ProgressGoal;
use crate::report::Report;
use crate::results::Files;
use crate::shard::Shard;
use crate::watched::Watched;
use crate::{load, overwrites};
use io::clock::Stopped;
use io::image::exposure::Exposure;
use io::part::{Body, BodyRef, Header};
use io::{Loaded, Outcome, Run};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use view::LiveProgress;

/// Renders a scene, or reads its meters, and writes the result or its part. Choices that are left
/// open follow an earlier run, if there is one in `chosen`. Afterwards `chosen` contains the
/// choices.
pub fn render_once(
    args: &RenderArgs,
    chosen: &mut Option<Header>,
    interrupt: &Interrupt,
) -> Result<ExitCode, CommandError> {
    let time = TimeLimit::start(args.stopping.time);
    let pool = pool(args.machines.threads)?;
    let job = Job::of(args);
    let limits = args.scene.memory.limits();
    let watched = watched(args, interrupt)?;
    let loaded = job.load_in_time(limits, &time, interrupt)?;
    let shard = shard(args, &loaded)?;
    let driver = Driver {
        pool: &pool,
        interrupt,
        quiet: args.outputs.quiet,
    };
    check_kind(args, &loaded)?;
    let files = match shard {
        None => Files::of(&args.outputs, &args.scene.path, &loaded)?,
        Some(_) => Files::Shard,
    };
    overwrites::check_read(&files.paths(), &loaded.files)?;
    if !args.outputs.quiet {
        load::warn(&loaded);
    }
    // A time or a target error replaces the scene's number of samples, but not the number on the
    // command line.
    let requested = match (args.stopping.time, args.stopping.target_error, shard) {
        (None, None, _) | (.., Some(_)) => Some(loaded.samples),
        _ => args
            .sampling
            .spp
            .or(args.sampling.particles)
            .map(|_| loaded.samples),
    };
    let mut run = Run {
        total: requested,
        shard,
        time: time.left(),
        ..job.run(&loaded)
    };
    let reason = run.choose_device(job.device)?;
    if let Some(reason) = reason.filter(|_| !args.outputs.quiet) {
        say(&reason)?;
    }
    let started = Instant::now();
    run.check(limits)?;
    let path = keeper::path(
        &args.machines.keep,
        &args.outputs.output,
        &args.scene.path,
        shard,
    )?;
    let kept = path
        .clone()
        .map(|path| PartFile::open(path, &args.machines.keep))
        .transpose()?;
    match kept.as_ref().and_then(PartFile::header).or(chosen.as_ref()) {
        Some(header) => run.choose_as(header),
        None if driver.choose(&mut run).is_break() => {
            warn("interrupted before the first sample: no file was written");
            return Ok(interrupt.status());
        }
        None => {}
    }
    if !run.has_meters() {
        run.check(limits)?;
    }
    let header = chosen.insert(job.header(&run)).clone();
    let kept = kept.map(|kept| kept.keep(header, &run)).transpose()?;
    let (mut keeper, body) = kept.unzip();
    let mut preview = preview(args, &loaded)?;
    let mut body = body.flatten().map_or_else(|| run.start(), Ok)?;
    // The choice of the integrator counts towards the time, too.
    let goal = progress_goal(&run, &body, time.left());
    let (advanced, stopped) = driver.drive(goal, |handle, clock| {
        run.advance(&mut body, handle, clock, |body| {
            if let (Some(preview), Some(film)) = (&mut preview, body.film()) {
                preview.update(film);
            }
            if let (Some(watched), Some(film)) = (&watched, body.film()) {
                watched.update(film, &loaded.channel_names, live_progress(body, &goal));
            }
            if let Some(keeper) = &mut keeper {
                keeper.update(body);
            }
        })
    });
    advanced?;
    let stopped = stopped.or(body.reached().then_some(Stopped::Target));
    let saved = keeper
        .iter_mut()
        .try_for_each(|k| k.save(BodyRef::of(&body)));
    let outcome = run.finish(body)?;
    let report = Report {
        job: &job,
        run: &run,
        result: &outcome,
        requested,
        elapsed: keeper.map_or(started.elapsed(), |k| k.elapsed()),
        threads: Some(pool.current_num_threads()),
        stopped,
    };
    let written = files.write(&args.outputs, &report);
    if let (Some(preview), Outcome::Picture(rendering)) = (preview, &outcome) {
        preview.finish(&rendering.film);
    }
    let text = written?;
    saved?;
    if !args.outputs.quiet {
        let wrote = files.wrote(&args.outputs, path.as_deref());
        say(&format!("{}{text}\n{wrote}", name(shard)))?;
    }
    if let (Some(watched), Outcome::Picture(rendering)) = (watched, &outcome) {
        watched.finish(&rendering.film, &loaded.channel_names);
    }
    Ok(match stopped {
        Some(Stopped::Interrupted) => interrupt.status(),
        _ => ExitCode::SUCCESS,
    })
}

/// Returns the index of the requested part of the samples and the number of parts, if any.
fn shard(args: &RenderArgs, loaded: &Loaded) -> Result<Option<[u64; 2]>, CommandError> {
    let keep = &args.machines.keep;
    if keep.resume && keep.checkpoint.is_none() && keep.shard.is_none() {
        let message = "--resume needs --checkpoint or --shard: give one of them";
        return Err(CommandError::Usage(message.into()));
    }
    let shard = keep.shard.map(Shard::resolve).transpose();
    match shard.map_err(CommandError::Usage)? {
        Some([_, count]) if count > loaded.samples => Err(CommandError::Usage(format!(
            "{count} shards are more than the {} samples: use fewer shards",
            loaded.samples
        ))),
        shard => Ok(shard),
    }
}

/// Returns the beginning of a shard's report.
fn name(shard: Option<[u64; 2]>) -> String {
    shard.map_or(String::new(), |[index, count]| {
        format!("shard {index} of {count}: ")
    })
}

/// Opens the viewer that shows the render, if requested.
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
    args.live.tev.as_ref().map(open).transpose()
}

/// Opens the page that shows the render, if requested.
fn watched(args: &RenderArgs, interrupt: &Interrupt) -> Result<Option<Watched>, CommandError> {
    let name = load::file_name(&args.scene.path);
    let open = || Watched::open(name, args.live.open, interrupt);
    args.live.view.then(open).transpose()
}

/// Returns the progress of a render, for display on the page.
fn live_progress(body: BodyRef, goal: &ProgressGoal) -> LiveProgress {
    LiveProgress {
        done: body.done().count() as f64,
        total: goal.spp.map(|spp| spp as f64),
        time: goal.time,
    }
}

fn pool(threads: Option<usize>) -> Result<ThreadPool, CommandError> {
    // With zero, rayon starts a thread per CPU.
    let builder = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    builder
        .build()
        .map_err(|e| CommandError::Runtime(format!("cannot start threads: {e}")))
}

/// Returns the goal of a run's progress bar: samples or particles, or the time.
fn progress_goal(run: &Run, body: &Body, time: Option<Duration>) -> ProgressGoal {
    let film = run.loaded.scene().film();
    let (places, unit) = if run.has_meters() {
        (1, "particles")
    } else {
        (film.width * film.height, "spp")
    };
    let samples = run.options().samples;
    ProgressGoal {
        samples_per_spp: (places * run.loaded.groups.len()) as u64,
        spp: (samples < u64::MAX).then_some(samples),
        before: body.done().count(),
        unit,
        time,
    }
}

/// Refuses options for pictures if the scene has meters, and options for meters if it has a camera.
fn check_kind(args: &RenderArgs, loaded: &Loaded) -> Result<(), CommandError> {
    if loaded.instruments.is_empty() {
        if args.sampling.particles.is_some() {
            let message =
                "--particles is for scenes with meters, but the scene has a camera: use --spp";
            return Err(CommandError::Usage(message.into()));
        }
        return Ok(());
    }
    let wrong = [
        (args.sampling.spp.is_some(), "--spp", ": use --particles"),
        (
            args.sampling.integrator.is_some(),
            "--integrator",
            ": leave it out, because meters always use particles",
        ),
        (args.sampling.sampler.is_some(), "--sampler", ""),
        (args.sampling.adaptive, "--adaptive", ""),
        (args.outputs.strategies.is_some(), "--strategies", ""),
        (args.stopping.target_error.is_some(), "--target-error", ""),
        (
            args.outputs.tone.exposure != Exposure::Auto,
            "--exposure",
            "",
        ),
        (args.live.tev.is_some(), "--tev", ""),
        (args.live.view, "--view", ""),
    ];
    match wrong.iter().find(|(given, ..)| *given) {
        Some((_, option, why)) => Err(CommandError::Usage(format!(
            "{option} is for pictures, but the scene has meters instead of a camera{why}"
        ))),
        None => Ok(()),
    }
}
