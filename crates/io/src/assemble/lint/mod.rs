//! Checks of a whole scene that can be rendered but is probably not as intended.

mod costly;
mod coverage;
mod differences;
mod entry;
mod extinction_units;
mod non_terminating;
mod overlaps;
mod radians;
mod reach;

pub use costly::steps_across;
pub use coverage::Walls;
pub(super) use coverage::{complete, warnings as missing_light};
pub(super) use differences::{Known, of as differences};
pub(super) use overlaps::note as overlaps;
pub(super) use radians::warning as narrow_view;
pub(super) use reach::warnings as reach;

use super::instrument::Instrument;
use super::integrator::Method;
use transport::scene::{Scene, SceneProblem, Subject};

/// Returns all warnings about a scene, and about its rendering or measurement.
pub(super) fn doubts(
    scene: &Scene,
    method: &Method,
    instruments: &[Instrument],
) -> Vec<SceneProblem> {
    // Without light a picture is black, but other quantities are still valid.
    let matters = |p: &&SceneProblem| !(method.is_aov() && p.subject == Subject::Scene);
    let mut doubts: Vec<_> = scene.warnings().iter().filter(matters).cloned().collect();
    doubts.extend(scene.at_all_instants(costly::problems));
    doubts.extend(entry::warnings(scene));
    if let Some(integrator) = method.renderer.integrator() {
        doubts.extend(non_terminating::warnings(scene, integrator));
        if instruments.is_empty() {
            doubts.extend(coverage::warnings(scene, integrator));
        }
    }
    doubts.extend(extinction_units::warnings(scene, &doubts));
    doubts.extend(instruments.iter().filter_map(|i| i.doubt(scene)));
    doubts
}
