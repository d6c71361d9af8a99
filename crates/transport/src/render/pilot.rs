//! What is found out about a scene before the render: how often it pays to search for further branches, to
//! connect vertices to emitters, and to let paths go on.
//!
//! The samples of the pilot are not part of the image, so that the choices do not bias it.

use super::Prepared;
use super::source::Source;
use crate::integrator::Integrator;
use crate::path::Workspace;

/// Pixels of the pilot, spread over the image, of which each has two samples.
const PIXELS: usize = 256;
/// Numbers of the pilot's samples start here, where no render gets to.
const FIRST: u64 = 1 << 63;
/// The search is never given up altogether where branches cannot be ruled out: that would be biased.
const LEAST: f64 = 1.0 / 16.0;

/// With the probability with which to search for further branches, the share of searches that find one within
/// bounds; those of connections to emitters; and what paths may still bring.
pub(super) fn prepared(source: &Source) -> Prepared {
    let mut prepared = source.prepared.clone();
    let mut ws = source.workspace();
    let surveys = matches!(source.integrator, Integrator::Path(_));
    if source.scene.is_straight() && !surveys {
        return prepared;
    }
    ws.survey = surveys.then(Box::default);
    ws.departures = surveys.then(Box::default);
    let pairs = sample(source, &mut ws);
    let weights = weights(&pairs);
    let stats = ws.stats();
    let counts = stats.connections;
    let yields = counts.secondary as f64 / counts.searches.max(1) as f64;
    if !source.scene.is_straight() {
        prepared.search = yields.clamp(LEAST, 1.0);
    }
    if let Some(survey) = ws.survey {
        prepared.rates = survey.best(stats.cost(), &weights);
    }
    if let Some(departures) = ws.departures {
        let squares = pairs
            .iter()
            .zip(&weights)
            .map(|([a, b], w)| w * (a - b).powi(2));
        prepared.prospects = departures.prospects(squares.sum::<f64>() / stats.cost());
    }
    prepared
}

/// What the variances of pixels are to count, given their samples. Those brighter than the image's mean count relative to their
/// brightness: the edges of lamps, say, and rare bright samples are noisy whatever paths do, and are not to make all
/// else look unimportant.
fn weights(pairs: &[[f64; 2]]) -> Vec<f64> {
    let means = || pairs.iter().map(|[a, b]| 0.5 * (a + b));
    let mean = means().sum::<f64>() / pairs.len() as f64;
    means().map(|m| (m / mean).max(1.0).powi(-2)).collect()
}

/// Takes the samples; returns those of each pixel, summed over channels.
fn sample(source: &Source, ws: &mut Workspace) -> Vec<[f64; 2]> {
    let spec = source.scene.film();
    let pixels = spec.width * spec.height;
    let mut found = Vec::new();
    let pairs = (0..PIXELS).map(|i| {
        // Multiples of the golden ratio spread evenly.
        let place = (0.618_033_988_749_894_9 * i as f64).fract();
        let pixel = ((place * pixels as f64) as usize).min(pixels - 1);
        [0, 1].map(|k| {
            found.clear();
            if let Some(survey) = &mut ws.survey {
                survey.begin();
            }
            // Each in a set of its own: samples of one set are not independent.
            let sample = FIRST + source.sets().size() * (2 * i + k) as u64;
            source.sample(pixel, sample, ws, &mut found);
            let values = found.iter().map(|c| c.weighted().sum());
            values.sum::<f64>()
        })
    });
    pairs.collect()
}
