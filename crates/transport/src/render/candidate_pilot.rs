//! Brightness and variance of a picture, tile by tile, as a candidate's pilot estimates them
//! (docs/theory.md#choice-of-the-estimator).

use super::pilot_pixels::{spread, tile_of};
use super::source::{LightSamples, finite};
use super::splats::splat_image;
use crate::Spectrum;
use crate::integrator::Contribution;
use crate::scene::FilmSpec;
use rayon::prelude::*;
use std::ops::{AddAssign, Range};

/// First number of the pilot's samples, beyond the numbers of renders and of other pilots.
const FIRST_SAMPLE: u64 = 3 << 62;
/// Maximum number of samples of a replicate that count as one sample. More than eight would leave
/// few pairs.
const MAX_GROUPED_SAMPLES: u64 = 8;
/// Number of tasks of a pilot: enough to keep threads busy.
const TASKS: usize = 32;
/// Tiles along either side of the image.
const TILES_PER_SIDE: usize = 32;
/// Mean number of pairs per cell from which a cell's brightness is estimated.
const PAIRS_PER_CELL: usize = 8;
/// Weight of the prior of a cell's variance: the number of samples with the image's variance that
/// are added to the cell's.
const PRIOR_SAMPLES: f64 = 32.0;
/// Brightness d of dark pixels, relative to the image's mean. Variances are relative to μ² + d² at
/// brightness μ.
const DARK_BRIGHTNESS: f64 = 0.05;
/// Lower bound of variances in the weights, relative to the square of the brightest mean.
const MIN_VARIANCE: f64 = 1e-6;
/// Number of standard errors by which other candidates must be brighter for light to count as
/// missing.
const MISSING_DEVIATIONS: f64 = 3.0;

/// Sums over the samples of a tile, or of a cell of several tiles. Values are summed over channels.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    /// Number of pairs of samples of the pixels in the tile.
    pairs: f64,
    /// Sum of the samples; `scatter` is the sum of the squared differences within pairs.
    own: f64,
    scatter: f64,
    /// Sum of the contributions of all samples to the tile's pixels. `squares` is the sum of the
    /// squared contributions of one path to one pixel.
    splats: f64,
    squares: f64,
}

impl AddAssign for Tile {
    fn add_assign(&mut self, o: Tile) {
        self.pairs += o.pairs;
        self.own += o.own;
        self.scatter += o.scatter;
        self.splats += o.splats;
        self.squares += o.squares;
    }
}

/// Sums over the pilot of one candidate.
#[derive(Clone, Debug)]
pub(super) struct PilotSums {
    tiles: Vec<Tile>,
    /// Number of samples of pixels; `together` is the number of samples whose mean is one sample of
    /// a pair.
    pub paths: f64,
    together: f64,
    /// Work of all samples.
    pub work: f64,
}

impl AddAssign for PilotSums {
    fn add_assign(&mut self, o: PilotSums) {
        self.tiles
            .iter_mut()
            .zip(o.tiles)
            .for_each(|(tile, other)| *tile += other);
        self.paths += o.paths;
        self.work += o.work;
    }
}

impl PilotSums {
    fn nothing(together: u64) -> Self {
        PilotSums {
            tiles: vec![Tile::default(); TILES_PER_SIDE * TILES_PER_SIDE],
            paths: 0.0,
            together: together as f64,
            work: 0.0,
        }
    }

    /// Takes some of the pairs of a pilot.
    pub(super) fn take(light: &LightSamples, pairs: Range<usize>) -> Self {
        let size = pairs.len().div_ceil(TASKS).max(1);
        let tasks: Vec<PilotSums> = (0..pairs.len().div_ceil(size))
            .into_par_iter()
            .with_max_len(1)
            .map(|task| {
                let first = pairs.start + task * size;
                PilotSums::task(light, first..pairs.end.min(first + size))
            })
            .collect();
        let nothing = PilotSums::nothing(together(light));
        tasks.into_iter().fold(nothing, |mut sum, task| {
            sum += task;
            sum
        })
    }

    fn task(light: &LightSamples, pairs: Range<usize>) -> Self {
        let film = light.source.scene.film();
        let together = together(light);
        let mut sums = PilotSums::nothing(together);
        let mut ws = light.source.workspace();
        let mut found = Vec::new();
        let mut splats = Vec::new();
        let noise = light.source.cells.noise();
        for i in pairs {
            if light.source.is_stopped() {
                break;
            }
            let pixel = spread(i, film);
            let means = [0, 1].map(|k| {
                // Place each sample in its own replicate, because samples of one replicate are not
                // independent, and at all instants of a period in turn.
                let source = light.source;
                let unit = source.scene.whole_periods(1, source.replicates);
                let unit = unit.next_multiple_of(together);
                let place = i as u64 % (unit / together) * together;
                let first = FIRST_SAMPLE.next_multiple_of(unit) + unit * (2 * i as u64 + k) + place;
                let mut sum = 0.0;
                for sample in first..first + together {
                    light.take_pixel(pixel, sample, &mut ws, &mut found);
                    sum += own(&found);
                    sums.splat(light, &mut splats, &found);
                    found.clear();
                }
                sum / together as f64
            });
            let tile = &mut sums.tiles[tile_of(pixel, film, TILES_PER_SIDE)];
            tile.pairs += 1.0;
            tile.own += means[0] + means[1];
            tile.scatter += (means[0] - means[1]).powi(2) * noise;
            sums.paths += (2 * together) as f64;
        }
        sums.work = ws.stats().cost();
        sums
    }

    /// Adds the contributions of a path to pixels other than its own.
    fn splat(
        &mut self,
        light: &LightSamples,
        splats: &mut Vec<(usize, f64)>,
        found: &[Contribution],
    ) {
        splats.clear();
        for (contribution, image) in found.iter().filter_map(|c| Some((c, c.image?))) {
            let value = brightness(contribution.weighted());
            splat_image(light.source, image, |pixel, filter| {
                splats.push((pixel, value * filter));
            });
        }
        splats.sort_by_key(|(pixel, _)| *pixel);
        for same in splats.chunk_by(|a, b| a.0 == b.0) {
            let value: f64 = same.iter().map(|(_, value)| value).sum();
            let tile =
                &mut self.tiles[tile_of(same[0].0, light.source.scene.film(), TILES_PER_SIDE)];
            tile.splats += value;
            tile.squares += value * value;
        }
    }

    pub(super) fn work_per_sample(&self) -> f64 {
        self.work / self.paths
    }

    /// Sums the tiles of each cell; there are `side` cells along either side.
    fn cells(&self, side: usize) -> Vec<Tile> {
        let mut cells = vec![Tile::default(); side * side];
        for (i, tile) in self.tiles.iter().enumerate() {
            let [column, row] =
                [i % TILES_PER_SIDE, i / TILES_PER_SIDE].map(|place| place * side / TILES_PER_SIDE);
            cells[row * side + column] += *tile;
        }
        cells
    }

    pub(super) fn pairs(&self) -> f64 {
        self.tiles.iter().map(|tile| tile.pairs).sum()
    }

    /// Estimates the brightness of a cell that covers a fraction `share` of the image, and the mean
    /// variance of a sample of its pixels.
    ///
    /// A sample of the image has as many paths as there are pixels, P. A pixel to which a path
    /// contributes c, which is mostly zero, has brightness P⟨c⟩ and variance P⟨c²⟩ − P⟨c⟩². The
    /// last term is small.
    fn estimate(&self, cell: &Tile, share: f64) -> Option<CellEstimate> {
        (cell.pairs > 0.0).then(|| CellEstimate {
            brightness: cell.own / (2.0 * cell.pairs) + cell.splats / (share * self.paths),
            variance: self.together * cell.scatter / (2.0 * cell.pairs)
                // Planted error "light that arrives in other pixels left out of the choice of the integrator", found by morgana-transport/transport::choice::pilots_foretell_variances:
                // + 0.0 * cell.squares / (share * self.paths),
                + cell.squares / (share * self.paths),
            samples: 2.0 * self.together * cell.pairs,
        })
    }
}

/// Estimates of a candidate for a cell.
#[derive(Clone, Copy, Debug)]
struct CellEstimate {
    brightness: f64,
    variance: f64,
    samples: f64,
}

/// Returns the number of samples of a replicate that are taken together.
fn together(light: &LightSamples) -> u64 {
    light.source.replicates.size().min(MAX_GROUPED_SAMPLES)
}

fn brightness(value: Spectrum) -> f64 {
    finite(value, &mut 0).sum()
}

/// Returns the sum of the contributions to the pixel of their own sample.
fn own(found: &[Contribution]) -> f64 {
    found
        .iter()
        .filter(|c| c.image.is_none())
        .map(|c| brightness(c.weighted()))
        .sum()
}

/// Returns the relative variance of a pixel's sample for each candidate.
///
/// All are relative to one brightness per cell: the mean of the candidates' estimates, weighted by
/// their certainty.
pub(super) fn relative_variances(sums: &[PilotSums], film: &FilmSpec) -> Vec<f64> {
    let pairs = sums
        .iter()
        .map(PilotSums::pairs)
        .fold(f64::INFINITY, f64::min) as usize;
    let side = ((pairs / PAIRS_PER_CELL).max(1).ilog2() / 2).min(TILES_PER_SIDE.ilog2());
    let side = 1 << side;
    let mut shares = vec![0.0; side * side];
    for (i, count) in pixels_of_tiles(film).into_iter().enumerate() {
        let [column, row] =
            [i % TILES_PER_SIDE, i / TILES_PER_SIDE].map(|place| place * side / TILES_PER_SIDE);
        shares[row * side + column] += count / (film.width * film.height) as f64;
    }
    let whole: Vec<CellEstimate> = sums
        .iter()
        .filter_map(|sum| sum.estimate(&sum.cells(1)[0], 1.0))
        .collect();
    let cells: Vec<Vec<Tile>> = sums.iter().map(|sum| sum.cells(side)).collect();
    let mean = pooled_brightness(&whole, &whole);
    let mut variances = missing(&whole, mean);
    let shown = shares.into_iter().enumerate();
    for (i, share) in shown.filter(|(_, share)| *share > 0.0) {
        let estimates: Vec<CellEstimate> = (0..sums.len())
            .map(|k| sums[k].estimate(&cells[k][i], share).unwrap_or(whole[k]))
            .collect();
        let scale =
            pooled_brightness(&estimates, &whole).powi(2) + (DARK_BRIGHTNESS * mean).powi(2);
        for (variance, estimate) in variances.iter_mut().zip(&estimates) {
            *variance += share * estimate.variance / scale;
        }
    }
    variances
}

/// Returns the most likely brightness of a cell, given all candidates' estimates of the cell and of
/// the whole image. The estimates of the whole image guard against few samples that happen to be
/// equal.
fn pooled_brightness(estimates: &[CellEstimate], whole: &[CellEstimate]) -> f64 {
    let brightest = whole.iter().map(|w| w.brightness).fold(0.0, f64::max);
    let floor = MIN_VARIANCE * brightest * brightest + f64::MIN_POSITIVE.sqrt();
    let weighted = estimates.iter().zip(whole).map(|(estimate, whole)| {
        let known = estimate.samples * estimate.variance + PRIOR_SAMPLES * whole.variance;
        let variance = known / (estimate.samples + PRIOR_SAMPLES) + floor;
        let weight = estimate.samples / variance;
        (weight, weight * estimate.brightness)
    });
    let (weights, sum) = weighted.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// Returns the relative variance caused by light that other candidates found and this candidate
/// hardly found. The candidate finds this light in fewer than one of its n samples, if at all. A
/// part Δ of the image's brightness then has a variance of at least nΔ².
fn missing(whole: &[CellEstimate], mean: f64) -> Vec<f64> {
    let bound = |sign: f64| {
        move |estimate: &CellEstimate| {
            let error = (estimate.variance / estimate.samples).sqrt();
            estimate.brightness + sign * MISSING_DEVIATIONS * error
        }
    };
    let seen = whole.iter().map(bound(-1.0)).fold(0.0, f64::max);
    let missed = whole.iter().map(|estimate| {
        let missed = (seen - bound(1.0)(estimate)).max(0.0);
        estimate.samples * missed * missed / (mean * mean + f64::MIN_POSITIVE)
    });
    missed.collect()
}

/// Returns the number of pixels in each tile.
fn pixels_of_tiles(film: &FilmSpec) -> Vec<f64> {
    let count = |size: usize| {
        let mut counts = [0.0; TILES_PER_SIDE];
        (0..size).for_each(|place| counts[place * TILES_PER_SIDE / size] += 1.0);
        counts
    };
    let (columns, rows) = (count(film.width), count(film.height));
    let tiles = rows.iter().flat_map(|r| columns.iter().map(move |c| r * c));
    tiles.collect()
}
