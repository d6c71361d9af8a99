//! Definition of a computation, without its display, output files and speed.

use crate::args::RenderArgs;
use crate::command_error::CommandError;
use crate::driver::TimeLimit;
use crate::interrupt::Interrupt;
use crate::load;
use io::device::DeviceChoice;
use io::part::Header;
use io::{Limits, LoadOptions, Loaded, Run};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use transport::render::{Measure, Target};
use transport::scene::Lint;

/// A scene, and the command-line options that determine the computation.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Job {
    /// Scene file.
    pub scene: PathBuf,
    /// Parameters of the scene.
    pub defines: Vec<(String, String)>,
    /// Estimator instead of the scene's.
    pub integrator: Option<String>,
    /// Samples per pixel instead of the scene's.
    pub spp: Option<u64>,
    /// Sampler instead of the scene's.
    pub sampler: Option<String>,
    /// True if noisy pixels get more samples, whatever the scene specifies.
    pub adaptive: bool,
    /// Particles instead of the scene's number.
    pub particles: Option<u64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Error at which to stop.
    pub target_error: Option<f64>,
    /// Error measure of `target_error`.
    pub target: Option<Measure>,
    /// True if strategies are separated.
    pub strategies: bool,
    /// Device that walks particles.
    pub device: DeviceChoice,
    /// Checks of the scene whose warnings are suppressed. They do not change results.
    #[serde(skip)]
    pub silenced: Vec<Lint>,
}

impl Job {
    /// Makes the job that a command line specifies.
    pub fn of(args: &RenderArgs) -> Self {
        Job {
            scene: args.scene.path.clone(),
            defines: args.scene.defines.clone(),
            integrator: args.sampling.integrator.clone(),
            spp: args.sampling.spp,
            sampler: args.sampling.sampler.clone(),
            adaptive: args.sampling.adaptive,
            particles: args.sampling.particles,
            seed: args.sampling.seed,
            target_error: args.stopping.target_error,
            target: args.stopping.target,
            strategies: args.outputs.strategies.is_some(),
            device: args.machines.device,
            silenced: args.scene.silence.clone(),
        }
    }

    /// Returns the job that a part of a render belongs to.
    pub fn of_part(header: &Header) -> Result<Self, CommandError> {
        let foreign = "Python made these parts: merge them by morgana.distributed";
        serde_json::from_str(&header.origin).map_err(|_| CommandError::Usage(foreign.into()))
    }

    /// Loads the scene within memory limits.
    pub fn load(&self, limits: Limits) -> Result<Loaded, CommandError> {
        load::load(&self.scene, &self.options(limits))
    }

    /// Loads the scene like [`Job::load`], until the user interrupts the program or the time is
    /// over.
    pub fn load_in_time(
        &self,
        limits: Limits,
        time: &TimeLimit,
        interrupt: &Interrupt,
    ) -> Result<Loaded, CommandError> {
        load::load_in_time(&self.scene, &self.options(limits), time, interrupt)
    }

    fn options(&self, limits: Limits) -> LoadOptions {
        LoadOptions {
            defines: self.defines.clone(),
            integrator: self.integrator.clone(),
            samples: self.spp.or(self.particles),
            sampler: self.sampler.clone(),
            adaptive: self.adaptive,
            silenced: self.silenced.clone(),
            limits,
            ..LoadOptions::default()
        }
    }

    /// Makes the run of this job: the whole, unless the caller changes it.
    pub fn run<'a>(&self, loaded: &'a Loaded) -> Run<'a> {
        Run {
            seed: self.seed,
            target: self.target_error.map(|error| Target {
                error,
                measure: self.target.unwrap_or_default(),
            }),
            strategies: self.strategies,
            ..Run::new(loaded)
        }
    }

    /// Returns the header to store with parts of the run.
    pub fn header(&self, run: &Run) -> Header {
        let mut origin = self.clone();
        // Parts may be merged in other folders: store the absolute path.
        origin.scene = std::path::absolute(&self.scene).unwrap_or(origin.scene);
        Header {
            // Paths that are not Unicode cannot be stored.
            origin: serde_json::to_string(&origin).unwrap_or_default(),
            ..run.header()
        }
    }

    /// Returns the options that determine the computation, as on a command line.
    pub fn command_line(&self) -> String {
        let mut options = vec![format!("--seed {}", self.seed)];
        options.extend(self.spp.map(|n| format!("--spp {n}")));
        let sampler = self.sampler.iter();
        options.extend(sampler.map(|name| format!("--sampler {name}")));
        options.extend(self.adaptive.then(|| "--adaptive".into()));
        options.extend(self.particles.map(|n| format!("--particles {n}")));
        options.extend(self.target_error.map(|x| format!("--target-error {x}")));
        options.extend(self.target.map(|m| format!("--target {}", m.name())));
        if self.device != DeviceChoice::Cpu {
            options.push(format!("--device {}", self.device));
        }
        let integrator = self.integrator.iter();
        options.extend(integrator.map(|name| format!("--integrator {name}")));
        options.extend(self.defines.iter().map(|(k, v)| format!("-D {k}={v}")));
        options.join(" ")
    }
}
