//! Choice of the rays' tolerance: the loosest one whose effect on the image is small, as measured
//! by a pilot.
//!
//! The pilot takes samples with the scene's tolerance, and again with equal random numbers and a
//! looser tolerance. It chooses the loosest tolerance for which the mean absolute difference is
//! below a tenth of the noise of [`SAMPLES`] samples of a pixel. The pilot's samples are not part
//! of the image.
//!
//! Theory: docs/theory.md#tolerance-of-renders.

use super::RayAccuracy;
use super::pilot_pixels::{spread, tile_of};
use super::source::{LightSamples, finite};
use super::splats::splat_image;
use crate::integrator::Contribution;
use eikonal::{Solver, Tolerance};

/// Tolerances that are tried, the loosest first.
const LOOSER_TOLERANCES: [f64; 2] = [1e-4, 1e-5];
/// Number of samples per pixel in the noise with which the effect is compared.
const SAMPLES: f64 = 1024.0;
/// Largest allowed effect, as a fraction of this noise.
const MAX_EFFECT: f64 = 0.1;
/// Largest allowed effect, as a fraction of a pixel's brightness, for pixels with less noise.
const MAX_RELATIVE_EFFECT: f64 = 1e-4;
/// Pixels of the pilot, spread over the image. Each has two samples.
const PIXELS: usize = 256;
/// Minimum number of pixels. Effects from fewer pixels are too uncertain.
const MIN_PIXELS: usize = 64;
/// First number of the pilot's samples, beyond the numbers of renders and of other pilots of these
/// pixels.
const FIRST_SAMPLE: u64 = 5 << 61;
/// Tiles along either side of the image; noise is estimated per tile.
const TILES_PER_SIDE: usize = 4;
/// Fraction of the work that a looser tolerance must save.
const MIN_SAVING: f64 = 0.05;

/// Chooses the accuracy of a render's rays. The other choices are taken from `light`.
pub(super) fn chosen(light: &LightSamples) -> RayAccuracy {
    let scene = light.source.scene;
    let exact = RayAccuracy::of(scene);
    if scene.is_straight() {
        return exact;
    }
    let Some(samples) = Samples::take(light, exact.tolerance, usize::MAX) else {
        return exact;
    };
    let looser = LOOSER_TOLERANCES
        .into_iter()
        .filter(|t| *t > exact.tolerance);
    let mut tried = looser.filter_map(|tolerance| {
        let others = Samples::take(light, tolerance, samples.pixels())?;
        let effect = samples.effect_of(&others, light);
        let pays = others.work < (1.0 - MIN_SAVING) * samples.work;
        // Planted error "a tolerance loosened whatever its effect", found by morgana-transport/transport::tolerance::rays_are_exact_where_the_image_tells:
        // let is_small = effect <= f64::INFINITY;
        let is_small = effect <= MAX_EFFECT / SAMPLES.sqrt();
        (pays && is_small).then_some(RayAccuracy { tolerance, effect })
    });
    tried.next().unwrap_or(exact)
}

/// Contributions of one sample of a pixel.
type Found = Vec<Contribution>;

/// Samples with one tolerance, two of each pixel.
struct Samples {
    pairs: Vec<[Found; 2]>,
    work: f64,
}

impl Samples {
    /// Takes samples of at most `pixels` pixels. Returns `None` if they take too long or are
    /// stopped.
    fn take(light: &LightSamples, tolerance: f64, pixels: usize) -> Option<Self> {
        let source = light.source;
        let mut ws = source.workspace();
        ws.solver = Solver::new(Tolerance::new(tolerance));
        let mut pairs = Vec::with_capacity(PIXELS);
        while pairs.len() < PIXELS.min(pixels) && ws.stats().cost() < source.pilot_work {
            let i = pairs.len();
            let pixel = spread(i, source.scene.film());
            pairs.push([0, 1].map(|k| {
                // Place each sample in its own replicate: samples of one replicate are not
                // independent.
                let sample = FIRST_SAMPLE + source.replicates.size() * (2 * i as u64 + k);
                let mut found = Vec::new();
                light.take_pixel(pixel, sample, &mut ws, &mut found);
                found
            }));
        }
        let is_enough = pairs.len() >= MIN_PIXELS && !source.is_stopped();
        is_enough.then(|| Samples {
            pairs,
            work: ws.stats().cost(),
        })
    }

    fn pixels(&self) -> usize {
        self.pairs.len()
    }

    /// Returns a bound of the mean difference between a pixel's samples and the `others`, in
    /// standard deviations of one sample: the mean over tiles.
    fn effect_of(&self, others: &Samples, light: &LightSamples) -> f64 {
        let mut tiles = [Tile::default(); TILES_PER_SIDE * TILES_PER_SIDE];
        let noise = light.source.cells.noise();
        for (i, (pair, other)) in self.pairs.iter().zip(&others.pairs).enumerate() {
            let pixel = spread(i, light.source.scene.film());
            let tile_of = |pixel| tile_of(pixel, light.source.scene.film(), TILES_PER_SIDE);
            let own = [0, 1].map(|k| own(&pair[k]));
            let tile = &mut tiles[tile_of(pixel)];
            tile.samples += 2.0;
            tile.brightness += own[0] + own[1];
            tile.squares += (own[0] - own[1]).powi(2) * noise;
            tile.difference += difference(&pair[0], &other[0]) + difference(&pair[1], &other[1]);
            let found = pair.iter().flatten();
            for (contribution, image) in found.filter_map(|c| Some((c, c.image?))) {
                let value = brightness(contribution);
                splat_image(light.source, image, |pixel, filter| {
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

/// Sums over the samples of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    samples: f64,
    brightness: f64,
    /// Sum of squares. Its mean is the variance of a sample.
    squares: f64,
    /// Sum of the absolute differences from the other tolerance's samples.
    difference: f64,
}

impl Tile {
    fn mean(&self) -> f64 {
        self.brightness / self.samples
    }

    /// Returns the mean difference in standard deviations, where `mean` is the image's mean.
    fn effect(&self, mean: f64) -> f64 {
        let difference = self.difference / self.samples;
        let visible = MAX_RELATIVE_EFFECT / MAX_EFFECT * self.mean().max(mean);
        let noise = (self.squares / self.samples + SAMPLES * visible * visible).sqrt();
        if difference > 0.0 {
            difference / noise
        } else {
            0.0
        }
    }
}

/// Returns the absolute difference of two samples with equal random numbers: contribution by
/// contribution, if their numbers are equal.
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

/// Returns the sum of the contributions to the pixel of their own sample.
fn own(found: &Found) -> f64 {
    let own = found.iter().filter(|c| c.image.is_none());
    own.map(brightness).sum()
}

fn brightness(contribution: &Contribution) -> f64 {
    finite(contribution.weighted(), &mut 0).sum()
}
