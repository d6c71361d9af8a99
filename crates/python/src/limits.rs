//! How a run is done and when it ends.

use crate::errors;
use io::{Loaded, Run};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::time::Duration;
use transport::render::{Measure, Target};

/// A dictionary of what the caller asks for.
#[derive(Clone, Copy, Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Limits {
    pub seed: u64,
    /// Samples per pixel, or particles; without a number, something else ends the run.
    pub samples: Option<u64>,
    /// Seconds, positive.
    pub time: Option<f64>,
    /// Error at which a render ends, positive, and whether it is that of pixels.
    pub target_error: Option<(f64, bool)>,
    /// Zero for as many as there are processors.
    pub threads: usize,
}

impl Limits {
    /// What is computed of a scene: all of it.
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

    /// The same by an integrator that is named, if one is.
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

    /// Threads to run on.
    pub fn pool(&self) -> PyResult<ThreadPool> {
        let builder = ThreadPoolBuilder::new().num_threads(self.threads);
        builder
            .build()
            .map_err(|e| errors::render(format!("cannot start threads: {e}")))
    }

    /// How long a run may take.
    pub fn time(&self) -> Option<Duration> {
        self.time.and_then(|t| Duration::try_from_secs_f64(t).ok())
    }
}
