//! What is found out about a scene before the render: how often it pays to search for further branches, and to
//! connect vertices to emitters.
//!
//! The samples of the pilot are not part of the image, so that the choices do not bias it.

use super::source::Source;
use crate::integrator::Integrator;
use crate::path::{Rates, Survey, Workspace};

/// Pixels of the pilot, spread over the image, of which each has two samples.
const PIXELS: usize = 256;
/// Numbers of the pilot's samples start here, where no render gets to.
const FIRST: u64 = 1 << 63;
/// The search is never given up altogether where branches cannot be ruled out: that would be biased.
const LEAST: f64 = 1.0 / 16.0;

/// The probability with which to search for further branches, the share of searches that find one within
/// bounds, and those of connections to emitters.
pub(super) fn probabilities(source: &Source) -> (f64, Rates) {
    let mut ws = source.workspace();
    let surveys = matches!(source.integrator, Integrator::Path(_));
    if source.scene.is_straight() && !surveys {
        return (1.0, Rates::default());
    }
    ws.survey = surveys.then(Box::<Survey>::default);
    sample(source, &mut ws);
    let stats = ws.stats();
    let counts = stats.connections;
    let yields = counts.secondary as f64 / counts.searches.max(1) as f64;
    let search = match source.scene.is_straight() {
        true => 1.0,
        false => yields.clamp(LEAST, 1.0),
    };
    let rates = ws
        .survey
        .map_or(Rates::default(), |survey| survey.best(stats.cost()));
    (search, rates)
}

/// Takes the samples.
fn sample(source: &Source, ws: &mut Workspace) {
    let spec = source.scene.film();
    let pixels = spec.width * spec.height;
    let mut found = Vec::new();
    for i in 0..PIXELS {
        // Multiples of the golden ratio spread evenly.
        let place = (0.618_033_988_749_894_9 * i as f64).fract();
        let pixel = ((place * pixels as f64) as usize).min(pixels - 1);
        for k in 0..2 {
            found.clear();
            if let Some(survey) = &mut ws.survey {
                survey.begin();
            }
            // Each in a set of its own: samples of one set are not independent.
            let sample = FIRST + source.sets().size() * (2 * i + k) as u64;
            source.sample(pixel, sample, ws, &mut found);
        }
    }
}
