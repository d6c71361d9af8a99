//! `morgana tonemap`.

use crate::args::{ToneArgs, TonemapArgs};
use crate::command_error::CommandError;
use crate::load::file_name;
use crate::output::say;
use crate::{config, numbers};
use io::image::ImageLayers;
use io::image::exposure::Exposure;
use std::process::ExitCode;

/// Writes an image to a PNG file for a screen.
pub fn tonemap(args: &TonemapArgs) -> Result<ExitCode, CommandError> {
    config::picture(&args.output)?;
    let image = ImageLayers::read_within(&args.image, args.memory.limits())?;
    let image = image.focused(&args.layer);
    let image =
        image.map_err(|problem| CommandError::Usage(problem.at(&args.image).to_string()))?;
    let ToneArgs { exposure, tone_map } = args.tone;
    let tone = image.write_png(&args.output, exposure, tone_map)?;
    if exposure == Exposure::Auto {
        let stops = numbers::exposure(tone.exposure);
        say(&format!("{}: {stops}", file_name(&args.output)))?;
    }
    Ok(ExitCode::SUCCESS)
}
