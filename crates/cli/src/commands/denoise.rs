//! `morgana denoise`.

use crate::args::{DenoiseArgs, ToneArgs};
use crate::command_error::{CommandError, warn};
use crate::load::file_name;
use crate::oidn::Oidn;
use crate::output::say;
use crate::{config, numbers};
use io::image::denoised::{ALBEDOS, DENOISED, Moved, NORMALS};
use io::image::exposure::Exposure;
use io::image::{ImageLayers, RgbImage, exr};
use std::process::ExitCode;

/// Writes what a denoiser makes of an image, and how far it moved it.
pub fn denoise(args: &DenoiseArgs) -> Result<ExitCode, CommandError> {
    let files = config::denoised(&args.output)?;
    let image = ImageLayers::read_within(&args.image, args.memory.limits())?;
    let usage = |problem: io::Problem| CommandError::Usage(problem.at(&args.image).to_string());
    refuse(&image, args)?;
    let mut oidn = Oidn::new(args.oidn.as_deref(), args.memory.limits())?;
    let guides = guides(&image, args)?;
    for guide in &guides {
        oidn.guide(guide.option, &guide.image)?;
    }
    let image = image.focused(&args.layer).map_err(usage)?;
    let answer = |noisy: io::image::denoised::Noisy| {
        let answer = oidn.denoise(&noisy.image)?;
        Ok((noisy, answer))
    };
    let parts = image.noisy().map_err(usage)?.into_iter();
    let answers: Result<Vec<_>, CommandError> = parts.map(answer).collect();
    let with = with(&guides);
    let layer = match &args.layer[..] {
        "" => String::new(),
        layer => format!("the layer {layer} "),
    };
    let by = format!("{layer}by Open Image Denoise (oidnDenoise --hdr){with}");
    let found = image.denoised(&answers?, &by).map_err(usage)?;
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
        let mut parts = vec![format!("denoised{with}")];
        parts.extend(moved(found.moved));
        parts.extend(shown.filter(|stops| *stops != 0.0).map(numbers::exposure));
        say(&parts.join(" · "))?;
        if found.moved.is_none() {
            warn(&format!(
                "'{}' has no variances: how far values were moved cannot be told in standard errors; the .exr files of \
                 renders have them",
                file_name(&args.image)
            ));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A layer that guides the denoiser.
struct Guide {
    option: &'static str,
    layer: String,
    image: RgbImage,
}

/// What is no noisy light.
fn refuse(image: &ImageLayers, args: &DenoiseArgs) -> Result<(), CommandError> {
    let name = file_name(&args.image);
    let why = if image.attribute(DENOISED).is_some() {
        "is denoised already: denoise the estimate"
    } else if image.attribute("integrator") == Some("aov") {
        "has quantities of rays, not light: nest an integrator of light in the aov"
    } else {
        return Ok(());
    };
    Err(CommandError::Usage(format!("'{name}' {why}")))
}

/// The layers to use: those asked for, or else those that are there. Normals need an albedo.
fn guides(image: &ImageLayers, args: &DenoiseArgs) -> Result<Vec<Guide>, CommandError> {
    if args.no_guides {
        return Ok(Vec::new());
    }
    let guide = |option, asked: &Option<String>, usual: &[&str]| match asked {
        Some(layer) => match image.guide(layer) {
            Some(image) => Ok(Some(Guide {
                option,
                layer: layer.clone(),
                image,
            })),
            None => Err(CommandError::Usage(format!(
                "'{}' has no layer '{layer}' with the channels R, G, B or X, Y, Z: render it with an integrator aov \
                 (docs/images.md)",
                file_name(&args.image)
            ))),
        },
        None => Ok(usual.iter().find_map(|layer| {
            Some(Guide {
                option,
                layer: (*layer).to_owned(),
                image: image.guide(layer)?,
            })
        })),
    };
    let albedo = guide("--alb", &args.albedo, &ALBEDOS)?;
    let normal = guide("--nrm", &args.normal, &NORMALS)?;
    if albedo.is_none() && args.normal.is_some() {
        let message = "Open Image Denoise takes normals only beside an albedo: give --albedo, too";
        return Err(CommandError::Usage(message.into()));
    }
    let normal = normal.filter(|_| albedo.is_some());
    Ok([albedo, normal].into_iter().flatten().collect())
}

/// The guides in a few words.
fn with(guides: &[Guide]) -> String {
    match guides {
        [] => " without guides".into(),
        guides => {
            let names: Vec<&str> = guides.iter().map(|g| g.layer.as_str()).collect();
            format!(" with the layers {}", names.join(", "))
        }
    }
}

/// How far values were moved, in a few words.
fn moved(moved: Option<Moved>) -> Vec<String> {
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
