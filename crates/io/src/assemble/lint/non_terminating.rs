//! Check for very long paths, in a medium that is too dense to leave and absorbs almost no light.

use super::{UniformPart, uniform_parts};
use crate::diagnostic::lints;
use transport::integrator::Integrator;
use transport::scene::{Region, Scene, SceneProblem, Subject};

/// Number of collisions of a path above which the scene is probably wrong. A path of this length
/// takes a tenth of a second.
const MAX_COLLISIONS: f64 = 1e6;

/// Returns a warning for each uniform medium, or label of a medium, in which paths collide very
/// often, unless something else ends them.
pub(super) fn warnings(scene: &Scene, integrator: &Integrator) -> Vec<SceneProblem> {
    let end = integrator.depths().0.map_or(f64::INFINITY, f64::from);
    let media = scene.media().iter().zip(scene.regions()).enumerate();
    let parts = media.flat_map(|(i, (medium, region))| {
        let parts = uniform_parts(medium, region).into_iter();
        parts.map(move |part| (i, collisions(&part, region).min(end), part.name))
    });
    parts
        .filter(|(_, number, _)| *number > MAX_COLLISIONS)
        .map(|(i, number, name)| warning(i, &name, number))
        .collect()
}

/// Returns the mean number of collisions of light that enters a uniform medium, in the channel with
/// the most collisions. In a medium without absorption, the mean length of a path is the mean chord
/// 4V/S, whatever the scattering (Blanco & Fournier, Europhys. Lett. 61, 2003). Absorption ends a
/// path after σ_t/σ_a collisions on average.
fn collisions(part: &UniformPart, region: &Region) -> f64 {
    if region.aabb.is_empty() {
        return 0.0;
    }
    let size = region.aabb.max - region.aabb.min;
    let chord = 2.0 / size.map(f64::recip).element_sum();
    let until_absorbed = part.extinction.zip(part.scattering, |t, s| {
        if t > 0.0 { t / (t - s).max(0.0) } else { 0.0 }
    });
    part.extinction
        .zip(until_absorbed, |t, n| n.min(t * chord))
        .max()
}

fn warning(medium: usize, name: &str, number: f64) -> SceneProblem {
    SceneProblem::warning(
        lints::LONG_PATHS,
        Subject::Medium(medium),
        format!(
            "light collides about {number:.0e} times in medium '{name}': its paths take very long"
        ),
        "check the units of its coefficients, or end paths by the integrator's 'max_depth'",
    )
}
