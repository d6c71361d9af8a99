//! `morgana compare`.

use crate::args::CompareArgs;
use crate::command_error::CommandError;
use crate::config;
use crate::difference::{Difference, map};
use io::compare::compare as differences;
use io::compare::flip::flip;
use io::image::{ImageLayers, RgbImage};
use io::{FileError, Problem};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// Exit status if a limit is exceeded, as for `cmp` and `diff`.
const DIFFERENT: u8 = 1;

/// Compares an image with a reference.
pub fn compare(args: &CompareArgs) -> Result<ExitCode, CommandError> {
    let map_format = config::map(args.map.as_deref())?;
    let zmap_format = config::map(args.zmap.as_deref())?;
    // Status 1 means that images differ: failures need another status.
    let fail = |e: FileError| CommandError::Usage(e.to_string());
    let layer = args.reference_layer.as_ref().unwrap_or(&args.layer);
    let [image, reference] = [(&args.image, &args.layer), (&args.reference, layer)]
        .map(|(path, layer)| read(path, layer, args.memory.limits()).map_err(fail));
    let (image, reference) = (image?, reference?);
    let at = |problem: Problem| fail(problem.at(&args.reference));
    let numbers = differences(&image, &reference, args.block).map_err(at)?;
    let flip = flip(&exposed(&image, args), &exposed(&reference, args)).map_err(at)?;
    if numbers.z.is_none() && (args.zmap.is_some() || args.limits.max_z.is_some()) {
        let message = "--zmap and --max-z need standard errors: give two .exr files of renders, which have variances";
        return Err(CommandError::Usage(message.into()));
    }
    let difference = Difference {
        args,
        images: [&image, &reference],
        numbers: &numbers,
        flip: &flip,
    };
    let size = [image.width, image.height];
    if let (Some(path), Some(format)) = (&args.map, map_format) {
        map::flip(path, format, size, &flip).map_err(fail)?;
    }
    if let (Some(path), Some(format), Some(z)) = (&args.zmap, zmap_format, &numbers.z) {
        map::z(path, format, size, z).map_err(fail)?;
    }
    let text = if args.json {
        format!("{:#}\n", difference.json())
    } else {
        difference.text()
    };
    std::io::stdout().write_all(text.as_bytes())?;
    Ok(if difference.exceeded().is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(DIFFERENT)
    })
}

fn read(path: &Path, layer: &str, limits: io::Limits) -> Result<ImageLayers, FileError> {
    let image = ImageLayers::read_within(path, limits)?;
    image.focused(layer).map_err(|problem| problem.at(path))
}

/// Returns the colours for a screen, before bright values are clipped.
fn exposed(image: &ImageLayers, args: &CompareArgs) -> RgbImage {
    let gain = args.exposure.exp2() as f32;
    let mut shown = image.on_screen().unwrap_or_default();
    shown.pixels.iter_mut().flatten().for_each(|v| *v *= gain);
    shown
}
