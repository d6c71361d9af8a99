//! Writing what a render has found.

use crate::args::{OutputArgs, ToneArgs};
use crate::command_error::{CommandError, show};
use crate::config::ImageFormat;
use crate::measured::Measured;
use crate::report::Report;
use io::arrays::{ArrayFormat, Context, arrays};
use io::image::exposure::Exposure;
use io::image::exr;
use io::rendered::{self, Picture};
use io::{Diagnostic, Diagnostics, FileError};
use serde_json::Value;
use std::io::Write;
use std::path::PathBuf;

/// Writes every file of a picture that can be written before complaining of those that cannot. Returns the exposure of PNG
/// files, in stops, if it was chosen for the picture.
pub fn write_images(
    args: &OutputArgs,
    images: &[(PathBuf, ImageFormat)],
    report: &Report,
) -> Result<Option<f64>, CommandError> {
    let names = &report.run.loaded.channel_names;
    let picture = Picture::new(report.rendering, report.run.loaded, report.attributes());
    let is_shown = images.iter().any(|(_, f)| *f == ImageFormat::Png);
    let ToneArgs { exposure, tone_map } = args.tone;
    let tone = is_shown.then(|| picture.tone(exposure, tone_map));
    let images = images.iter().map(|(path, format)| match format {
        ImageFormat::Exr => picture.write_exr(path),
        ImageFormat::Npy => picture.write_npy(path),
        ImageFormat::Png => picture.write_png(path, tone.unwrap_or_default()),
    });
    let strategies = args.strategies.iter().map(|path| {
        let image = rendered::strategies(report.rendering, names, report.attributes());
        exr::write(path, &image)
    });
    let stats = stats(args, || report.json());
    failures(images.chain(strategies).chain(stats))?;
    let chosen = tone.filter(|_| exposure == Exposure::Auto);
    Ok(chosen.map(|tone| tone.exposure))
}

/// Writes every file of readings that can be written before complaining of those that cannot.
pub fn write_readings(
    args: &OutputArgs,
    files: &[(PathBuf, ArrayFormat)],
    measured: &Measured,
) -> Result<(), CommandError> {
    let context = Context {
        instruments: &measured.loaded.instruments,
        measurement: measured.measurement,
        channels: &measured.loaded.channel_names,
    };
    let readings = arrays(&context, measured.attributes());
    let readings = files
        .iter()
        .map(|(path, format)| readings.write(path, *format));
    failures(readings.chain(stats(args, || measured.json())))
}

/// Says which meters have received nothing.
pub fn warn_of_dark(measured: &Measured) {
    let mut warnings = Diagnostics::new();
    for name in measured.dark() {
        let message = format!("the meter '{name}' received no light");
        let help = "check where it is, and whether light can get there".to_owned();
        warnings.push(Diagnostic::warning(message).help(help));
    }
    show(&warnings);
}

/// Writes the statistics alone, if they are asked for.
pub fn write_stats(args: &OutputArgs, json: impl Fn() -> Value) -> Result<(), CommandError> {
    failures(stats(args, json))
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
