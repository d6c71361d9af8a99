//! The command line as it is written. Each value is checked on its own here; what depends on
//! several values, on files or on the scene is checked in [`crate::config`].

use clap::{Args as ClapArgs, Parser, Subcommand};
use glam::DVec3;
use io::element::Element;
use io::volume::AxisOrder;
use std::path::PathBuf;
use std::time::Duration;
use transport::render::Measure;

/// Renders light in media of continuously varying refractive index.
#[derive(Debug, Parser)]
#[command(
    name = "morgana",
    version,
    max_term_width = 100,
    arg_required_else_help = true
)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to images.
    #[command(after_help = "Example:\n  \
        morgana render scenes/luneburg_fog.xml --spp 256 -o fog.exr -o fog.png\n\n\
        Without -o, an EXR and a PNG file named after the scene are written to the current folder; \
        an NPZ file if the scene has meters in place of a camera (docs/meters.md). \
        Ctrl-C stops the render and writes what there is; the same seed always gives the same image, \
        whatever the number of threads.")]
    Render(RenderArgs),
    /// Describe a scene: media, emitters, certificates of unique connections, memory.
    #[command(after_help = "Example:\n  morgana info scenes/luneburg_fog.xml")]
    Info(SceneArgs),
    /// Follow rays through a scene and write their paths as CSV, JSON or a plot.
    #[command(after_help = "Example:\n  \
        morgana trace scenes/luneburg_fog.xml --from=-3,0,0 --direction 1,0,0 \\\n    \
        --rays 15 --width 1.8 -o rays.svg\n\n\
        Rays pass index-matched boundaries, are refracted by smooth dielectrics (or totally reflected) \
        and reflected by smooth metals; they end at any other surface and where they leave the scene. \
        Nothing is scattered. Without -o, CSV goes to the standard output.")]
    Trace(TraceArgs),
    /// Find the rays between two points of a scene.
    #[command(after_help = "Examples:\n  \
        morgana connect scenes/luneburg_fog.xml --from=-0.5,0.2,0 --to 0.7,0,0.1\n  \
        morgana connect scenes/aquarium_laser.xml --from=10,4,0 --to 30,12,5 --all --reflections 1\n\n\
        Prints JSON: the primary branch, found from the direction of the chord, with its directions, \
        lengths, transmittance per channel and the ray-tube Jacobian dA/dΩ. With --all, every branch, \
        the shortest optical path first; \"primary\" says which one is found from the chord, \
        \"occluded\" whether an opaque or rough surface blocks it, \"reflections\" how often it is \
        reflected where it could have been refracted. The search follows rays in some 1500 directions; \
        branches that graze an interface may be missed. \"failure\" and \"occluded\" at the end are \
        those of the primary branch.\n\n\
        \"certified_unique\" says that no second ray can exist; false says that none is known not to. \
        That there is no ray is an answer, not an error.")]
    Connect(ConnectArgs),
    /// Draw figures of results: profiles, maps, histograms over time, sections of fluence, convergence.
    #[command(after_help = "Examples:\n  \
        morgana plot profile with.exr without.exr --row 48 -o profile.svg\n  \
        morgana plot image jet.exr --layer deflection --channel X -o deflection.png\n  \
        morgana plot histogram transient.exr --pixel 20,30 -o time.png\n  \
        morgana plot slice fluence.npz --axis z --at 0.5 --log -o slice.png\n  \
        morgana plot convergence a.json b.json -o convergence.svg")]
    Plot(PlotArgs),
    /// Convert a volume to another format, and say what is in it.
    #[command(after_help = "Examples:\n  \
        morgana convert density.npy density.vti --axes xyz --spacing 0.1,0.1,0.2\n  \
        morgana convert kwave.h5 pressure.nrrd --dataset p_final --axes zyx --resample 64x64x32\n\n\
        Extensions choose the formats: .vol, .npy, .npz, .h5 or .hdf5, .mat, .nrrd, .vti and .vtk \
        (docs/scene-format.md). Numbers keep their type where the new format has it; if values are \
        rounded or the place in space is not kept, the summary says so.")]
    Convert(ConvertArgs),
}

/// `morgana convert`.
#[derive(Debug, ClapArgs)]
pub struct ConvertArgs {
    /// Volume to read.
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// Volume to write.
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// Which of several arrays to read: path of a dataset, name of an array or variable.
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Which axis of the array is which, where the format does not say: zyx if the last index runs along
    /// x, xyz if the first does; with c where the channels are, if not last.
    #[arg(long, value_name = "ORDER")]
    pub axes: Option<AxisOrder>,
    /// Name of the array that is written, in formats that have names.
    #[arg(long, value_name = "NAME", default_value = "volume")]
    pub out_dataset: String,
    /// Change the number of samples in the same box: trilinear between samples, constant from the outermost
    /// on. Fewer samples are not means over what lies between them.
    #[arg(long, value_name = "NXxNYxNZ", value_parser = grid)]
    pub resample: Option<[usize; 3]>,
    /// Distances between samples along x, y and z, instead of those of the file. The first sample is at the
    /// origin if neither the file nor --origin says where it is.
    #[arg(long, value_name = "X,Y,Z", value_parser = spacing)]
    pub spacing: Option<DVec3>,
    /// Position of the first sample, instead of that of the file.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub origin: Option<DVec3>,
    /// Multiply all values by this.
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_negative_numbers = true, value_parser = finite)]
    pub scale: f64,
    /// Then add this.
    #[arg(long, value_name = "O", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub offset: f64,
    /// Type of the numbers that are written: float16, float32, float64, int8 to int64, uint8 to uint64.
    #[arg(long = "type", value_name = "TYPE", value_parser = element)]
    pub kind: Option<Element>,
}

/// `morgana plot`.
#[derive(Debug, ClapArgs)]
pub struct PlotArgs {
    /// What to draw.
    #[command(subcommand)]
    pub figure: FigureArgs,
}

/// The figures.
#[derive(Debug, Subcommand)]
pub enum FigureArgs {
    /// Values along a row or a column of EXR images, with bands of one standard error.
    Profile {
        /// Images (.exr).
        #[arg(required = true, value_name = "IMAGE")]
        images: Vec<PathBuf>,
        /// Row of pixels, from 0 at the top.
        #[arg(
            long,
            value_name = "Y",
            conflicts_with = "column",
            required_unless_present = "column"
        )]
        row: Option<usize>,
        /// Column of pixels, from 0 at the left.
        #[arg(long, value_name = "X")]
        column: Option<usize>,
        /// Layer, for example bounce.1; the image itself by default.
        #[arg(long, value_name = "NAME", default_value = "")]
        layer: String,
        /// Channel; the mean over all by default.
        #[arg(long, value_name = "NAME")]
        channel: Option<String>,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// A layer of an EXR image in false colours, with a colour bar.
    Image {
        /// Image (.exr).
        #[arg(value_name = "IMAGE")]
        image: PathBuf,
        /// Layer, for example deflection; the image itself by default.
        #[arg(long, value_name = "NAME", default_value = "")]
        layer: String,
        /// Channel; the mean over all by default.
        #[arg(long, value_name = "NAME")]
        channel: Option<String>,
        /// Colours go by the logarithm.
        #[arg(long)]
        log: bool,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Light over optical length or time, from EXR images with bins of them.
    Histogram {
        /// Images (.exr).
        #[arg(required = true, value_name = "IMAGE")]
        images: Vec<PathBuf>,
        /// One pixel, from 0,0 at the top left, instead of the mean over all.
        #[arg(long, value_name = "X,Y", value_parser = pixel)]
        pixel: Option<[usize; 2]>,
        /// Channel; the mean over all by default.
        #[arg(long, value_name = "NAME")]
        channel: Option<String>,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// A section through what a fluence meter has read.
    Slice {
        /// Readings (.npz).
        #[arg(value_name = "READINGS")]
        readings: PathBuf,
        /// Axis across the section: x, y or z of the meter.
        #[arg(long, value_name = "AXIS", default_value = "z", value_parser = ["x", "y", "z"])]
        axis: String,
        /// Where on that axis.
        #[arg(long, value_name = "POSITION", allow_hyphen_values = true, value_parser = finite)]
        at: f64,
        /// Array, for example absorbed; the fluence by default.
        #[arg(long, value_name = "NAME")]
        array: Option<String>,
        /// Colours go by the logarithm.
        #[arg(long)]
        log: bool,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Errors against samples per pixel, from files of `render --stats`, a line for each integrator.
    Convergence {
        /// Statistics (.json).
        #[arg(required = true, value_name = "STATS")]
        stats: Vec<PathBuf>,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
}

/// A scene file and its parameters.
#[derive(Clone, Debug, ClapArgs)]
pub struct SceneArgs {
    /// Scene file.
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Set a parameter that the scene declares with `<default>`; may be repeated.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub defines: Vec<(String, String)>,
}

/// `morgana render`.
#[derive(Debug, ClapArgs)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// File to write; its extension chooses the format: .exr, .png or .npy for an image, .npz, .h5,
    /// .nrrd or .npy for the readings of meters. May be repeated.
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Samples per pixel, instead of the scene's.
    #[arg(long, value_name = "N", value_parser = samples)]
    pub spp: Option<u64>,
    /// Particles to follow if the scene has meters in place of a camera, for example 1e7, instead of
    /// the scene's number.
    #[arg(long, value_name = "N", value_parser = particles, conflicts_with = "spp")]
    pub particles: Option<u64>,
    /// Seed of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Number of threads; all processors by default.
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Stop after this time, for example 30s, 2m or 1h30m; --spp is then an upper bound.
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub time: Option<Duration>,
    /// Stop when the measured error is down to this part of the image's mean, for example 0.01; --spp is
    /// then an upper bound. Stopping by measured errors biases the mean slightly.
    #[arg(long, value_name = "X", value_parser = positive)]
    pub target_error: Option<f64>,
    /// What --target-error is of: image, the standard error of the image's mean (default), or pixel, the
    /// root mean square of those of all pixels.
    #[arg(long, value_name = "WHAT", requires = "target_error", value_parser = measure)]
    pub target: Option<Measure>,
    /// Estimator, instead of the scene's: path, particle, bdpt, photon or sppm. Parameters that all have in common
    /// stay those of the scene.
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Write an EXR file that shows what each strategy of bdpt or particle finds: layers
    /// s1t2.weighted, whose sum is the image, and s1t2.unweighted, for s vertices from the emitter
    /// and t from the sensor (8 stands for 8 or more).
    #[arg(long, value_name = "FILE")]
    pub strategies: Option<PathBuf>,
    /// Brighten PNG files by this many stops.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub exposure: f64,
    /// Write counts, rates and settings as JSON.
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(short, long)]
    pub quiet: bool,
}

/// `morgana trace`.
#[derive(Debug, ClapArgs)]
pub struct TraceArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Where the rays start.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub from: DVec3,
    /// Direction of the middle ray; any length.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = direction)]
    pub direction: DVec3,
    /// Number of rays.
    #[arg(long, value_name = "N", default_value = "1", value_parser = rays)]
    pub rays: usize,
    /// Angle of the fan of rays, in degrees.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = not_negative)]
    pub spread: f64,
    /// Width over which the starts of the rays are spread, across their direction.
    #[arg(long, value_name = "LENGTH", default_value_t = 0.0, value_parser = not_negative)]
    pub width: f64,
    /// Longest ray; ten times the size of the scene by default.
    #[arg(long, value_name = "LENGTH", value_parser = positive)]
    pub max_length: Option<f64>,
    /// File to write; its extension chooses the format: .csv, .json or .svg.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// `morgana connect`.
#[derive(Debug, ClapArgs)]
pub struct ConnectArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Where the ray starts.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub from: DVec3,
    /// Where the ray ends.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub to: DVec3,
    /// Find every branch by a dense search, not only the primary one.
    #[arg(long)]
    pub all: bool,
    /// Follow up to this many reflections at smooth dielectrics, where refraction is possible.
    #[arg(long, value_name = "K", default_value_t = 0, requires = "all", value_parser = reflections)]
    pub reflections: u32,
}

fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("expected NAME=VALUE".into()),
    }
}

/// Rays are all kept until they are written.
const MOST_RAYS: u64 = 1_000_000;
/// Beyond the largest machines.
const MOST_THREADS: u64 = 4096;

fn measure(text: &str) -> Result<Measure, String> {
    let of = |measure: &Measure| measure.name() == text;
    let known = [Measure::Image, Measure::Pixel].into_iter().find(of);
    known.ok_or_else(|| format!("expected one of: {}", Measure::NAMES.join(", ")))
}

fn samples(text: &str) -> Result<u64, String> {
    whole(text, u64::MAX).ok_or_else(|| "expected a whole number, at least 1".into())
}

/// Whole numbers up to this are exact as floating-point numbers.
const EXACT: f64 = (1u64 << 53) as f64;

fn particles(text: &str) -> Result<u64, String> {
    let number = finite(text).ok();
    let number = number.filter(|n| n.fract() == 0.0 && (1.0..=EXACT).contains(n));
    number
        .map(|n| n as u64)
        .ok_or_else(|| "expected a whole number, at least 1, such as 250000 or 1e7".into())
}

fn rays(text: &str) -> Result<usize, String> {
    bounded(text, MOST_RAYS)
}

fn threads(text: &str) -> Result<usize, String> {
    bounded(text, MOST_THREADS)
}

/// Every reflection multiplies the ways that are followed.
const MOST_REFLECTIONS: u32 = 8;

fn reflections(text: &str) -> Result<u32, String> {
    let number = text.parse().ok().filter(|k| *k <= MOST_REFLECTIONS);
    number.ok_or_else(|| format!("expected a whole number from 0 to {MOST_REFLECTIONS}"))
}

fn bounded(text: &str, most: u64) -> Result<usize, String> {
    let number = whole(text, most).and_then(|n| usize::try_from(n).ok());
    number.ok_or_else(|| format!("expected a whole number from 1 to {most}"))
}

fn whole(text: &str, most: u64) -> Option<u64> {
    text.parse().ok().filter(|n| (1..=most).contains(n))
}

fn pixel(text: &str) -> Result<[usize; 2], String> {
    let numbers = text
        .split_once(',')
        .map(|(x, y)| [x, y].map(|t| t.trim().parse().ok()));
    match numbers {
        Some([Some(x), Some(y)]) => Ok([x, y]),
        _ => Err("expected two whole numbers, X,Y".into()),
    }
}

fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err("expected a number".into()),
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    let message = || "expected a number, zero or more".to_owned();
    finite(text).ok().filter(|v| *v >= 0.0).ok_or_else(message)
}

fn positive(text: &str) -> Result<f64, String> {
    let message = || "expected a number above zero".to_owned();
    finite(text).ok().filter(|v| *v > 0.0).ok_or_else(message)
}

fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| finite(t).ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three numbers separated by commas, such as 0,1,-2.5".into()),
    }
}

fn spacing(text: &str) -> Result<DVec3, String> {
    let message = || "expected three numbers above zero".to_owned();
    let spacing = point(text)?;
    (spacing.min_element() > 0.0)
        .then_some(spacing)
        .ok_or_else(message)
}

fn grid(text: &str) -> Result<[usize; 3], String> {
    let numbers: Option<Vec<usize>> = text.split('x').map(|n| n.trim().parse().ok()).collect();
    let numbers = numbers.and_then(|n| n.try_into().ok());
    let numbers = numbers.filter(|n: &[usize; 3]| !n.contains(&0));
    numbers.ok_or_else(|| "expected three whole numbers above zero, such as 64x64x32".into())
}

fn element(text: &str) -> Result<Element, String> {
    let names = Element::ALL.map(Element::name);
    Element::of_name(text).ok_or_else(|| format!("expected one of: {}", names.join(", ")))
}

fn direction(text: &str) -> Result<DVec3, String> {
    let zero = || "the direction must not be zero".to_owned();
    point(text)?.try_normalize().ok_or_else(zero)
}

/// Hours, minutes and seconds in this order: `1h30m`, `2m`, `1.5s`; a number alone is seconds.
fn duration(text: &str) -> Result<Duration, String> {
    let message = || "expected a time above zero such as 30s, 2m or 1h30m".to_owned();
    let (mut rest, mut seconds) = (text.trim(), 0.0);
    for (unit, length) in [('h', 3600.0), ('m', 60.0), ('s', 1.0)] {
        if let Some((number, after)) = rest.split_once(unit) {
            seconds += length * not_negative(number).map_err(|_| message())?;
            rest = after;
        }
    }
    if !rest.is_empty() {
        seconds += not_negative(rest).map_err(|_| message())?;
    }
    match Duration::try_from_secs_f64(seconds) {
        Ok(time) if !time.is_zero() => Ok(time),
        _ => Err(message()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn durations() {
        let seconds = |text| duration(text).map(|d| d.as_secs_f64());
        assert_eq!(seconds("30s"), Ok(30.0));
        assert_eq!(seconds("2m"), Ok(120.0));
        assert_eq!(seconds("1h30m"), Ok(5400.0));
        assert_eq!(seconds("1h0m1.5s"), Ok(3601.5));
        assert_eq!(seconds("90"), Ok(90.0));
        for bad in ["", "0s", "s", "1x", "3m1h", "-1s", "1e400s", "nan"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_of_particles() {
        assert_eq!(particles("1e7"), Ok(10_000_000));
        assert_eq!(particles("123"), Ok(123));
        for bad in ["0", "0.5", "-1", "1e30", "many", ""] {
            assert!(particles(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn points() {
        assert_eq!(point("1,-2, 3.5"), Ok(DVec3::new(1.0, -2.0, 3.5)));
        for bad in ["1,2", "1,2,3,4", "a,b,c", "1,2,inf", ""] {
            assert!(point(bad).is_err(), "{bad}");
        }
        assert!(direction("0,0,0").is_err());
    }
}
