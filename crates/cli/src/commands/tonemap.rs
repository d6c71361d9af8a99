//! `morgana tonemap`.

use crate::args::{ToneArgs, TonemapArgs};
use crate::command_error::CommandError;
use crate::load::file_name;
use crate::output::say;
use crate::{config, numbers};
use io::image::ImageLayers;
use io::image::exposure::Exposure;
use io::image::white::White;
use std::process::ExitCode;

/// Writes an image to a PNG file for a screen.
pub fn tonemap(args: &TonemapArgs) -> Result<ExitCode, CommandError> {
    config::picture(&args.output)?;
    let image = ImageLayers::read_within(&args.image, args.memory.limits())?;
    let image = image.focused(&args.layer);
    let image =
        image.map_err(|problem| CommandError::Usage(problem.at(&args.image).to_string()))?;
    let white = match args.neutral {
        Some(pixel) => Some(neutral(&image, pixel)?),
        None => args.white,
    };
    let image = match white {
        Some(white) => image.balanced(white),
        None => image,
    };
    let ToneArgs { exposure, tone_map } = args.tone;
    let tone = image.write_png(&args.output, exposure, tone_map)?;
    if exposure == Exposure::Auto {
        let stops = numbers::exposure(tone.exposure);
        say(&format!("{}: {stops}", file_name(&args.output)))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the white for which a pixel looks neutral.
fn neutral(image: &ImageLayers, [x, y]: [usize; 2]) -> Result<White, CommandError> {
    let shown = image.on_screen().unwrap_or_default();
    if x >= shown.width || y >= shown.height {
        return Err(CommandError::Usage(format!(
            "--neutral {x},{y}: the image has {} × {} pixels",
            shown.width, shown.height
        )));
    }
    let rgb = shown.pixels[y * shown.width + x];
    White::of_colour(rgb.map(f64::from)).ok_or_else(|| {
        CommandError::Usage(format!(
            "--neutral {x},{y}: the pixel's red, green and blue are {}, {}, {}, but must be above 0; choose a brighter pixel",
            rgb[0], rgb[1], rgb[2]
        ))
    })
}
