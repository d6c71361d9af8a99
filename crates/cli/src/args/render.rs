//! `morgana render`.

use super::values::{duration, measure, particles, positive, samples, seed, threads};
use super::{Frames, KeepArgs, SceneArgs, ToneArgs};
use clap::Args as ClapArgs;
use std::path::PathBuf;
use std::time::Duration;
use transport::render::Measure;

/// What becomes of a render.
#[derive(Clone, Debug, ClapArgs)]
pub struct OutputArgs {
    /// File to write; its extension chooses the format: .exr, .png or .npy for an image, .npz, .h5,
    /// .nrrd or .npy for the readings of meters. May be repeated.
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Write an EXR file that shows what each strategy of bdpt or particle finds: layers
    /// s1t2.weighted, whose sum is the image, and s1t2.unweighted, for s vertices from the emitter
    /// and t from the sensor (8 stands for 8 or more).
    #[arg(long, value_name = "FILE")]
    pub strategies: Option<PathBuf>,
    #[command(flatten)]
    pub tone: ToneArgs,
    /// Write counts, rates and settings as JSON.
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Print nothing but errors.
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
    /// How the samples of a pixel are drawn, instead of the scene's way: independent, or ldsampler, spread evenly
    /// in replicates of eight, or ldsampler:64, in replicates of sixty-four.
    #[arg(long, value_name = "NAME")]
    pub sampler: Option<String>,
    /// Give noisy pixels more of the samples, with the integrator path, as the sampler's parameter of this
    /// name does.
    #[arg(long)]
    pub adaptive: bool,
    /// Particles to follow if the scene has meters in place of a camera, for example 1e7, instead of
    /// the scene's number.
    #[arg(long, value_name = "N", value_parser = particles, conflicts_with = "spp")]
    pub particles: Option<u64>,
    /// Seed of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// Number of threads; all processors by default.
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Stop after this time, for example 30s, 2m or 1h30m; --spp is then an upper bound. Loading the scene counts: if it takes
    /// longer, nothing is rendered, which is an error. A pass over the image that takes a second longer is given up.
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
    /// Estimator, instead of the scene's: auto, path, particle, bdpt, vcm, photon or sppm. Parameters that all have in common
    /// stay those of the scene.
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Render a sequence: FIRST..LAST or FIRST..LAST:STEP, the last included. The number of each frame takes the place of {frame} in the values of
    /// -D and the names of files, with as many digits as FIRST has. Frames have the same seed and the integrator that a pilot
    /// finds for the first. With --resume, frames whose files exist are left out.
    #[arg(long, value_name = "RANGE")]
    pub frames: Option<Frames>,
    #[command(flatten)]
    pub keep: KeepArgs,
    /// Show the image while it is made in a running tev, for example localhost:14158.
    #[arg(long, value_name = "HOST[:PORT]")]
    pub tev: Option<String>,
    /// Show the image while it is made on a page in the browser, whose address is printed; it can pause and end the render, and
    /// stays after that as long as it is open.
    #[arg(long, conflicts_with_all = ["frames", "shard"])]
    pub view: bool,
}
