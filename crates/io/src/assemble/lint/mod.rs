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
use transport::Spectrum;
use transport::medium::{Medium, MediumLabel};
use transport::scene::{Region, Scene, SceneProblem, Subject};

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

/// Part of a medium with uniform coefficients: a label, or all of a medium. Its name is the name in
/// records and in derivatives.
struct UniformPart {
    name: String,
    extinction: Spectrum,
    scattering: Spectrum,
}

/// Returns the parts of a medium with uniform coefficients.
fn uniform_parts(medium: &Medium, region: &Region) -> Vec<UniformPart> {
    if let Some(labels) = &medium.labels {
        let part = |label: &MediumLabel| UniformPart {
            name: label.name.clone(),
            extinction: label.extinction,
            scattering: label.extinction - label.absorption,
        };
        return labels.list().iter().map(part).collect();
    }
    let extinction = medium.uniform_extinction().into_iter();
    let part = extinction.map(|extinction| UniformPart {
        name: medium.name.clone(),
        extinction,
        scattering: medium.scattering(region.aabb.center()),
    });
    part.collect()
}
