//! What a caller may ask for.

use crate::input::Limits;
use crate::loading::Loading;
use transport::scene::Lint;

/// What a caller may change about a scene file.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Parameters that replace those of `<default>`, by name. [`load_scene`](crate::load_scene) takes them; a scene description has its
    /// parameters already.
    pub defines: Vec<(String, String)>,
    /// Estimator to use instead of the scene's.
    pub integrator: Option<String>,
    /// Samples per pixel to use instead of the scene's.
    pub samples: Option<u64>,
    /// Sampler to use instead of the scene's: `independent`, `ldsampler`, or `ldsampler:64` with larger replicates.
    pub sampler: Option<String>,
    /// Whether noisy pixels get more samples, even if the scene's sampler does not ask for it.
    pub adaptive: bool,
    /// Whether media whose index varies get the index against which it is told, or that of what is around: the scene without its flow.
    pub undisturbed: bool,
    /// Checks whose warnings and notes are left out.
    pub silenced: Vec<Lint>,
    /// How much memory each data file may take.
    pub limits: Limits,
    /// Progress of loading, for threads that watch it or end it.
    pub loading: Loading,
}
