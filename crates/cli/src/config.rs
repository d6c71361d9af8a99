//! Checks of a command's options, as far as possible before any work is done.

use crate::args::{OutputArgs, TraceArgs};
use crate::command_error::CommandError;
use crate::load::named_after;
use io::arrays::ArrayFormat;
use io::assemble::Instrument;
use io::diagnostic::shown;
use io::element::Element;
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
    if args.meter.is_some() || args.kind.is_some() {
        let message = "--meter and --type are for readings of meters, but the scene has a camera";
        return Err(CommandError::Usage(message.into()));
    }
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

/// Files of readings.
#[derive(Clone, Debug)]
pub struct ReadingFiles {
    /// Paths and formats.
    pub files: Vec<(PathBuf, ArrayFormat)>,
    /// Number of the meter whose readings are written; `None` for all meters.
    pub meter: Option<usize>,
    /// Type of the numbers.
    pub element: Element,
}

impl ReadingFiles {
    /// Returns the paths of all files, with the files of errors.
    pub fn paths(&self) -> Vec<PathBuf> {
        let each = self.files.iter().flat_map(|(path, format)| {
            let errors = format.errors_beside(path);
            [Some(path.clone()), errors].into_iter().flatten()
        });
        each.collect()
    }
}

/// Returns the files of readings that a measurement writes: the requested files, or by default an
/// NPZ file named after the scene. Refuses formats of one meter for several meters, and formats of
/// grids for other meters.
pub fn readings(
    args: &OutputArgs,
    scene: &Path,
    instruments: &[Instrument],
) -> Result<ReadingFiles, CommandError> {
    let meter = args.meter.as_deref();
    let meter = meter.map(|name| numbered(name, instruments)).transpose()?;
    let readings = ReadingFiles {
        files: outputs(args, scene, &[".npz"], &ArrayFormat::EXTENSIONS)?,
        meter,
        element: args.kind.unwrap_or(Element::F64),
    };
    for (path, format) in &readings.files {
        check_meter(path, *format, &readings, instruments)?;
    }
    for path in readings.paths().iter().chain(&args.stats) {
        check_writable(path)?;
    }
    Ok(readings)
}

/// Refuses a file that cannot hold the readings of its meters.
fn check_meter(
    path: &Path,
    format: ArrayFormat,
    readings: &ReadingFiles,
    instruments: &[Instrument],
) -> Result<(), CommandError> {
    let path = shown(path);
    let only = match instruments {
        [only] => Some(only),
        all => readings.meter.map(|i| &all[i]),
    };
    match only {
        None if format.is_single() => Err(CommandError::Usage(format!(
            "'{path}' can store only one meter, but the scene has {} meters: use .npz, .h5 or .mat, or choose one by --meter: {}",
            instruments.len(),
            names(instruments)
        ))),
        Some(meter) if format.needs_grid() && !meter.has_grid() => {
            Err(CommandError::Usage(format!(
                "'{path}' can store only cells over x, y and z, which the meter '{}' does not have: use .npz, .h5 or .mat",
                meter.name
            )))
        }
        _ => Ok(()),
    }
}

/// Returns the number of the meter with a name.
fn numbered(name: &str, instruments: &[Instrument]) -> Result<usize, CommandError> {
    let found = instruments.iter().position(|meter| meter.name == name);
    found.ok_or_else(|| {
        let names = names(instruments);
        CommandError::Usage(format!("no meter '{name}': the scene has {names}"))
    })
}

fn names(instruments: &[Instrument]) -> String {
    let names: Vec<&str> = instruments.iter().map(|meter| &*meter.name).collect();
    names.join(", ")
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
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let file = file.to_ascii_lowercase();
    let has = |end: &str| file.len() > end.len() + 1 && file.ends_with(&format!(".{end}"));
    let known = formats.iter().find(|(name, _)| has(name));
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
