//! Checks of a command's options, as far as possible before any work is done.

use crate::args::{OutputArgs, TraceArgs};
use crate::command_error::CommandError;
use crate::load::named_after;
use io::arrays::ArrayFormat;
use io::diagnostic::shown;
use io::{Problem, atomic};
use std::fs;
use std::path::{Path, PathBuf};

/// File format of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// OpenEXR: all layers and attributes.
    Exr,
    /// PNG: the image for a screen.
    Png,
    /// NumPy: the mean only.
    Npy,
}

/// File format of difference maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapFormat {
    /// Numbers.
    Exr,
    /// Colours.
    Png,
}

/// File format of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayFormat {
    /// A line per point.
    Csv,
    /// An object per ray.
    Json,
    /// A plot.
    Svg,
    /// Lines of a Wavefront OBJ file.
    Obj,
    /// Edges of a PLY file.
    Ply,
    /// Lines of a legacy VTK file.
    Vtk,
}

/// Image formats by extension. The first can hold any number of layers.
const IMAGE_FORMATS: [(&str, ImageFormat); 3] = [
    ("exr", ImageFormat::Exr),
    ("png", ImageFormat::Png),
    ("npy", ImageFormat::Npy),
];
const MAP_FORMATS: [(&str, MapFormat); 2] = [("png", MapFormat::Png), ("exr", MapFormat::Exr)];
const RAY_FORMATS: [(&str, RayFormat); 6] = [
    ("csv", RayFormat::Csv),
    ("json", RayFormat::Json),
    ("svg", RayFormat::Svg),
    ("obj", RayFormat::Obj),
    ("ply", RayFormat::Ply),
    ("vtk", RayFormat::Vtk),
];

/// Returns the images that a render writes: the requested files, or by default an EXR and a PNG
/// file named after the scene in the current folder. Checks that they can be written, as far as
/// possible in advance.
pub fn images(
    args: &OutputArgs,
    scene: &Path,
) -> Result<Vec<(PathBuf, ImageFormat)>, CommandError> {
    let images = outputs(args, scene, &[".exr", ".png"], &IMAGE_FORMATS)?;
    if let Some(strategies) = &args.strategies {
        by_extension(strategies, &IMAGE_FORMATS[..1])?;
        check_writable(strategies)?;
    }
    if let Some(stats) = &args.stats {
        check_writable(stats)?;
    }
    Ok(images)
}

/// Returns the files of readings that a measurement writes: the requested files, or by default an
/// NPZ file named after the scene. Refuses formats of one array for several meters.
pub fn readings(
    args: &OutputArgs,
    scene: &Path,
    meters: usize,
) -> Result<Vec<(PathBuf, ArrayFormat)>, CommandError> {
    let files = outputs(args, scene, &[".npz"], &ArrayFormat::EXTENSIONS)?;
    if let Some((path, _)) = files.iter().find(|(_, f)| f.is_single() && meters > 1) {
        return Err(CommandError::Usage(format!(
            "'{}' can store only one array, but the scene has {meters} meters: use .npz or .h5",
            shown(path)
        )));
    }
    if let Some(stats) = &args.stats {
        check_writable(stats)?;
    }
    Ok(files)
}

/// Returns the requested files with their formats, or by default files named after the scene.
fn outputs<F: Copy>(
    args: &OutputArgs,
    scene: &Path,
    default: &[&str],
    formats: &[(&str, F)],
) -> Result<Vec<(PathBuf, F)>, CommandError> {
    let named = |extension: &&str| named_after(scene, extension);
    let paths = if args.output.is_empty() {
        default.iter().map(named).collect()
    } else {
        args.output.clone()
    };
    let format = |path: PathBuf| {
        let format = by_extension(&path, formats)?;
        check_writable(&path)?;
        Ok((path, format))
    };
    paths.into_iter().map(format).collect()
}

/// Returns the file for rays, if it is not the standard output, and its format.
pub fn rays(args: &TraceArgs) -> Result<(Option<PathBuf>, RayFormat), CommandError> {
    match &args.output {
        None => Ok((None, RayFormat::Csv)),
        Some(path) => {
            let format = by_extension(path, &RAY_FORMATS)?;
            if args.overlay.is_some() && format != RayFormat::Svg {
                let message = "--overlay needs a figure: write -o FILE.svg";
                return Err(CommandError::Usage(message.into()));
            }
            check_writable(path)?;
            Ok((Some(path.clone()), format))
        }
    }
}

/// Returns the format of a difference map, if one is requested.
pub fn map(path: Option<&Path>) -> Result<Option<MapFormat>, CommandError> {
    path.map(|path| {
        check_writable(path)?;
        by_extension(path, &MAP_FORMATS)
    })
    .transpose()
}

/// Returns the files for a denoised image, with their formats.
pub fn denoised(outputs: &[PathBuf]) -> Result<Vec<(PathBuf, ImageFormat)>, CommandError> {
    let format = |path: &PathBuf| {
        let format = by_extension(path, &IMAGE_FORMATS[..2])?;
        check_writable(path)?;
        Ok((path.clone(), format))
    };
    outputs.iter().map(format).collect()
}

/// Refuses anything except a PNG file that can be written.
pub fn picture(path: &Path) -> Result<(), CommandError> {
    by_extension(path, &[("png", ())])?;
    check_writable(path)
}

fn by_extension<F: Copy>(path: &Path, formats: &[(&str, F)]) -> Result<F, CommandError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let known = formats
        .iter()
        .find(|(name, _)| Some(*name) == extension.as_deref());
    known.map(|(_, format)| *format).ok_or_else(|| {
        let names: Vec<String> = formats.iter().map(|(name, _)| format!(".{name}")).collect();
        let names = names.join(", ");
        let path = shown(path);
        CommandError::Usage(match extension {
            Some(e) => format!("unknown extension '.{e}' of output '{path}': expected {names}"),
            None => format!("output '{path}' has no extension: expected {names}"),
        })
    })
}

/// Tests by a trial that a file can replace `path`, so that hours of rendering do not end with a
/// failure to write.
pub fn check_writable(path: &Path) -> Result<(), CommandError> {
    let fail = |why: String| CommandError::Usage(format!("cannot write '{}': {why}", shown(path)));
    if fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return Err(fail("it exists, but is not a regular file".into()));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    match fs::metadata(folder) {
        Ok(m) if m.is_dir() => {}
        Ok(_) => return Err(fail(format!("'{}' is not a folder", shown(folder)))),
        Err(e) => return Err(fail(format!("folder '{}': {e}", shown(folder)))),
    }
    atomic::probe(path).map_err(|e| {
        fail(match e.problem {
            Problem::Write(why) => why.to_string(),
            other => other.to_string(),
        })
    })
}
