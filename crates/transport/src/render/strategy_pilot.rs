//! How often the strategies of bidirectional path tracing are to be used, told from a pilot in which all are.
//!
//! The samples of the pilot are not part of the image, so that the choice does not bias it.
//!
//! Theory: docs/theory.md#strategy-rates.

use super::Prepared;
use super::pilot::search;
use super::pilot_pixels::{spread, tile_of};
use super::source::LightSamples;
use super::splats::splat;
use crate::integrator::Contribution;
use crate::path::{StrategyFind, StrategyKind, StrategySample, StrategyTraining, Workspace};

/// Pixels of the pilot, spread over the image, of which each has two samples.
const PIXELS: usize = 512;
/// No fewer than these, where many groups of channels share them.
const LEAST_PIXELS: usize = 64;
/// Numbers of the pilot's samples start here, where no render gets to.
const FIRST: u64 = 1 << 63;
/// Cells of the image along either side, of which the brightness is told.
const SIDE: usize = 8;
/// The brightness of a cell is known as if so many samples had found the image's mean.
const PRIOR: f64 = 4.0;
/// Errors are relative to the brightness of a cell plus this share of the image's.
const DARK: f64 = 0.05;

/// With the probabilities of strategies, of one of so many groups of channels, and that with which to search for further branches.
pub(super) fn prepared(light: &LightSamples, groups: usize) -> Prepared {
    let mut ws = light.source.workspace();
    let mut finds = Finds::default();
    let film = light.source.scene.film();
    let mut found = Vec::new();
    for i in 0..(PIXELS / groups).max(LEAST_PIXELS) {
        if i > 0 && ws.stats().cost() >= light.source.pilot_work {
            break;
        }
        let pixel = spread(i, film);
        for k in 0..2 {
            found.clear();
            // Each in a replicate of its own: samples of one replicate are not independent.
            let sample = FIRST + light.source.replicates.size() * (2 * i as u64 + k);
            light.take(pixel, sample, &mut ws, &mut found);
            finds.add(light, pixel, &found);
        }
    }
    let mut prepared = light.source.prepared.clone();
    prepared.strategies = finds.training(&ws).best();
    if !light.source.scene.is_straight() {
        prepared.search = search(&ws);
    }
    prepared
}

/// A contribution, and the cell that it belongs to.
#[derive(Clone, Copy, Debug)]
struct Find {
    cell: usize,
    is_splat: bool,
    find: StrategyFind,
}

/// What the samples of the pilot have found.
#[derive(Clone, Debug, Default)]
struct Finds {
    /// The cell of the pixel of each sample, and what it found.
    samples: Vec<(usize, Vec<Find>)>,
}

impl Finds {
    fn add(&mut self, light: &LightSamples, pixel: usize, found: &[Contribution]) {
        let finds = found.iter().filter_map(|c| find(light, pixel, c));
        self.samples.push((cell_of(light, pixel), finds.collect()));
    }

    /// Brightness of the cells: of a share of the image each, whose pixels have some of the samples.
    fn brightness(&self) -> (Vec<f64>, f64) {
        let (mut sums, mut samples) = (vec![0.0; SIDE * SIDE], vec![0.0; SIDE * SIDE]);
        for (cell, finds) in &self.samples {
            samples[*cell] += 1.0;
            for Find { cell, find, .. } in finds {
                // A pixel's brightness is what a path brings to it times the number of pixels, and samples are spread evenly over these.
                sums[*cell] += find.value;
            }
        }
        let mean = sums.iter().sum::<f64>() / self.samples.len().max(1) as f64;
        let cells = sums.iter().zip(&samples);
        let cells = cells.map(|(sum, n)| (sum + PRIOR * mean) / (n + PRIOR));
        (cells.collect(), mean)
    }

    fn training(self, ws: &Workspace) -> StrategyTraining {
        let (brightness, mean) = self.brightness();
        let importance = |cell: usize| (brightness[cell].powi(2) + (DARK * mean).powi(2)).recip();
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

/// What a contribution to a sample of a pixel is to the training; none if it is not sound.
fn find(light: &LightSamples, pixel: usize, contribution: &Contribution) -> Option<Find> {
    let (s, t) = contribution.strategy;
    // A path with more than one pixel has the root of the sum of the squares in one of them: it is that which its variance tells.
    let (mut squares, mut place) = (0.0, pixel);
    splat(light.source, pixel, contribution.image, |pixel, filter| {
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

/// The cell of a pixel.
fn cell_of(light: &LightSamples, pixel: usize) -> usize {
    tile_of(pixel, light.source.scene.film(), SIDE)
}
