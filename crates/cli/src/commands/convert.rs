//! `morgana convert`.

use crate::args::ConvertArgs;
use crate::command_error::CommandError;
use crate::numbers::plain;
use crate::output::say;
use glam::{DMat3, DVec3};
use io::diagnostic::shown;
use io::volume::{Format, Options, Volume, VolumeFrame, write};
use std::path::Path;
use std::process::ExitCode;

/// Reads a volume and writes it in another format.
pub fn convert(args: &ConvertArgs) -> Result<ExitCode, CommandError> {
    check(args)?;
    let options = Options {
        axes: args.axes,
        dataset: args.dataset.as_deref(),
        limits: args.memory.limits(),
    };
    // Read double precision, in which numbers of all types remain unchanged.
    let volume = Volume::<f64>::read(&args.input, options);
    let volume = volume.map_err(|e| CommandError::Usage(e.to_string()))?;
    let mut summary = vec![
        format!("{}: {}", shown(&args.input), contents(&volume)),
        if volume.has_place() {
            place(&volume)
        } else {
            "  place     not given".into()
        },
    ];
    let volume = changed(volume, args)?;
    let stored = write(&args.output, &volume, &args.out_dataset)?;
    let volume = volume.with_element(stored.element);
    summary.push(format!("{}: {}", shown(&args.output), contents(&volume)));
    if stored.place {
        summary.push(place(&volume));
    } else if volume.has_place() {
        summary.push("  place     is not kept by this format".into());
    }
    if let Some(axes) = stored.axes {
        summary.push(format!("  axes      {axes} (axis_order, --axes)"));
    }
    if let Some(reference) = args.contrast {
        let reference = plain(reference);
        summary.push(format!(
            "  contrast  is the index less {reference} (offset)"
        ));
    }
    if stored.rounding > 0.0 {
        let most = plain(stored.rounding);
        summary.push(format!("  rounding  changes values by up to {most}"));
    }
    say(&summary.join("\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// Applies the changes that the user requests to a volume.
fn changed(mut volume: Volume<f64>, args: &ConvertArgs) -> Result<Volume<f64>, CommandError> {
    if args.spacing.is_some() || args.origin.is_some() {
        let frame = moved(&volume, args)?;
        volume = volume.with_frame(frame);
    }
    volume = volume
        .scaled(args.scale, args.offset - args.contrast.unwrap_or(0.0))
        .map_err(|e| wrong(&args.input, &e))?;
    if let Some(size) = args.resample {
        let resampled = volume.resampled(size);
        volume = resampled.map_err(|e| wrong(&args.input, &e))?;
    }
    if let Some(element) = args.kind {
        volume = volume.with_element(element);
    }
    Ok(volume)
}

/// Checks the files and the type of numbers, before anything is read.
fn check(args: &ConvertArgs) -> Result<(), CommandError> {
    let known = |path| Format::of(path).ok_or_else(|| wrong(path, &Format::unknown()));
    known(&args.input)?;
    let target = known(&args.output)?;
    if target.is_read_only() {
        return Err(wrong(&args.output, &Format::unknown()));
    }
    match args.kind {
        Some(element) if target.element(element) != element => Err(CommandError::Usage(format!(
            "{}: the format has no {element}; {} comes closest",
            shown(&args.output),
            target.element(element)
        ))),
        _ => Ok(()),
    }
}

fn wrong(path: &Path, problem: &io::Problem) -> CommandError {
    CommandError::Usage(format!("{}: {problem}", shown(path)))
}

/// Returns the frame of the samples, with the user's spacing and origin instead of the file's.
fn moved(volume: &Volume<f64>, args: &ConvertArgs) -> Result<VolumeFrame, CommandError> {
    let place = volume.has_place().then(|| volume.place());
    let steps = args.spacing.map(DMat3::from_diagonal);
    let Some(steps) = steps.or(place.map(|place| place.steps)) else {
        let message =
            "--origin needs --spacing: the file does not state the distances between its samples";
        return Err(CommandError::Usage(message.into()));
    };
    Ok(VolumeFrame {
        first: args
            .origin
            .or(place.map(|place| place.first))
            .unwrap_or_default(),
        steps,
        nodes: place.is_some_and(|place| place.nodes),
    })
}

/// Describes size, type and range of a volume.
fn contents(volume: &Volume<f64>) -> String {
    let [x, y, z] = volume.size();
    let channels = match volume.channels() {
        1 => String::new(),
        n => format!(", {n} channels"),
    };
    let element = volume.element();
    let values = || volume.data().iter().map(|v| element.nearest(*v));
    let least = values().fold(f64::INFINITY, f64::min);
    let most = values().fold(f64::NEG_INFINITY, f64::max);
    let mean = values().sum::<f64>() / volume.data().len() as f64;
    let (least, most, mean) = (plain(least), plain(most), plain(mean));
    format!(
        "{x} x {y} x {z} voxels{channels}, {element}\n  values    {least} to {most}, mean {mean}"
    )
}

/// Describes the positions of the samples.
fn place(volume: &Volume<f64>) -> String {
    let frame = volume.place();
    let unit = volume
        .unit()
        .map_or(String::new(), |unit| format!(" {unit}"));
    let numbers = |v: DVec3| v.to_array().map(plain).join(" x ");
    let turned = if frame.is_aligned() { "" } else { ", turned" };
    let samples = if frame.nodes { "nodes" } else { "centers" };
    let first = frame.first.to_array().map(plain).join(", ");
    format!(
        "  spacing   {}{unit}{turned}\n  first     ({first}){unit}; samples at {samples}",
        numbers(frame.spacing())
    )
}
