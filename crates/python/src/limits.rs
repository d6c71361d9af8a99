//! Options of a run, and limits at which it ends.

use crate::errors;
use io::{Loaded, Run};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::time::Duration;
use transport::render::{Measure, Target};

/// Dictionary of the options of a run.
#[derive(Clone, Copy, Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Limits {
    pub seed: u64,
    /// Samples per pixel, or particles; `None` if another limit ends the run.
    pub samples: Option<u64>,
    /// Time limit in seconds, positive.
    pub time: Option<f64>,
    /// Relative error at which a render ends, positive, and true if it is the error of pixels.
    pub target_error: Option<(f64, bool)>,
    /// Number of threads; zero for the number of CPU cores.
    pub threads: usize,
}

impl Limits {
    /// Makes a run that computes all of the scene.
    pub fn run<'a>(&self, loaded: &'a Loaded) -> Run<'a> {
        Run {
            seed: self.seed,
            total: self.samples,
            time: self.time(),
            target: self.target_error.map(|(error, of_pixels)| Target {
                error,
                measure: if of_pixels {
                    Measure::Pixel
                } else {
                    Measure::Image
                },
            }),
            ..Run::new(loaded)
        }
    }

    /// Makes a run with a named integrator, if one is given.
    pub fn run_by<'a>(&self, loaded: &'a Loaded, integrator: Option<&str>) -> PyResult<Run<'a>> {
        let run = self.run(loaded);
        let Some(name) = integrator else {
            return Ok(run);
        };
        let named = loaded.renderer_named(name).map_err(|d| errors::scene(&d))?;
        Ok(Run {
            renderer: named.renderer,
            candidates: named.candidates,
            ..run
        })
    }

    /// Starts a pool of threads.
    pub fn pool(&self) -> PyResult<ThreadPool> {
        let builder = ThreadPoolBuilder::new().num_threads(self.threads);
        builder
            .build()
            .map_err(|e| errors::render(format!("cannot start threads: {e}")))
    }

    /// Returns the time limit of a run.
    pub fn time(&self) -> Option<Duration> {
        self.time.and_then(|t| Duration::try_from_secs_f64(t).ok())
    }
}
