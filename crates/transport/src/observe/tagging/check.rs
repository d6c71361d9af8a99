//! What tagged light needs, and what pictures of it do without.

use super::SoundInMedia;
use crate::scene::{ProblemSeverity, Scene, SceneProblem, Subject};

/// Makes what the phases of light are found with: the amplitudes of sound in media, which their [memory](crate::medium::Medium::memory) then counts.
/// Whoever tags light does so by himself, if that has not been done before.
pub fn prepare(scene: &Scene) {
    SoundInMedia::of(scene);
}

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
