//! Arguments of `morgana render`.

use super::values::{duration, measure, particles, positive, samples, seed, threads};
use super::{Frames, KeepArgs, SceneArgs, ToneArgs};
use clap::Args as ClapArgs;
use std::path::PathBuf;
use std::time::Duration;
use transport::render::Measure;

/// Output of a render.
#[derive(Clone, Debug, ClapArgs)]
pub struct OutputArgs {
    /// File to write; its extension chooses the format: .exr, .png or .npy for an image, .npz, .h5,
    /// .nrrd or .npy for the readings of meters. May be repeated.
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Write an EXR file with the contribution of each strategy of bdpt or particle: layers
    /// s1t2.weighted, which add up to the image, and s1t2.unweighted, for s vertices from the
    /// emitter and t from the sensor (8: 8 or more).
    #[arg(long, value_name = "FILE")]
    pub strategies: Option<PathBuf>,
    #[command(flatten)]
    pub tone: ToneArgs,
    /// Write counts, rates and settings as JSON.
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Print only errors.
    #[arg(short, long)]
    pub quiet: bool,
}

/// `morgana render`.
#[derive(Clone, Debug, ClapArgs)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub outputs: OutputArgs,
    /// Samples per pixel, instead of the scene's.
    #[arg(long, value_name = "N", value_parser = samples)]
    pub spp: Option<u64>,
    /// Sampler, instead of the scene's: independent, ldsampler (evenly distributed in at least four
    /// replicates), or ldsampler:64 (in replicates of 64 samples, a power of two up to 1024).
    #[arg(long, value_name = "NAME")]
    pub sampler: Option<String>,
    /// Give noisy pixels more samples, with the integrator path, like the sampler's parameter
    /// adaptive.
    #[arg(long)]
    pub adaptive: bool,
    /// Number of particles for scenes with meters instead of a camera, for example 1e7; overrides
    /// the scene's.
    #[arg(long, value_name = "N", value_parser = particles, conflicts_with = "spp")]
    pub particles: Option<u64>,
    /// Seed of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// Number of threads; all CPUs by default.
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Stop after this time, for example 30s, 2m or 1h30m; --spp is then an upper bound. The time
    /// includes loading; if loading takes longer, the command fails. A pass over the image is
    /// abandoned 0.6 s after the limit.
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub time: Option<Duration>,
    /// Stop at this measured error, a fraction of the image's mean, for example 0.01; --spp is then
    /// an upper bound. Stopping by measured errors biases the mean slightly.
    #[arg(long, value_name = "X", value_parser = positive)]
    pub target_error: Option<f64>,
    /// Error for --target-error: image, the standard error of the image's mean (default), or pixel,
    /// the root mean square of pixels' errors.
    #[arg(long, value_name = "WHAT", requires = "target_error", value_parser = measure)]
    pub target: Option<Measure>,
    /// Estimator, instead of the scene's: auto, path, particle, bdpt, vcm, photon or sppm.
    /// Parameters common to all keep the scene's values.
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Render a sequence: FIRST..LAST or FIRST..LAST:STEP, the last included. The frame number
    /// replaces {frame} in values of -D and in file names, with as many digits as FIRST. All frames
    /// use one seed, and the integrator that a pilot chooses for the first. --resume skips frames
    /// whose files exist.
    #[arg(long, value_name = "RANGE")]
    pub frames: Option<Frames>,
    #[command(flatten)]
    pub keep: KeepArgs,
    /// Show the image while rendering in a running tev, for example localhost:14158.
    #[arg(long, value_name = "HOST[:PORT]")]
    pub tev: Option<String>,
    /// Show the image while rendering on a page in the browser; its address is printed. The page
    /// can pause and end the render, and remains until it is closed.
    #[arg(long, conflicts_with_all = ["frames", "shard"])]
    pub view: bool,
}
