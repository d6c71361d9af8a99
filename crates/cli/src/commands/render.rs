//! `morgana render`.

use super::measure::measure;
use crate::args::RenderArgs;
use crate::config::ImageFormat;
use crate::failure::Failure;
use crate::preview::{Canvas, Preview};
use crate::progress::{self, Goal};
use crate::report::{Report, Stopped};
use crate::{config, interrupt, load, numbers, outputs};
use io::image::tone::Tone;
use io::rendered::Naming;
use io::{Loaded, rendered};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;
use transport::integrator::Integrator;
use transport::render::{Options, Rendering, Target, memory, render_counted};

/// Renders a scene and writes its images.
pub fn render(args: &RenderArgs) -> Result<ExitCode, Failure> {
    let pool = pool(args.threads)?;
    let loaded = load::load(
        &args.scene,
        args.integrator.as_deref(),
        args.spp.or(args.particles),
    )?;
    if !loaded.instruments.is_empty() {
        return measure(args, &loaded, &pool);
    }
    if args.particles.is_some() {
        let message = "--particles is for scenes with meters; for a camera it is --spp";
        return Err(Failure::Usage(message.into()));
    }
    let mut images = config::images(args)?;
    if !args.quiet {
        load::warn(&loaded);
    }
    check_strategies(args, &loaded)?;
    check_colours(args, &loaded, &mut images)?;
    check_target(args, &loaded)?;
    check_memory(args, &loaded)?;
    let mut preview = preview(args, &loaded)?;
    let interrupted = interrupt::watch()?;
    // Other limits replace the scene's number of samples, but not that of the command line.
    let requested = match (args.time, args.target_error) {
        (None, None) => Some(loaded.samples),
        _ => args.spp.map(|_| loaded.samples),
    };
    let started = Instant::now();
    let (rendering, stopped) = run(
        args,
        &loaded,
        requested,
        &pool,
        &interrupted,
        preview.as_mut(),
    );
    let report = Report {
        args,
        loaded: &loaded,
        rendering: &rendering,
        requested,
        elapsed: started.elapsed(),
        threads: pool.current_num_threads(),
        stopped,
    };
    let written = write(args, &images, &report);
    if let Some(preview) = preview {
        preview.finish(&rendering.film);
    }
    written?;
    if !args.quiet {
        writeln!(std::io::stdout(), "{}", report.line())?;
    }
    Ok(match stopped {
        Some(Stopped::Interrupted) => ExitCode::from(interrupt::STATUS),
        _ => ExitCode::SUCCESS,
    })
}

/// Writes every file that can be written before complaining of those that cannot.
fn write(
    args: &RenderArgs,
    images: &[(PathBuf, ImageFormat)],
    report: &Report,
) -> Result<(), Failure> {
    let names = &report.loaded.channel_names;
    let film = &report.rendering.film;
    let mut image = rendered::layers(film, names, report.attributes());
    image.layers.extend(rendered::bias(report.rendering, names));
    if images.iter().any(|(_, format)| *format == ImageFormat::Exr) {
        rendered::extend(&mut image, film, report.loaded);
    }
    let images = images
        .iter()
        .map(|(path, format)| match (format, Naming::of(report.loaded)) {
            (ImageFormat::Npy, Some(naming)) => naming.write_array(path, film),
            _ => outputs::write(path, *format, &image, args.tone.tone()),
        });
    let strategies = args.strategies.iter().map(|path| {
        let image = rendered::strategies(report.rendering, names, report.attributes());
        outputs::write(path, ImageFormat::Exr, &image, Tone::default())
    });
    let stats = args
        .stats
        .iter()
        .map(|path| io::atomic::write(path, |file| writeln!(file, "{:#}", report.json())));
    let failed: Vec<String> = images
        .chain(strategies)
        .chain(stats)
        .filter_map(Result::err)
        .map(|e| e.to_string())
        .collect();
    match failed.is_empty() {
        true => Ok(()),
        false => Err(Failure::Runtime(failed.join("\n"))),
    }
}

/// The viewer that is to show the render, if there is one.
fn preview(args: &RenderArgs, loaded: &Loaded) -> Result<Option<Preview>, Failure> {
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

/// Only an estimator with several strategies can show them.
fn check_strategies(args: &RenderArgs, loaded: &Loaded) -> Result<(), Failure> {
    if args.strategies.is_none() || loaded.integrator.splats() {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "--strategies needs the integrator bdpt or particle: {} has one strategy only",
        loaded.integrator.name()
    )))
}

/// Quantities other than light have no colours: nobody gets a PNG of them.
fn check_colours(
    args: &RenderArgs,
    loaded: &Loaded,
    images: &mut Vec<(PathBuf, ImageFormat)>,
) -> Result<(), Failure> {
    let is_png = |(_, format): &(PathBuf, ImageFormat)| *format == ImageFormat::Png;
    if !matches!(loaded.integrator, Integrator::Aov(_)) {
        return Ok(());
    }
    if !args.output.is_empty() && images.iter().any(is_png) {
        let message = "the integrator aov has no colours to show in a PNG: write .exr or .npy";
        return Err(Failure::Usage(message.into()));
    }
    images.retain(|image| !is_png(image));
    Ok(())
}

/// A bias that does not shrink may keep a render from ever reaching its target.
fn check_target(args: &RenderArgs, loaded: &Loaded) -> Result<(), Failure> {
    let endless = args.target_error.is_some() && args.spp.is_none() && args.time.is_none();
    if !endless || loaded.integrator.converges() {
        return Ok(());
    }
    Err(Failure::Usage(
        "--target-error may never be reached by the integrator photon, whose bias does not shrink: use sppm, or \
         set a limit by --spp or --time"
            .into(),
    ))
}

/// A film that does not fit into memory would end the program without a word.
fn check_memory(args: &RenderArgs, loaded: &Loaded) -> Result<(), Failure> {
    let film = loaded.scene().film();
    let bytes = memory(film, &options(args, loaded));
    let message = |_| {
        let (width, height) = (film.width, film.height);
        let layers = Naming::of(loaded).map(|n| format!(" with {}", n.describe()));
        let strategies = args.strategies.is_some().then_some(" with --strategies");
        Failure::Runtime(format!(
            "a film of {width} × {height} pixels{}{} needs {} of memory",
            layers.unwrap_or_default(),
            strategies.unwrap_or_default(),
            numbers::bytes(bytes)
        ))
    };
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(message)
}

/// How a scene is to be rendered.
fn options(args: &RenderArgs, loaded: &Loaded) -> Options {
    Options {
        strategies: args.strategies.is_some(),
        decomposition: loaded.layering.decomposition,
        reweight: loaded.reweight,
        target: args.target_error.map(|error| Target {
            error,
            measure: args.target.unwrap_or_default(),
        }),
        ..Options::new(loaded.integrator, loaded.samples, args.seed)
    }
}

fn pool(threads: Option<usize>) -> Result<ThreadPool, Failure> {
    // Zero leaves the number to rayon: that of the processors.
    let builder = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    builder
        .build()
        .map_err(|e| Failure::Runtime(format!("cannot start threads: {e}")))
}

fn run(
    args: &RenderArgs,
    loaded: &Loaded,
    requested: Option<u64>,
    pool: &ThreadPool,
    interrupted: &AtomicBool,
    mut preview: Option<&mut Preview>,
) -> (Rendering, Option<Stopped>) {
    let film = loaded.scene().film();
    let goal = Goal {
        samples_per_spp: (film.width * film.height * loaded.groups.len()) as u64,
        spp: requested,
        unit: "spp",
        time: args.time,
    };
    let options = Options {
        samples: requested.unwrap_or(u64::MAX),
        ..options(args, loaded)
    };
    let (counter, started) = (AtomicU64::new(0), Instant::now());
    let mut stopped = None;
    let rendering = std::thread::scope(|scope| {
        let _drawing = (!args.quiet).then(|| progress::draw(scope, goal, &counter, interrupted));
        pool.install(|| {
            render_counted(&loaded.groups, &options, &counter, |progress| {
                if let Some(preview) = &mut preview {
                    preview.update(progress.film);
                }
                if interrupted.load(Ordering::Relaxed) {
                    stopped = Some(Stopped::Interrupted);
                } else if args.time.is_some_and(|t| started.elapsed() >= t) {
                    stopped = Some(Stopped::Time);
                }
                match stopped {
                    Some(_) if progress.done < progress.total => ControlFlow::Break(()),
                    _ => ControlFlow::Continue(()),
                }
            })
        })
    });
    let stopped = stopped.or(rendering.reached.then_some(Stopped::Target));
    (rendering, stopped)
}
