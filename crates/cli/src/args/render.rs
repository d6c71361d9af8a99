//! Arguments of `morgana render`.

use super::values::{duration, floating, fraction, measure, particles, samples, seed, threads};
use super::{Frames, KeepArgs, SceneArgs, ToneArgs};
use clap::Args as ClapArgs;
use io::device::DeviceChoice;
use io::element::Element;
use std::path::PathBuf;
use std::time::Duration;
use transport::render::Measure;

/// Output of a render.
#[derive(Clone, Debug, ClapArgs)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// Image or readings to write; may be repeated.
    ///
    /// The extension chooses the format: .exr, .png or .npy for an image. For the readings of
    /// meters: .npz, .h5 or .mat for all arrays; .vti, .nii, .nii.gz, .jnii, .bnii or .nrrd for a grid in space;
    /// .npy for numbers only.
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Meter whose readings are written; all meters by default.
    ///
    /// Files of one meter (.vti, .nii, .nii.gz, .jnii, .bnii, .nrrd, .npy) need this option if the scene has
    /// several meters.
    #[arg(long, value_name = "ID", hide_short_help = true)]
    pub meter: Option<String>,
    /// Type of the written readings: float64 (default) or float32.
    ///
    /// Edges of bins, positions of grids, and records remain float64.
    #[arg(long = "type", value_name = "TYPE", value_parser = floating, hide_short_help = true)]
    pub kind: Option<Element>,
    /// Write an EXR file with the contribution of each strategy of bdpt or particle.
    ///
    /// A layer s1t2.weighted has the contribution of paths with 1 vertex from the emitter and 2
    /// from the sensor (8 stands for 8 or more), weighted by MIS. These layers add up to the image.
    /// s1t2.unweighted has the contribution without its weight.
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub strategies: Option<PathBuf>,
    #[command(flatten)]
    pub tone: ToneArgs,
    /// Write counts, rates and settings as JSON.
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub stats: Option<PathBuf>,
    /// Print only errors.
    #[arg(short, long, hide_short_help = true)]
    pub quiet: bool,
}

/// `morgana render`.
#[derive(Clone, Debug, ClapArgs)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub outputs: OutputArgs,
    #[command(flatten)]
    pub sampling: SamplingArgs,
    #[command(flatten)]
    pub stopping: StoppingArgs,
    #[command(flatten)]
    pub machines: MachineArgs,
    #[command(flatten)]
    pub live: LiveArgs,
}

/// Samples of a render.
#[derive(Clone, Debug, ClapArgs)]
#[command(next_help_heading = "Samples")]
pub struct SamplingArgs {
    /// Samples per pixel, for example 256 or 1e3.
    ///
    /// This number overrides the scene's.
    #[arg(long, value_name = "N", value_parser = samples)]
    pub spp: Option<u64>,
    /// Number of particles for meters, for example 1e7.
    ///
    /// This number is for scenes with meters instead of a camera, and overrides the scene's.
    #[arg(long, value_name = "N", value_parser = particles, conflicts_with = "spp")]
    pub particles: Option<u64>,
    /// Estimator, such as auto, path, particle or bdpt.
    ///
    /// Estimators: auto, path, particle, bdpt, vcm, photon, sppm, preview. This option overrides the scene's.
    /// Parameters that both estimators have keep the scene's values.
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Sampler: independent, ldsampler or ldsampler:64; overrides the scene's.
    ///
    /// ldsampler distributes samples evenly in at least four replicates, ldsampler:64 in replicates of 64 samples (a power of two up to 1024).
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub sampler: Option<String>,
    /// Give noisy pixels more samples.
    ///
    /// This works with the integrator path, like the sampler's parameter adaptive.
    #[arg(long, hide_short_help = true)]
    pub adaptive: bool,
    /// Seed of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = seed, allow_negative_numbers = true, hide_short_help = true)]
    pub seed: u64,
}

/// Conditions that end a render.
#[derive(Clone, Debug, ClapArgs)]
#[command(next_help_heading = "Stopping")]
pub struct StoppingArgs {
    /// Stop after this time, for example 30s, 2m or 1h30m.
    ///
    /// --spp is then an upper bound. The time includes loading; if loading takes longer, the
    /// command fails. A pass over the image is abandoned 0.6 s after the limit.
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub time: Option<Duration>,
    /// Stop at this relative error, for example 0.01.
    ///
    /// The error is relative to the image's mean. --spp is then an upper bound. Stopping by measured errors biases the mean slightly.
    #[arg(long, value_name = "X", value_parser = fraction)]
    pub target_error: Option<f64>,
    /// Error that --target-error limits: image (default) or pixel.
    ///
    /// image is the standard error of the image's mean; pixel is the root mean square of the
    /// errors of pixels.
    #[arg(long, value_name = "WHAT", requires = "target_error", value_parser = measure, hide_short_help = true)]
    pub target: Option<Measure>,
}

/// Threads, frames, checkpoints and shards of a render.
#[derive(Clone, Debug, ClapArgs)]
#[command(next_help_heading = "Machines")]
pub struct MachineArgs {
    /// Number of threads; all CPUs by default.
    #[arg(long, value_name = "N", value_parser = threads, hide_short_help = true)]
    pub threads: Option<usize>,
    /// Device that walks the particles of meters: cpu, gpu, gpu:NUMBER, or auto.
    ///
    /// A GPU serves a fluencemeter on the voxels of a label volume or cube, in single precision.
    /// morgana info SCENE says whether a GPU can run a scene, morgana info --devices lists GPUs.
    #[arg(
        long,
        value_name = "DEVICE",
        default_value = "cpu",
        hide_short_help = true
    )]
    pub device: DeviceChoice,
    /// Render a sequence: FIRST..LAST or FIRST..LAST:STEP, including LAST.
    ///
    /// The frame number replaces {frame} in values of -D and in file names, with as many digits as
    /// FIRST. All frames use one seed, and the integrator that a pilot chooses for the first frame.
    /// --resume skips frames whose files exist.
    #[arg(long, value_name = "RANGE", hide_short_help = true)]
    pub frames: Option<Frames>,
    #[command(flatten)]
    pub keep: KeepArgs,
}

/// Live display of a render.
#[derive(Clone, Debug, ClapArgs)]
#[command(next_help_heading = "Live")]
pub struct LiveArgs {
    /// Show the image while rendering in a running tev, for example localhost:14158.
    #[arg(long, value_name = "HOST[:PORT]", hide_short_help = true)]
    pub tev: Option<String>,
    /// Show the image while rendering on a page in the browser.
    ///
    /// The command prints the address of the page. The page can pause and end the render, and
    /// remains until it is closed.
    #[arg(long, conflicts_with_all = ["frames", "shard"])]
    pub view: bool,
    /// Open the page of --view in the browser.
    #[arg(long, requires = "view", hide_short_help = true)]
    pub open: bool,
}
