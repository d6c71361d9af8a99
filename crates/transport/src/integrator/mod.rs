//! Estimators of what a sensor measures. They never import one another.

mod path;

pub use path::PathTracer;

use crate::Spectrum;
use crate::path::Workspace;
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::Ray;

/// An estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// Sensor subpaths with next-event estimation.
    Path(PathTracer),
}

/// Names of the estimators, as scene files and command lines use them.
pub const NAMES: [&str; 1] = ["path"];

impl Integrator {
    /// One unbiased sample of the radiance that arrives along a sensor ray. `lanes` is the number of
    /// channels in use.
    pub fn radiance(
        &self,
        scene: &Scene,
        ray: Ray,
        lanes: usize,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) -> Spectrum {
        match self {
            Integrator::Path(path) => path.radiance(scene, ray, lanes, sampler, ws),
        }
    }

    /// Name, as in [`NAMES`].
    pub fn name(&self) -> &'static str {
        match self {
            Integrator::Path(_) => "path",
        }
    }
}
