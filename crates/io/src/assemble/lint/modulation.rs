//! Check for phases of modulated light in media without an index.

use crate::assemble::Instrument;
use crate::diagnostic::lints;
use glam::DVec3;
use transport::scene::{Scene, SceneProblem, Subject};

/// Returns a warning if meters measure the phase of modulated light, and all media that attenuate
/// light have the index 1.
pub(super) fn warning(scene: &Scene, instruments: &[Instrument]) -> Option<SceneProblem> {
    let mut meters = instruments.iter();
    let measured = meters.any(|i| i.meter.frequency_domain().is_some());
    let mut media = scene.media().iter().filter(|m| !m.is_transparent());
    let is_vacuum = media.clone().next().is_some()
        && media.all(|m| m.index.is_constant() && m.index.n(DVec3::ZERO) == 1.0);
    (measured && is_vacuum).then(|| {
        let message = "phases of modulated light are those of vacuum: no medium that attenuates light has an 'ior'";
        let help = "give media their index: 'ior' 1.37 for tissue";
        SceneProblem::warning(lints::MODULATION, Subject::Scene, message, help)
    })
}
