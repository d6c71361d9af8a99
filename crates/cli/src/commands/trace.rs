//! `morgana trace`.

use crate::args::TraceArgs;
use crate::command_error::CommandError;
use crate::config::{self, RayFormat};
use crate::load::{file_name, load_with_warnings};
use crate::trace::{csv, fan, json, obj, ply, vtk};
use crate::{numbers, svg};
use eikonal::Reference;
use std::io::Write;
use std::process::ExitCode;
use transport::trace::{Path, TraceEnding, Tracer};

/// Traces rays through a scene and writes their paths.
pub fn trace(args: &TraceArgs) -> Result<ExitCode, CommandError> {
    let (file, format) = config::rays(args)?;
    let loaded = load_with_warnings(&args.scene)?;
    let scene = loaded.scene();
    let spread = args.spread.to_radians();
    let starts = fan(args.from, args.direction, args.rays, spread, args.width);
    let reference = match args.reference_index {
        Some(n) => Some(Reference::Index(n)),
        None => loaded.reference(),
    };
    let tracer = Tracer::new(scene, args.max_length).with_reference(reference);
    let paths: Vec<Path> = starts.iter().map(|(x, d)| tracer.follow(*x, *d)).collect();
    let text = match format {
        RayFormat::Csv => csv(scene, &paths, args.wavelength, file.is_some()),
        RayFormat::Json => format!("{:#}\n", json(scene, &paths, args.wavelength)),
        RayFormat::Svg => match &args.overlay {
            Some(picture) => svg::overlay(scene, &paths, picture)?,
            None => svg::plot(scene, &paths, &title(args))?,
        },
        RayFormat::Obj => obj(&paths),
        RayFormat::Ply => ply(&paths),
        RayFormat::Vtk => vtk(&paths),
    };
    match file {
        Some(path) => io::atomic::write_bytes(&path, text.as_bytes())?,
        None => std::io::stdout().write_all(text.as_bytes())?,
    }
    match paths
        .iter()
        .filter(|p| p.ending == TraceEnding::Lost)
        .count()
    {
        0 => Ok(ExitCode::SUCCESS),
        n => Err(CommandError::Runtime(format!(
            "{n} of {} rays left the field of their medium or took too many steps: the output has these rays up to that point",
            paths.len()
        ))),
    }
}

fn title(args: &TraceArgs) -> String {
    let rays = match args.rays {
        1 => "1 ray".to_owned(),
        n => format!("{n} rays"),
    };
    let [x, y, z] = args
        .from
        .to_array()
        .map(|v| numbers::plain(v).replace('-', "−"));
    format!(
        "{} · {rays} from ({x}, {y}, {z})",
        file_name(&args.scene.path)
    )
}
