//! What pictures of tagged light do without.

use crate::scene::{ProblemSeverity, Scene, SceneProblem, Subject};

/// What a scene has whose light a picture cannot tag: errors.
pub fn problems(scene: &Scene) -> Vec<SceneProblem> {
    let lights = scene.volume_lights().map(|(i, _)| SceneProblem {
        severity: ProblemSeverity::Error,
        subject: Subject::Emitter(i),
        message: "the light of volumes cannot be followed as tagged light from the sensor".into(),
        help:
            "leave out the integrator tagged, or measure by meters, which follow it from the volume"
                .into(),
    });
    lights.collect()
}
