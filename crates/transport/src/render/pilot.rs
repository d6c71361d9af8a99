//! Pilot of a render. It determines how often to search for further branches, how often to connect
//! vertices to emitters, when to terminate paths, and how paths begin.
//!
//! The samples of the pilot are not part of the image, so its choices do not bias the image.
//!
//! Theory: docs/theory.md#next-event-rates, docs/theory.md#first-vertex-techniques.

use super::Prepared;
use super::pilot_pixels::{FIRST_SAMPLE, Pairs, spread, weights};
use super::source::LightSamples;
use super::splitting;
use crate::integrator::Integrator;
use crate::path::{FirstVertexTechniques, Workspace};
use std::ops::Add;

/// Pixels of the pilot, spread over the image. Each has two samples.
const PIXELS: usize = 256;
/// Lowest probability of a search where branches cannot be ruled out. Without any search the image
/// would be biased.
const MIN_SEARCH_PROBABILITY: f64 = 1.0 / 16.0;
/// Largest work of a pilot's sample for which forced collisions are tried, in the unit of
/// [`Stats::cost`](crate::stats::Stats::cost): about 15 µs. More work is mostly caused by
/// connections along bent rays. More vertices would need more connections, and the comparison would
/// delay the start of the render.
const MAX_FORCED_WORK: f64 = 220.0;
/// Number of first edges with forced collisions. Later edges gain little.
const FORCED_EDGES: u32 = 3;
/// Maximum number of rounds that compare samples with and without a technique.
const MAX_ROUNDS: u64 = 3;
/// Ratio of the two efficiencies at which the comparison ends early.
const CLEAR_RATIO: f64 = 1.5;
/// Ratio by which forced collisions must be more efficient to be used. The efficiencies are
/// uncertain, because the pilot has few samples.
const MIN_FORCED_GAIN: f64 = 1.1;

/// Runs the pilot. Returns the probability of a search for further branches: the fraction of
/// searches that find one, within bounds. For `path` it also determines the probabilities of
/// connections to emitters, the adjoint estimate, and the first-vertex techniques.
pub(super) fn prepared(light: &LightSamples) -> Prepared {
    let is_path = matches!(light.integrator, Integrator::Path(_));
    if light.source.scene.is_straight() && !is_path {
        return light.source.prepared.clone();
    }
    let mut best = PilotResult::new(light, is_path, FirstVertexTechniques::default());
    if !is_path {
        return best.prepared;
    }
    if light.source.scene.has_dielectrics() && splitting::pays(light, &best.prepared) {
        let splitting = FirstVertexTechniques {
            splitting: true,
            ..best.prepared.first_vertex
        };
        best = PilotResult::new(light, true, splitting);
    }
    if light.source.scene.is_dark() && best.cost <= MAX_FORCED_WORK {
        best = best.or_forced(light);
    }
    best.prepared
}

/// Result of a pilot.
struct PilotResult {
    prepared: Prepared,
    pairs: Pairs,
    /// Work per sample.
    cost: f64,
}

impl PilotResult {
    /// Runs a pilot with the given first-vertex techniques. If it `trains`, it also determines
    /// next-event rates and the adjoint estimate, for paths from the sensor.
    fn new(light: &LightSamples, trains: bool, first_vertex: FirstVertexTechniques) -> Self {
        let mut prepared = Prepared {
            first_vertex,
            ..light.source.prepared.clone()
        };
        let mut ws = light.source.workspace_of(&prepared);
        ws.nee_training = trains.then(Box::default);
        ws.adjoint_training = trains.then(Box::default);
        let pilot = Pilot::take(ws, light, 0);
        let weights = weights(&[&pilot.pairs]);
        let (worth, cost) = (pilot.scatter(&weights) / pilot.cost(), pilot.cost());
        if !light.source.scene.is_straight() {
            prepared.search = search(&pilot.ws);
        }
        if let Some(nee_training) = pilot.ws.nee_training {
            prepared.rates = nee_training.best(cost, &weights);
        }
        if let Some(adjoint_training) = pilot.ws.adjoint_training {
            prepared.adjoint = adjoint_training.estimate(worth);
        }
        PilotResult {
            prepared,
            cost: cost / (2 * pilot.pairs.len()) as f64,
            pairs: pilot.pairs,
        }
    }

    /// Returns the pilot with forced first collisions if it is clearly more efficient, else `self`.
    /// Its variance × work must be smaller with less weight for bright pixels, and also with equal
    /// weights.
    fn or_forced(self, light: &LightSamples) -> Self {
        let first_vertex = FirstVertexTechniques {
            forced_collisions: FORCED_EDGES,
            ..self.prepared.first_vertex
        };
        let other = PilotResult::new(light, true, first_vertex);
        // Weigh pixels by the samples of both pilots, not by the samples that are compared. A
        // bright sample has a low weight, which would hide the variance that the sample causes.
        let weights = weights(&[&self.pairs, &other.pairs]);
        let mut sums = [Tried::default(); 2];
        let mut gains = [1.0; 2];
        for round in 1..=MAX_ROUNDS {
            let take = |one: &Self| {
                Tried::new(
                    Pilot::take(light.source.workspace_of(&one.prepared), light, round),
                    &weights,
                )
            };
            let (a, b) = rayon::join(|| take(&self), || take(&other));
            sums = [sums[0] + a, sums[1] + b];
            gains = [0, 1].map(|i| sums[0].product(i) / (MIN_FORCED_GAIN * sums[1].product(i)));
            if gains.iter().all(|gain| *gain > CLEAR_RATIO)
                || gains.iter().any(|gain| gain * CLEAR_RATIO < 1.0)
            {
                break;
            }
        }
        if gains.iter().all(|gain| *gain > 1.0) {
            other
        } else {
            self
        }
    }
}

/// Returns the probability of a search for further branches: the fraction of searches that found
/// one, within bounds.
pub(super) fn search(ws: &Workspace) -> f64 {
    let counts = ws.stats.connections;
    let yields = counts.secondary as f64 / counts.searches.max(1) as f64;
    yields.clamp(MIN_SEARCH_PROBABILITY, 1.0)
}

/// Variance and work of samples of one technique.
#[derive(Clone, Copy, Default)]
struct Tried {
    /// Variance, up to a factor: with weighted pixels, and with equal weights.
    scatter: [f64; 2],
    work: f64,
}

impl Tried {
    fn new(pilot: Pilot, weights: &[f64]) -> Self {
        Tried {
            scatter: [weights, &vec![1.0; weights.len()]].map(|weights| pilot.scatter(weights)),
            work: pilot.cost(),
        }
    }

    /// Returns the variance × work.
    fn product(&self, kind: usize) -> f64 {
        self.scatter[kind] * self.work
    }
}

impl Add for Tried {
    type Output = Tried;
    fn add(self, o: Tried) -> Tried {
        Tried {
            scatter: [0, 1].map(|i| self.scatter[i] + o.scatter[i]),
            work: self.work + o.work,
        }
    }
}

/// Samples of a pilot.
struct Pilot {
    pairs: Pairs,
    /// Workspace after the samples, with their counts and training data.
    ws: Workspace,
}

impl Pilot {
    /// Takes samples; the samples of different rounds are independent.
    fn take(mut ws: Workspace, light: &LightSamples, round: u64) -> Self {
        let pairs = sample(light, &mut ws, round, light.source.pilot_work);
        Pilot { pairs, ws }
    }

    /// Returns the sum of the squared differences between the two samples of each pixel, weighted.
    fn scatter(&self, weights: &[f64]) -> f64 {
        let pairs = self.pairs.iter().zip(weights);
        pairs.map(|([a, b], weight)| weight * (a - b).powi(2)).sum()
    }

    fn cost(&self) -> f64 {
        self.ws.stats().cost()
    }
}

/// Takes and returns the samples of a round, until their work exceeds `most`.
fn sample(light: &LightSamples, ws: &mut Workspace, round: u64, most: f64) -> Pairs {
    let film = light.source.scene.film();
    let mut found = Vec::new();
    let mut pairs = Vec::with_capacity(PIXELS);
    while pairs.len() < PIXELS && (pairs.is_empty() || ws.stats().cost() < most) {
        let i = pairs.len();
        let pixel = spread(i, film);
        pairs.push([0, 1].map(|k| {
            found.clear();
            if let Some(nee_training) = &mut ws.nee_training {
                nee_training.begin();
            }
            // Place each sample in its own replicate: samples of one replicate are not independent.
            let number = 2 * (PIXELS as u64 * round + i as u64) + k;
            let sample = FIRST_SAMPLE + light.source.replicates.size() * number;
            light.take_pixel(pixel, sample, ws, &mut found);
            let values = found.iter().map(|c| c.weighted().sum());
            values.sum::<f64>()
        }));
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spectrum;
    use crate::emitter::{Emitter, Environment};
    use crate::film::Filter;
    use crate::integrator::PathTracer;
    use crate::medium::Medium;
    use crate::render::source::Source;
    use crate::render::{Handle, RenderOptions};
    use crate::scene::{FilmSpec, Parts, Scene};
    use crate::sensor::{Perspective, Sensor};
    use eikonal::field::Constant;
    use glam::DAffine3;

    fn sky() -> Scene {
        let sensor = Perspective::new(DAffine3::IDENTITY, 0.5, 1.0);
        Scene::new(Parts {
            partitions: Vec::new(),
            objects: Vec::new(),
            media: vec![Medium::transparent("ambient", Constant::new(1.0))],
            emitters: vec![Emitter::Environment(Environment::Constant(Spectrum::ONE))],
            sensor: Sensor::Perspective(sensor),
            film: FilmSpec {
                width: 4,
                height: 4,
                channels: 1,
                group_size: Spectrum::CHANNELS,
                filter: Filter::Box,
                window: None,
            },
            tolerance: Default::default(),
            reflections: 0,
            measured: eikonal::Aabb::EMPTY,
        })
        .unwrap()
    }

    /// Each sample of a sky is one edge of one step, which is sixteen units of work; a pair has two
    /// samples.
    #[test]
    fn pilots_end_after_their_work() {
        let (scene, handle) = (sky(), Handle::default());
        let options = RenderOptions::new(Integrator::Path(PathTracer::default()), 1, 1);
        let prepared = super::super::prepare(std::slice::from_ref(&scene), &options, None, &handle);
        let source = Source::new(&scene, 0, &options, prepared[0].clone(), &handle);
        let light = source.light(Integrator::Path(PathTracer::default()));
        let pairs = |most| sample(&light, &mut source.workspace(), 0, most);
        assert_eq!(pairs(f64::INFINITY).len(), PIXELS);
        assert_eq!((pairs(100.0).len(), pairs(0.0).len()), (4, 1));
        assert_eq!(weights(&[&pairs(100.0), &pairs(200.0)]).len(), 4);
    }
}
