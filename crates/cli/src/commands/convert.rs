//! `morgana convert`.

use crate::args::ConvertArgs;
use crate::failure::Failure;
use crate::numbers::plain;
use glam::{DMat3, DVec3};
use io::volume::{Format, Frame, Options, Stored, Volume, write};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// Reads a volume and writes it in another format.
pub fn convert(args: &ConvertArgs) -> Result<ExitCode, Failure> {
    let known = |path| Format::of(path).ok_or_else(|| wrong(path, &Format::unknown()));
    known(&args.input)?;
    let target = known(&args.output)?;
    let options = Options {
        axes: args.axes,
        dataset: args.dataset.as_deref(),
    };
    // In double precision, so that numbers of all types pass unchanged.
    let volume = Volume::<f64>::read(&args.input, options);
    let mut volume = volume.map_err(|e| Failure::Usage(e.to_string()))?;
    let mut out = std::io::stdout();
    writeln!(out, "{}: {}", args.input.display(), describe(&volume))?;
    if args.spacing.is_some() || args.origin.is_some() {
        let frame = moved(&volume, args)?;
        volume = volume.with_frame(frame);
    }
    volume = volume
        .scaled(args.scale, args.offset)
        .map_err(|e| wrong(&args.input, &e))?;
    if let Some(size) = args.resample {
        let resampled = volume.resampled(size);
        volume = resampled.map_err(|e| wrong(&args.input, &e))?;
    }
    if let Some(element) = args.kind {
        if target.element(element) != element {
            let message = format!(
                "{}: the format has no {element}; {} comes closest",
                args.output.display(),
                target.element(element)
            );
            return Err(Failure::Usage(message));
        }
        volume = volume.with_element(element);
    }
    let has_place = has_place(&volume);
    let stored = write(&args.output, &volume, &args.out_dataset)?;
    writeln!(
        out,
        "{}: {}",
        args.output.display(),
        describe(&volume.with_element(stored.element))
    )?;
    notes(&stored, has_place, &mut out)?;
    Ok(ExitCode::SUCCESS)
}

fn wrong(path: &Path, problem: &io::Problem) -> Failure {
    Failure::Usage(format!("{}: {problem}", path.display()))
}

/// Where the samples are, as the user says rather than the file.
fn moved(volume: &Volume<f64>, args: &ConvertArgs) -> Result<Frame, Failure> {
    let place = has_place(volume).then(|| volume.place());
    let steps = args.spacing.map(DMat3::from_diagonal);
    let Some(steps) = steps.or(place.map(|place| place.steps)) else {
        let message =
            "--origin needs --spacing: the file does not say how far apart its samples are";
        return Err(Failure::Usage(message.into()));
    };
    Ok(Frame {
        first: args
            .origin
            .or(place.map(|place| place.first))
            .unwrap_or_default(),
        steps,
        nodes: place.is_some_and(|place| place.nodes),
    })
}

fn has_place(volume: &Volume<f64>) -> bool {
    volume.frame().is_some() || volume.bbox().is_some()
}

/// Size, type, range and place.
fn describe(volume: &Volume<f64>) -> String {
    let [x, y, z] = volume.size();
    let channels = match volume.channels() {
        1 => String::new(),
        n => format!(", {n} channels"),
    };
    let data = volume.data();
    let least = data.iter().copied().fold(f64::INFINITY, f64::min);
    let most = data.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mean = data.iter().sum::<f64>() / data.len() as f64;
    let (least, most, mean) = (plain(least), plain(most), plain(mean));
    format!(
        "{x} x {y} x {z} voxels{channels}, {}\n  values    {least} to {most}, mean {mean}\n{}",
        volume.element(),
        place(volume)
    )
}

fn place(volume: &Volume<f64>) -> String {
    if !has_place(volume) {
        return "  place     not given".into();
    }
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

/// What the file does not say, and what it has lost.
fn notes(stored: &Stored, has_place: bool, out: &mut impl Write) -> std::io::Result<()> {
    if let Some(axes) = stored.axes {
        writeln!(out, "  axes      {axes} (axis_order, --axes)")?;
    }
    if stored.rounding > 0.0 {
        writeln!(
            out,
            "  rounding  changes values by up to {}",
            plain(stored.rounding)
        )?;
    }
    if has_place && !stored.place {
        writeln!(out, "  place     is not kept by this format")?;
    }
    Ok(())
}
