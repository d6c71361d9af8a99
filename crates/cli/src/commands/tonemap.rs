//! `morgana tonemap`.

use crate::args::TonemapArgs;
use crate::command_error::CommandError;
use crate::config;
use io::image::ImageLayers;
use io::image::png::{self, Depth};
use std::process::ExitCode;

/// Writes an image as a screen shows it.
pub fn tonemap(args: &TonemapArgs) -> Result<ExitCode, CommandError> {
    config::picture(&args.output)?;
    let image = ImageLayers::read_within(&args.image, args.memory.limits())?;
    let image = image.focused(&args.layer);
    let image =
        image.map_err(|problem| CommandError::Usage(problem.at(&args.image).to_string()))?;
    let shown = image.on_screen().unwrap_or_default();
    png::write(&args.output, &shown, Depth::Eight, args.tone.tone())?;
    Ok(ExitCode::SUCCESS)
}
