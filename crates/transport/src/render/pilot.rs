//! What is found out about a scene before the render: how often it pays to search for further branches, to
//! connect vertices to emitters, and to let paths go on; and whether it does to force collisions.
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
/// Number of first edges on which collisions are forced, if at all: of later ones there is little to gain.
const FORCED: u32 = 3;
/// As often are the samples taken again by which it is seen whether they pay,
const ROUNDS: u64 = 3;
/// which they must do by this factor: few samples may deceive.
const CLEARLY: f64 = 1.1;

/// With the probability with which to search for further branches, the share of searches that find one within
/// bounds; those of connections to emitters; what paths may still bring; and on how many edges to force collisions.
pub(super) fn prepared(source: &Source) -> Prepared {
    let is_path = matches!(source.integrator, Integrator::Path(_));
    if source.scene.is_straight() && !is_path {
        return source.prepared.clone();
    }
    let (plain, first) = surveyed(source, is_path, 0);
    if !(is_path && source.scene.is_dark()) {
        return plain;
    }
    let (forced, second) = surveyed(source, is_path, FORCED);
    // Bright samples would make the pixels that they are in count little: what pixels count is told by other samples.
    let weights = weights(&[first, second]);
    let [without, with] = [&plain, &forced].map(|prepared| tried(source, prepared, &weights));
    let pays = (0..2).all(|i| with[i] * CLEARLY < without[i]);
    if pays { forced } else { plain }
}

/// Variance × work of samples taken in a way, up to a factor: with pixels that count so much, and with all alike.
fn tried(source: &Source, prepared: &Prepared, weights: &[f64]) -> [f64; 2] {
    let take = |round| Pilot::take(source.workspace_of(prepared), source, round);
    let pilots: Vec<Pilot> = (1..=ROUNDS).map(take).collect();
    let work: f64 = pilots.iter().map(Pilot::cost).sum();
    [weights, &[1.0; PIXELS]].map(|weights| {
        let scatter = pilots.iter().map(|pilot| pilot.scatter(weights));
        scatter.sum::<f64>() * work
    })
}

/// What a pilot says, with so many edges whose collisions are forced. Whether it surveys is for paths from the sensor.
fn surveyed(source: &Source, surveys: bool, forced: u32) -> (Prepared, Pairs) {
    let mut prepared = Prepared {
        forced,
        ..source.prepared.clone()
    };
    let mut ws = source.workspace_of(&prepared);
    ws.survey = surveys.then(Box::default);
    ws.departures = surveys.then(Box::default);
    let pilot = Pilot::take(ws, source, 0);
    let weights = weights(std::slice::from_ref(&pilot.pairs));
    let (worth, cost) = (pilot.scatter(&weights) / pilot.cost(), pilot.cost());
    if !source.scene.is_straight() {
        let counts = pilot.ws.stats.connections;
        let yields = counts.secondary as f64 / counts.searches.max(1) as f64;
        prepared.search = yields.clamp(LEAST, 1.0);
    }
    if let Some(survey) = pilot.ws.survey {
        prepared.rates = survey.best(cost, &weights);
    }
    if let Some(departures) = pilot.ws.departures {
        prepared.prospects = departures.prospects(worth);
    }
    (prepared, pilot.pairs)
}

/// What the variances of pixels are to count, given their samples. Those brighter than the image's mean count relative to their
/// brightness: the edges of lamps, say, and rare bright samples are noisy whatever paths do, and are not to make all
/// else look unimportant.
fn weights(pilots: &[Pairs]) -> Vec<f64> {
    let brightness = |i: usize| pilots.iter().flat_map(move |pairs| pairs[i]).sum::<f64>();
    let mean = (0..PIXELS).map(brightness).sum::<f64>() / PIXELS as f64;
    let weight = |i| (brightness(i) / mean).max(1.0).powi(-2);
    (0..PIXELS).map(weight).collect()
}

/// The samples of each pixel of a pilot, summed over channels.
type Pairs = Vec<[f64; 2]>;

/// Samples that were taken.
struct Pilot {
    pairs: Pairs,
    /// What they have left behind.
    ws: Workspace,
}

impl Pilot {
    /// Takes samples; those of each `round` are others.
    fn take(mut ws: Workspace, source: &Source, round: u64) -> Self {
        let pairs = sample(source, &mut ws, round);
        Pilot { pairs, ws }
    }

    /// Sum of the squares of the differences between the samples of a pixel.
    fn scatter(&self, weights: &[f64]) -> f64 {
        let pairs = self.pairs.iter().zip(weights);
        pairs.map(|([a, b], weight)| weight * (a - b).powi(2)).sum()
    }

    fn cost(&self) -> f64 {
        self.ws.stats().cost()
    }
}

/// Takes the samples of a round; returns them.
fn sample(source: &Source, ws: &mut Workspace, round: u64) -> Pairs {
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
            let number = 2 * (PIXELS as u64 * round + i as u64) + k;
            let sample = FIRST + source.sets().size() * number;
            source.sample(pixel, sample, ws, &mut found);
            let values = found.iter().map(|c| c.weighted().sum());
            values.sum::<f64>()
        })
    });
    pairs.collect()
}
