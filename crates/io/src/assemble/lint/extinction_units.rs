//! Check for extinctions that look like other units of length than the scene's.

use super::uniform_parts;
use crate::diagnostic::lints;
use transport::scene::{ProblemSeverity, Scene, SceneProblem, Subject};

/// Optical thickness of a medium above which its unit is probably wrong. The densest ordinary media
/// (milk, paint) in scenes of decimetres in millimetres stay below 1e4.
const MAX_THICKNESS: f64 = 1e5;
/// Optical thickness of the whole scene, filled with a medium, below which the light from the
/// medium is below the noise.
const MIN_THICKNESS: f64 = 1e-5;

/// Returns a warning for each uniform medium, or label of a medium, that is practically opaque, or
/// invisible even if it filled the scene. `warned` has other warnings: such media get none.
pub(super) fn warnings(scene: &Scene, warned: &[SceneProblem]) -> Vec<SceneProblem> {
    let media = scene.media().iter().zip(scene.regions()).enumerate();
    let is_new = |i: usize| {
        let long = |w: &SceneProblem| {
            w.subject == Subject::Medium(i)
                && w.severity == ProblemSeverity::Warning(lints::LONG_PATHS)
        };
        !warned.iter().any(long)
    };
    let found = media.flat_map(|(i, (medium, region))| {
        let is_wanted = !region.aabb.is_empty() && is_new(i);
        let parts = uniform_parts(medium, region).into_iter();
        let of_medium = parts.filter(|_| is_wanted).filter_map(|part| {
            let extinction = part.extinction.max();
            if extinction == 0.0 {
                return None;
            }
            let thickness = extinction * region.aabb.diagonal();
            let of_scene = extinction * 2.0 * scene.around().radius;
            let (what, thickness) = if thickness > MAX_THICKNESS {
                ("is opaque: its optical thickness is", thickness)
            } else if of_scene < MIN_THICKNESS {
                (
                    "is invisible: across the whole scene, its optical thickness is",
                    of_scene,
                )
            } else {
                return None;
            };
            Some(SceneProblem::warning(
                lints::EXTINCTION_UNITS,
                Subject::Medium(i),
                format!("medium '{}' {what} {thickness:.0e}", part.name),
                "check the unit of its extinction: it is per unit of length of the scene",
            ))
        });
        of_medium.collect::<Vec<_>>()
    });
    found.collect()
}
