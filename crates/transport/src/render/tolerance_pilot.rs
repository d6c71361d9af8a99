//! How accurate rays must be: as accurate as a pilot finds that the image can tell.
//!
//! The pilot takes samples with the tolerance of the scene, and again with the same random numbers and a looser one. It
//! chooses the loosest tolerance for which the mean of the differences, each without its sign, is below a tenth of the
//! noise of [`SAMPLES`] samples of a pixel. Its samples are not part of the image.
//!
//! Theory: docs/theory.md#tolerance-of-renders.

use super::RayAccuracy;
use super::pilot_pixels::{spread, tile_of};
use super::source::{LightSamples, finite};
use super::splats::splat;
use crate::integrator::Contribution;
use eikonal::{Solver, Tolerance};

/// Tolerances that are tried, the loosest first.
const LOOSER: [f64; 2] = [1e-4, 1e-5];
/// The effect is to be small beside the noise of so many samples of a pixel,
const SAMPLES: f64 = 1024.0;
/// and be at most this share of it,
const SHARE: f64 = 0.1;
/// or this share of a pixel's brightness where there is less noise.
const VISIBLE: f64 = 1e-4;
/// Pixels of the pilot, spread over the image, of which each has two samples.
const PIXELS: usize = 256;
/// Fewer pixels tell nothing.
const LEAST_PIXELS: usize = 64;
/// Numbers of the pilot's samples start here, where no render and no other pilot of these pixels gets to.
const FIRST: u64 = 5 << 61;
/// Tiles of the image along either side, whose noise is told apart.
const SIDE: usize = 4;
/// A looser tolerance must save this share of the work.
const SAVING: f64 = 0.05;

/// How accurate the rays of a render are to be, which takes its other choices from `light`.
pub(super) fn chosen(light: &LightSamples) -> RayAccuracy {
    let scene = light.source.scene;
    let exact = RayAccuracy::of(scene);
    if scene.is_straight() {
        return exact;
    }
    let Some(samples) = Samples::take(light, exact.tolerance, usize::MAX) else {
        return exact;
    };
    let looser = LOOSER.into_iter().filter(|t| *t > exact.tolerance);
    let mut tried = looser.filter_map(|tolerance| {
        let others = Samples::take(light, tolerance, samples.pixels())?;
        let effect = samples.effect_of(&others, light);
        let pays = others.work < (1.0 - SAVING) * samples.work;
        // Planted error "a tolerance loosened whatever its effect", found by morgana-transport/transport::tolerance::rays_are_exact_where_the_image_tells:
        // let is_small = effect <= f64::INFINITY;
        let is_small = effect <= SHARE / SAMPLES.sqrt();
        (pays && is_small).then_some(RayAccuracy { tolerance, effect })
    });
    tried.next().unwrap_or(exact)
}

/// What a sample of a pixel finds.
type Found = Vec<Contribution>;

/// Samples that were taken with one tolerance, two of each pixel.
struct Samples {
    pairs: Vec<[Found; 2]>,
    work: f64,
}

impl Samples {
    /// Takes those of so many pixels at most; `None` if they take too long, or are stopped.
    fn take(light: &LightSamples, tolerance: f64, pixels: usize) -> Option<Self> {
        let source = light.source;
        let mut ws = source.workspace();
        ws.solver = Solver::new(Tolerance::new(tolerance));
        let mut pairs = Vec::with_capacity(PIXELS);
        while pairs.len() < PIXELS.min(pixels) && ws.stats().cost() < source.pilot_work {
            let i = pairs.len();
            let pixel = spread(i, source.scene.film());
            pairs.push([0, 1].map(|k| {
                // Each in a replicate of its own: samples of one replicate are not independent.
                let sample = FIRST + source.replicates.size() * (2 * i as u64 + k);
                let mut found = Vec::new();
                light.take(pixel, sample, &mut ws, &mut found);
                found
            }));
        }
        let is_enough = pairs.len() >= LEAST_PIXELS && !source.is_stopped();
        is_enough.then(|| Samples {
            pairs,
            work: ws.stats().cost(),
        })
    }

    fn pixels(&self) -> usize {
        self.pairs.len()
    }

    /// A bound of the mean difference that a pixel of the `others` has, in standard deviations of a sample: the mean over tiles.
    fn effect_of(&self, others: &Samples, light: &LightSamples) -> f64 {
        let mut tiles = [Tile::default(); SIDE * SIDE];
        for (i, (pair, other)) in self.pairs.iter().zip(&others.pairs).enumerate() {
            let pixel = spread(i, light.source.scene.film());
            let tile_of = |pixel| tile_of(pixel, light.source.scene.film(), SIDE);
            let own = [0, 1].map(|k| own(&pair[k]));
            let tile = &mut tiles[tile_of(pixel)];
            tile.samples += 2.0;
            tile.brightness += own[0] + own[1];
            tile.squares += (own[0] - own[1]).powi(2);
            tile.difference += difference(&pair[0], &other[0]) + difference(&pair[1], &other[1]);
            for contribution in pair.iter().flatten().filter(|c| c.image.is_some()) {
                let value = brightness(contribution);
                splat(light.source, pixel, contribution.image, |pixel, filter| {
                    let tile = &mut tiles[tile_of(pixel)];
                    tile.brightness += value * filter;
                    tile.squares += (value * filter).powi(2);
                });
            }
        }
        let seen = tiles.iter().filter(|tile| tile.samples > 0.0);
        let mean = seen.clone().map(Tile::mean).sum::<f64>() / seen.clone().count() as f64;
        seen.clone().map(|tile| tile.effect(mean)).sum::<f64>() / seen.count() as f64
    }
}

/// What samples of a tile add up to.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    samples: f64,
    brightness: f64,
    /// Sum of squares whose mean is the variance of a sample.
    squares: f64,
    /// Of the others' samples, without signs.
    difference: f64,
}

impl Tile {
    fn mean(&self) -> f64 {
        self.brightness / self.samples
    }

    /// The mean difference in standard deviations, where the image has a `mean`.
    fn effect(&self, mean: f64) -> f64 {
        let difference = self.difference / self.samples;
        let visible = VISIBLE / SHARE * self.mean().max(mean);
        let noise = (self.squares / self.samples + SAMPLES * visible * visible).sqrt();
        if difference > 0.0 {
            difference / noise
        } else {
            0.0
        }
    }
}

/// How two samples with the same random numbers differ: contribution by contribution, if they have as many.
fn difference(a: &Found, b: &Found) -> f64 {
    if a.len() == b.len() {
        let pairs = a.iter().zip(b);
        return pairs
            .map(|(a, b)| (brightness(a) - brightness(b)).abs())
            .sum();
    }
    let sum = |found: &Found| -> f64 { found.iter().map(brightness).sum() };
    (sum(a) - sum(b)).abs()
}

/// What contributions bring to the pixel of their own sample.
fn own(found: &Found) -> f64 {
    let own = found.iter().filter(|c| c.image.is_none());
    own.map(brightness).sum()
}

fn brightness(contribution: &Contribution) -> f64 {
    finite(contribution.weighted(), &mut 0).sum()
}
