//! Files of results, and messages about them.

use crate::args::{OutputArgs, ToneArgs};
use crate::command_error::{CommandError, show};
use crate::config::{self, ImageFormat, ReadingFiles};
use crate::report::Report;
use io::arrays::{Context, arrays};
use io::diagnostic::shown;
use io::image::exposure::Exposure;
use io::image::exr;
use io::rendered::{self, Picture};
use io::{Diagnostic, Diagnostics, FileError, Loaded, Outcome};
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use transport::render::{Measurement, Rendering};

/// Files that a run writes, besides its statistics.
#[derive(Debug)]
pub enum Files {
    /// Images of a picture and of its strategies.
    Images(Vec<(PathBuf, ImageFormat)>),
    /// Arrays of readings.
    Readings(ReadingFiles),
    /// No files: a shard is stored as a part.
    Shard,
}

impl Files {
    /// Returns the files that a command requests, or by default files named after the scene. Checks
    /// that they can be written, as far as possible in advance.
    pub fn of(args: &OutputArgs, scene: &Path, loaded: &Loaded) -> Result<Self, CommandError> {
        if !loaded.instruments.is_empty() {
            let readings = config::readings(args, scene, &loaded.instruments)?;
            return Ok(Files::Readings(readings));
        }
        let mut images = config::images(args, scene)?;
        check_colours(&args.output, loaded, &mut images)?;
        Ok(Files::Images(images))
    }

    /// Returns the paths of the files, except files of strategies.
    pub fn paths(&self) -> Vec<PathBuf> {
        match self {
            Files::Images(images) => images.iter().map(|(path, _)| path.clone()).collect(),
            Files::Readings(readings) => readings.paths(),
            Files::Shard => Vec::new(),
        }
    }

    /// Returns the line that names all files of a run, with its checkpoint or the part of its shard.
    pub fn wrote(&self, args: &OutputArgs, part: Option<&Path>) -> String {
        let results = self.paths();
        let others = args.strategies.iter().chain(&args.stats);
        let paths = results.iter().chain(others).map(PathBuf::as_path);
        let names: Vec<_> = paths.chain(part).map(shown).collect();
        format!("wrote {}", names.join(", "))
    }

    /// Writes every file that can be written, and then reports those that cannot. Returns the text
    /// for the end of the run.
    pub fn write(
        &self,
        args: &OutputArgs,
        report: &Report<Outcome>,
    ) -> Result<String, CommandError> {
        match report.result {
            Outcome::Picture(rendering) => {
                let report = report.of(&**rendering);
                let exposure = match self {
                    Files::Images(images) => write_images(args, images, &report)?,
                    _ => failures(stats(args, || report.json())).map(|()| None)?,
                };
                Ok(report.line(exposure))
            }
            Outcome::Readings(measurement) => {
                let report = report.of(&**measurement);
                match self {
                    Files::Readings(files) => write_readings(args, files, &report)?,
                    _ => failures(stats(args, || report.json()))?,
                }
                if !args.quiet {
                    warn_of_dark(&report);
                }
                Ok(report.text())
            }
        }
    }
}

/// Refuses requested PNG files of quantities other than light, which have no colours. Leaves
/// default PNG files out.
fn check_colours(
    asked: &[PathBuf],
    loaded: &Loaded,
    images: &mut Vec<(PathBuf, ImageFormat)>,
) -> Result<(), CommandError> {
    let is_png = |(_, format): &(PathBuf, ImageFormat)| *format == ImageFormat::Png;
    if loaded.renderer.is_light() {
        return Ok(());
    }
    if !asked.is_empty() && images.iter().any(is_png) {
        let message = "the integrator aov has no colours for a PNG file: write .exr or .npy";
        return Err(CommandError::Usage(message.into()));
    }
    images.retain(|image| !is_png(image));
    Ok(())
}

/// Writes a picture and its statistics. Returns the exposure of PNG files in stops, if it was
/// chosen automatically.
fn write_images(
    args: &OutputArgs,
    images: &[(PathBuf, ImageFormat)],
    report: &Report<Rendering>,
) -> Result<Option<f64>, CommandError> {
    let names = &report.run.loaded.channel_names;
    let picture = Picture::new(report.result, report.run.loaded, report.attributes());
    let is_shown = images.iter().any(|(_, f)| *f == ImageFormat::Png);
    let ToneArgs { exposure, tone_map } = args.tone;
    let tone = is_shown.then(|| picture.tone(exposure, tone_map));
    let images = images.iter().map(|(path, format)| match format {
        ImageFormat::Exr => picture.write_exr(path),
        ImageFormat::Npy => picture.write_npy(path),
        ImageFormat::Png => picture.write_png(path, tone.unwrap_or_default()),
    });
    let strategies = args.strategies.iter().map(|path| {
        let image = rendered::strategies(report.result, names, report.attributes());
        exr::write(path, &image)
    });
    let stats = stats(args, || report.json());
    failures(images.chain(strategies).chain(stats))?;
    let chosen = tone.filter(|_| exposure == Exposure::Auto);
    Ok(chosen.map(|tone| tone.exposure))
}

/// Writes readings and their statistics.
fn write_readings(
    args: &OutputArgs,
    to: &ReadingFiles,
    report: &Report<Measurement>,
) -> Result<(), CommandError> {
    let loaded = report.run.loaded;
    let context = Context {
        instruments: &loaded.instruments,
        measurement: report.result,
        channels: &loaded.channel_names,
        meter: to.meter,
    };
    let readings = arrays(&context, report.attributes());
    let readings =
        (to.files.iter()).map(|(path, format)| readings.write(path, *format, to.element));
    failures(readings.chain(stats(args, || report.json())))
}

/// Warns about meters that received no light.
fn warn_of_dark(report: &Report<Measurement>) {
    let mut warnings = Diagnostics::new();
    for name in report.dark() {
        let message = format!("the meter '{name}' received no light");
        let help = "check its position, and that light can reach it".to_owned();
        warnings.push(Diagnostic::warning(message).help(help));
    }
    show(&warnings);
}

fn stats(
    args: &OutputArgs,
    json: impl Fn() -> Value,
) -> impl Iterator<Item = Result<(), FileError>> {
    let paths = args.stats.iter();
    paths.map(move |path| io::atomic::write(path, |file| writeln!(file, "{:#}", json())))
}

fn failures(results: impl Iterator<Item = Result<(), FileError>>) -> Result<(), CommandError> {
    let failed = results.filter_map(Result::err).map(|e| e.to_string());
    let failed: Vec<String> = failed.collect();
    if failed.is_empty() {
        Ok(())
    } else {
        Err(CommandError::Runtime(failed.join("\n")))
    }
}
