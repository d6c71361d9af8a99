//! Checks of a whole scene that can be rendered but is probably not as intended.

mod costly;
mod coverage;
mod differences;
mod entry;
mod extinction_units;
mod modulation;
mod non_terminating;
mod overlaps;
mod radians;
mod reach;

pub use costly::steps_across;
pub use coverage::SpecularSurfaces;
pub(super) use coverage::{complete, warnings as missing_light};
pub(super) use differences::{Known, of as differences};
pub(super) use overlaps::note as overlaps;
pub(super) use radians::warning as narrow_view;
pub(super) use reach::warnings as reach;

use super::instrument::Instrument;
use super::integrator::Method;
use transport::scene::{Scene, SceneProblem, Subject};

/// Returns all warnings about a scene, and about its rendering or measurement.
pub(super) fn warnings(
    scene: &Scene,
    method: &Method,
    instruments: &[Instrument],
) -> Vec<SceneProblem> {
    // Without light a picture is black, but other quantities are still valid.
    let matters = |p: &&SceneProblem| !(method.is_aov() && p.subject == Subject::Scene);
    let mut warnings: Vec<_> = scene.warnings().iter().filter(matters).cloned().collect();
    warnings.extend(scene.at_all_instants(costly::problems));
    warnings.extend(entry::warnings(scene));
    if let Some(integrator) = method.renderer.integrator() {
        warnings.extend(non_terminating::warnings(scene, integrator));
        if instruments.is_empty() {
            warnings.extend(coverage::warnings(scene, integrator));
        }
    }
    warnings.extend(extinction_units::warnings(scene, &warnings));
    warnings.extend(modulation::warning(scene, instruments));
    warnings.extend(instruments.iter().filter_map(|i| i.warning(scene)));
    warnings
}
