//! Options for loading a scene.

use crate::input::Limits;
use crate::loading::Loading;
use transport::scene::Lint;

/// Options that change how a scene file is loaded.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Names and values of parameters that replace `<default>` parameters.
    /// [`load_scene`](crate::load_scene) uses them; a scene description already has its parameters.
    pub defines: Vec<(String, String)>,
    /// Estimator that replaces the scene's.
    pub integrator: Option<String>,
    /// Number of samples per pixel that replaces the scene's.
    pub samples: Option<u64>,
    /// Sampler that replaces the scene's: `independent`, `ldsampler`, or `ldsampler:64` with larger
    /// replicates.
    pub sampler: Option<String>,
    /// True to give noisy pixels more samples, even if the scene's sampler does not request it.
    pub adaptive: bool,
    /// True to remove the flow from the scene: media with a varying index get their reference
    /// index, or the index of their surroundings.
    pub undisturbed: bool,
    /// Checks whose warnings and notes are suppressed.
    pub silenced: Vec<Lint>,
    /// Limits of the memory for each data file.
    pub limits: Limits,
    /// True to keep the parts of the scene for [`Loaded::with_changes`](crate::Loaded::with_changes).
    pub keeps_parts: bool,
    /// Progress of loading, for threads that watch or cancel it.
    pub loading: Loading,
}
