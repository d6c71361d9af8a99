//! Choice of the probabilities with which bidirectional path tracing uses its strategies, from a
//! pilot that uses all of them.
//!
//! The samples of the pilot are not part of the image, so the choice does not bias the image.
//!
//! Theory: docs/theory.md#strategy-rates.

use super::Prepared;
use super::pilot::search;
use super::pilot_pixels::{spread, tile_of};
use super::source::LightSamples;
use super::splats::{Place, splat};
use crate::film::Footprint;
use crate::integrator::Contribution;
use crate::path::{StrategyFind, StrategyKind, StrategySample, StrategyTraining, Workspace};

/// Pixels of the pilot, spread over the image. Each has two samples.
const PIXELS: usize = 512;
/// Minimum number of pixels, where many groups of channels share the pilot.
const MIN_PIXELS: usize = 64;
/// First number of the pilot's samples, beyond the numbers of all renders.
const FIRST_SAMPLE: u64 = 1 << 63;
/// Cells along either side of the image, in which brightness is estimated.
const CELLS_PER_SIDE: usize = 8;
/// Number of samples with the image's mean that are added to each cell's samples, to estimate its
/// brightness.
const PRIOR_SAMPLES: f64 = 4.0;
/// Brightness d of dark cells, relative to the image's mean. Errors are relative to √(μ² + d²) at
/// brightness μ.
const DARK_BRIGHTNESS: f64 = 0.05;

/// Runs the pilot of one of `groups` groups of channels. Returns the probabilities of strategies
/// and of a search for further branches.
pub(super) fn prepared(light: &LightSamples, groups: usize) -> Prepared {
    let mut ws = light.source.workspace();
    let mut finds = Finds::default();
    let film = light.source.scene.film();
    let mut found = Vec::new();
    for i in 0..(PIXELS / groups).max(MIN_PIXELS) {
        if i > 0 && ws.stats().cost() >= light.source.pilot_work {
            break;
        }
        let pixel = spread(i, film);
        for k in 0..2 {
            found.clear();
            // Place each sample in its own replicate: samples of one replicate are not independent.
            let sample = FIRST_SAMPLE + light.source.replicates.size() * (2 * i as u64 + k);
            light.take_pixel(pixel, sample, &mut ws, &mut found);
            finds.add(light, [pixel as u64, sample], &found);
        }
    }
    let mut prepared = light.source.prepared.clone();
    prepared.strategies = finds.training(&ws).best();
    if !light.source.scene.is_straight() {
        prepared.search = search(&ws);
    }
    prepared
}

/// Contribution, with the cell of the pixel that receives it.
#[derive(Clone, Copy, Debug)]
struct Find {
    cell: usize,
    is_splat: bool,
    find: StrategyFind,
}

/// Contributions of the pilot's samples.
#[derive(Clone, Debug, Default)]
struct Finds {
    /// Contributions of each sample, with the cell of the sample's pixel.
    samples: Vec<(usize, Vec<Find>)>,
}

impl Finds {
    fn add(&mut self, light: &LightSamples, [pixel, sample]: [u64; 2], found: &[Contribution]) {
        let sample = light.source.image_sample(sample);
        let (pixel, footprint) = (pixel as usize, light.source.footprint(&sample));
        let finds = found
            .iter()
            .filter_map(|c| find(light, pixel, &footprint, c));
        self.samples.push((cell_of(light, pixel), finds.collect()));
    }

    /// Returns the brightness of each cell, and its mean over the cells. A cell is a part of the
    /// image and has some of the samples.
    fn brightness(&self) -> (Vec<f64>, f64) {
        let (mut sums, mut samples) = (
            vec![0.0; CELLS_PER_SIDE * CELLS_PER_SIDE],
            vec![0.0; CELLS_PER_SIDE * CELLS_PER_SIDE],
        );
        for (cell, finds) in &self.samples {
            samples[*cell] += 1.0;
            for Find { cell, find, .. } in finds {
                // A pixel's brightness is its contribution from a path times the number of pixels.
                // Samples are spread evenly over the pixels.
                sums[*cell] += find.value;
            }
        }
        let mean = sums.iter().sum::<f64>() / self.samples.len().max(1) as f64;
        let cells = sums.iter().zip(&samples);
        let cells = cells.map(|(sum, n)| (sum + PRIOR_SAMPLES * mean) / (n + PRIOR_SAMPLES));
        (cells.collect(), mean)
    }

    fn training(self, ws: &Workspace) -> StrategyTraining {
        let (brightness, mean) = self.brightness();
        let importance =
            |cell: usize| (brightness[cell].powi(2) + (DARK_BRIGHTNESS * mean).powi(2)).recip();
        let sample = |(_, finds): &(usize, Vec<Find>)| {
            let mut sample = StrategySample::default();
            for find in finds {
                let list = if find.is_splat {
                    &mut sample.splats
                } else {
                    &mut sample.own
                };
                list.push(StrategyFind {
                    importance: importance(find.cell),
                    ..find.find
                });
            }
            sample
        };
        let pairs = self.samples.chunks_exact(2);
        let pairs = pairs.map(|pair| ([0, 1].map(|k| sample(&pair[k])), importance(pair[0].0)));
        StrategyTraining {
            pairs: pairs.collect(),
            work: ws.stats().cost(),
            parts: ws.strategy_work,
        }
    }
}

/// Converts a contribution to a sample of a pixel to training data; `None` if it is not finite.
fn find(
    light: &LightSamples,
    pixel: usize,
    footprint: &Footprint,
    contribution: &Contribution,
) -> Option<Find> {
    let (s, t) = contribution.strategy;
    // Enter a contribution to several pixels in one of them, as the root of the sum of squares,
    // which determines its variance.
    let (mut squares, mut place) = (0.0, pixel);
    let own = Place::of(light.source.cells.of_pixel(pixel), contribution.image);
    splat(light.source, footprint, own, |pixel, filter| {
        squares += filter * filter;
        place = pixel;
    });
    let find = StrategyFind {
        kind: StrategyKind::of(s as usize, t as usize)?,
        value: contribution.weighted().sum() * squares.sqrt(),
        shares: contribution.shares,
        importance: 0.0,
    };
    let is_sound = find.value.is_finite() && find.shares.iter().all(|share| share.is_finite());
    is_sound.then(|| Find {
        cell: cell_of(light, place),
        is_splat: contribution.image.is_some(),
        find,
    })
}

/// Returns the cell of a pixel.
fn cell_of(light: &LightSamples, pixel: usize) -> usize {
    tile_of(pixel, light.source.scene.film(), CELLS_PER_SIDE)
}
