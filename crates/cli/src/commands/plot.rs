//! `morgana plot`.

use crate::args::{FigureArgs, PlotArgs};
use crate::command_error::CommandError;
use crate::plot::{
    Figure, Format, ProfileLine, Section, convergence, histogram, picture, profile, slice, write,
};
use io::diagnostic::shown;
use std::path::Path;
use std::process::ExitCode;

/// Draws a figure.
pub fn plot(args: &PlotArgs) -> Result<ExitCode, CommandError> {
    let limits = args.memory.limits();
    let (figure, output) = match &args.figure {
        FigureArgs::Profile {
            images,
            row,
            column,
            layer,
            channel,
            output,
        } => {
            let line = row
                .map(ProfileLine::Row)
                .or(column.map(ProfileLine::Column));
            let line = line.unwrap_or(ProfileLine::Row(0));
            (
                Figure::Curves(profile(images, line, layer, channel.as_deref(), limits)?),
                output,
            )
        }
        FigureArgs::Histogram {
            images,
            pixel,
            channel,
            output,
        } => {
            let curves = histogram(images, *pixel, channel.as_deref(), limits)?;
            (Figure::Curves(curves), output)
        }
        FigureArgs::Image {
            image,
            layer,
            channel,
            log,
            output,
        } => {
            let map = picture(image, layer, channel.as_deref(), *log, limits)?;
            (Figure::Map(map), output)
        }
        FigureArgs::Slice {
            readings,
            axis,
            at,
            array,
            bins,
            log,
            output,
        } => {
            let section = Section {
                array: array.as_deref(),
                axis,
                at: *at,
                bins,
                logarithmic: *log,
            };
            (Figure::Map(slice(readings, section)?), output)
        }
        FigureArgs::Convergence { stats, output } => (Figure::Curves(convergence(stats)?), output),
    };
    write(output, format(output)?, &figure)?;
    Ok(ExitCode::SUCCESS)
}

fn format(path: &Path) -> Result<Format, CommandError> {
    let extension = path.extension().and_then(|e| e.to_str());
    match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("svg") => Ok(Format::Svg),
        Some("png") => Ok(Format::Png),
        _ => Err(CommandError::Usage(format!(
            "'{}': unknown format; write a figure to .svg or .png",
            shown(path)
        ))),
    }
}
