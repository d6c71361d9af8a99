//! `morgana denoise`.

use crate::args::{DenoiseArgs, ToneArgs};
use crate::command_error::{CommandError, warn};
use crate::load::file_name;
use crate::oidn::Oidn;
use crate::output::say;
use crate::{config, numbers};
use io::image::denoised::{ChangedFractions, DenoiseOptions, Denoising};
use io::image::exposure::Exposure;
use io::image::{ImageLayers, exr};
use std::process::ExitCode;

/// Writes the denoised image, and reports how far values moved.
pub fn denoise(args: &DenoiseArgs) -> Result<ExitCode, CommandError> {
    let files = config::denoised(&args.output)?;
    let image = ImageLayers::read_within(&args.image, args.memory.limits())?;
    let usage = |problem: io::Problem| CommandError::Usage(problem.at(&args.image).to_string());
    let options = DenoiseOptions {
        layer: args.layer.clone(),
        albedo: args.albedo.clone(),
        normal: args.normal.clone(),
        errors: None,
        usual_guides: !args.no_guides,
    };
    let denoising = Denoising::new(image, &options).map_err(usage)?;
    let mut oidn = Oidn::new(args.oidn.as_deref(), args.memory.limits())?;
    for (option, guide) in [("--alb", &denoising.albedo), ("--nrm", &denoising.normal)] {
        if let Some(guide) = guide {
            oidn.guide(option, &guide.image)?;
        }
    }
    let parts = denoising.parts.iter();
    let answers: Result<Vec<_>, _> = parts.map(|part| oidn.denoise(&part.image)).collect();
    let guides = denoising.guides();
    let by = "Open Image Denoise (oidnDenoise --hdr)";
    let found = denoising.finish(&answers?, by).map_err(usage)?;
    let mut shown = None;
    for (path, format) in &files {
        match format {
            config::ImageFormat::Png => {
                let focused = found.image.clone().focused(io::image::denoised::LAYER);
                let ToneArgs { exposure, tone_map } = args.tone;
                let tone = focused.map_err(usage)?.write_png(path, exposure, tone_map);
                shown = Some(tone?.exposure).filter(|_| exposure == Exposure::Auto);
            }
            _ => exr::write(path, &found.image)?,
        }
    }
    if !args.quiet {
        let mut parts = vec![format!("denoised {guides}")];
        parts.extend(moved(found.moved));
        parts.extend(shown.filter(|stops| *stops != 0.0).map(numbers::exposure));
        say(&parts.join(" · "))?;
        if found.moved.is_none() {
            warn(&format!(
                "'{}' has no variances, so the change has no standard errors: use the .exr file of a render",
                file_name(&args.image)
            ));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Describes in a few words how far values moved.
fn moved(moved: Option<ChangedFractions>) -> Vec<String> {
    let Some(moved) = moved else {
        return Vec::new();
    };
    let mut parts = vec![format!(
        "{} of the values moved by more than 3 standard errors",
        numbers::percent(moved.beyond_three)
    )];
    if moved.unknown > 0.0 {
        let unknown = numbers::percent(moved.unknown);
        parts.push(format!("{unknown} moved, but have no standard error"));
    }
    parts
}
