//! Checks of scenes before renders of polarised light.

use crate::scene::{ProblemSeverity, Scene, SceneProblem, Subject};

/// Returns an error for each feature of a scene through which Stokes vectors cannot be followed.
pub fn problems(scene: &Scene) -> Vec<SceneProblem> {
    let panes = scene.objects().iter().enumerate();
    let panes = panes.filter(|(_, object)| object.bsdf.holds_pane());
    let panes = panes.map(|(i, _)| {
        error(
            Subject::Object(i),
            "polarised light cannot be followed through a thindielectric in another bsdf",
            "use a thindielectric alone, or a slab between two surfaces of bsdf dielectric",
        )
    });
    let filters = scene.objects().iter().enumerate();
    let filters = filters.filter(|(_, o)| o.bsdf.changes_what_passes() && o.is_interface());
    let filters = filters.map(|(i, _)| {
        error(
            Subject::Object(i),
            "polarised light cannot be followed through a filter or pane that separates media",
            "put it a little away from the boundary, within one medium",
        )
    });
    panes.chain(filters).collect()
}

/// Returns the names of surfaces and of media that scatter polarised light as unpolarised light.
pub fn depolarizing(scene: &Scene) -> [Vec<&str>; 2] {
    let surfaces = scene.objects().iter().filter(|o| o.bsdf.depolarizes());
    let media = scene.media().iter().filter(|medium| medium.scatters());
    [
        surfaces.map(|object| object.name.as_str()).collect(),
        media
            .filter(|medium| medium.phase.depolarizes())
            .map(|medium| medium.name.as_str())
            .collect(),
    ]
}

fn error(subject: Subject, message: &str, help: &str) -> SceneProblem {
    SceneProblem {
        severity: ProblemSeverity::Error,
        subject,
        message: message.into(),
        help: help.into(),
    }
}
