//! Which estimator is the best for a picture: a pilot tells.
//!
//! Of each candidate a pilot takes samples that are not part of the image. They tell the relative variance of a pixel's
//! sample and the work that it takes, and the candidate with the least product of both is chosen. The choice depends on the
//! pilot's samples only, which are independent of the image's: it does not bias the image, whatever it is
//! (docs/theory.md#choice-of-the-estimator).
//!
//! Work is counted rather than timed: equal scenes, seeds and limits lead to equal choices, on any machine and in all parts of a render.

use super::source::{LightSamples, Source, finite};
use super::splats::splat;
use super::{Handle, RenderOptions, prepare};
use crate::Spectrum;
use crate::integrator::{Contribution, Integrator};
use crate::renderer::Renderer;
use crate::scene::{FilmSpec, Scene};
use rayon::prelude::*;
use std::ops::{AddAssign, Range};

/// Work of all candidates together at most, some two seconds of one processor, in the unit of [`Stats::cost`](crate::stats::Stats::cost).
const MOST_WORK: f64 = 3e7;
/// About as much work is done in a second by one processor.
const WORK_PER_SECOND: f64 = 1.5e7;
/// The pilot's share of the work of a render, or of its time.
const SHARE: f64 = 0.1;
/// Pairs of samples that tell what one costs.
const FIRST_PAIRS: usize = 4;
/// No more pairs than these are ever taken of one candidate.
const MOST_PAIRS: usize = 1 << 17;
/// Fewer pairs tell nothing of a candidate.
const LEAST_PAIRS: usize = 16;
/// About what a sample takes, as long as that is not known.
const USUAL_WORK: f64 = 100.0;
/// What a candidate finds out before its first sample is this share of its pilot.
const PREPARATION: f64 = 0.3;
/// Numbers of the pilot's samples start here, where neither a render nor another pilot gets to.
const FIRST: u64 = 3 << 62;
/// Samples of a replicate that are taken together. More than eight of one would leave few pairs.
const TOGETHER: u64 = 8;
/// Units of work of a pilot: enough to keep threads busy.
const TASKS: usize = 32;
/// Tiles of the image along either side, whose samples are added up.
const SIDE: usize = 32;
/// So many pairs, on average, tell the brightness of a cell.
const PAIRS_PER_CELL: usize = 8;
/// The variance of a cell is known as if so many samples had that of the image.
const PRIOR: f64 = 32.0;
/// Errors are relative to the brightness of a pixel plus this share of the image's.
const DARK: f64 = 0.05;
/// Variances below this share of the square of the brightest mean are no surer.
const SURE: f64 = 1e-6;
/// Relative variances below this are those of rounding.
const NOISELESS: f64 = 1e-12;
/// Light that others see is missing if it is beyond so many standard errors.
const MISSING: f64 = 3.0;
/// Others must be better than the first candidate by this factor: pilots err.
const BETTER: f64 = 0.9;

/// What limits the work of a pilot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extent {
    /// Samples per pixel of the whole render, if there is a limit.
    pub samples: Option<u64>,
    /// Time that the render may take in seconds, if there is a limit.
    pub seconds: Option<f64>,
}

/// An estimator, and what a pilot says of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The estimator.
    pub integrator: Integrator,
    /// Variance of a pixel's sample, relative to the square of the pixel's brightness plus 5 % of the image's: the mean over pixels.
    pub relative_variance: f64,
    /// Work of a sample, in the unit of [`Stats::cost`](crate::stats::Stats::cost).
    pub work: f64,
    /// Samples of pixels that tell so.
    pub samples: u64,
}

impl Candidate {
    /// Whether its samples are alike but for rounding.
    pub fn is_noiseless(&self) -> bool {
        self.relative_variance <= NOISELESS
    }

    /// Relative variance × work: the less, the better.
    pub fn inefficiency(&self) -> f64 {
        self.relative_variance * self.work
    }
}

/// What a choice rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// There is one candidate only.
    Single,
    /// The render is too short for a pilot: it is the first candidate.
    TooShort,
    /// The handle ended the pilot: it is the first candidate.
    Ended,
    /// A pilot.
    Pilot,
}

/// The estimator that was chosen, and from what.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The one that was chosen.
    pub integrator: Integrator,
    /// What the choice rests on.
    pub basis: Basis,
    /// The candidates that a pilot has seen; none without one.
    pub candidates: Vec<Candidate>,
}

impl Choice {
    /// How many times less work the chosen one takes for the same error than each of the others.
    pub fn gains(&self) -> impl Iterator<Item = (Integrator, f64)> {
        let is_chosen = |c: &&Candidate| c.integrator == self.integrator;
        let chosen = self.candidates.iter().find(is_chosen);
        let chosen = chosen.map_or(f64::NAN, Candidate::inefficiency);
        let others = self.candidates.iter().filter(move |c| !is_chosen(c));
        others.map(move |other| (other.integrator, other.inefficiency() / chosen))
    }
}

/// Chooses one of the `candidates`, of which there is at least one, for a render of `scenes` with `options` (but for their renderer). The
/// first is chosen if the render is too short for a pilot, or the handle ends it.
pub fn choose(
    scenes: &[Scene],
    candidates: &[Integrator],
    options: &RenderOptions,
    extent: Extent,
    handle: &Handle,
) -> Choice {
    let first = |basis| Choice {
        integrator: candidates[0],
        basis,
        candidates: Vec::new(),
    };
    if candidates.len() < 2 {
        return first(Basis::Single);
    }
    // Groups of channels are alike but for spectra and indices: the one with the most light speaks for all.
    let group = brightest(scenes);
    let (scene, film) = (&scenes[group..=group], scenes[group].film());
    let budget = Budget::new(extent, film, candidates.len());
    if budget.samples < (2 * LEAST_PAIRS) as f64 {
        return first(Basis::TooShort);
    }
    let preparation = PREPARATION * budget.work(USUAL_WORK);
    let sources = candidates.iter().map(|integrator| {
        let options = RenderOptions {
            renderer: Renderer::Light(*integrator),
            ..*options
        };
        let mut prepared = prepare(scene, &options, Some(preparation), handle);
        Source::new(&scene[0], group, &options, prepared.remove(0), handle)
    });
    let sources: Vec<Source> = sources.collect();
    let lights = sources.iter().zip(candidates);
    let lights: Vec<LightSamples> = lights.map(|(source, i)| source.light(*i)).collect();
    let few = lights
        .iter()
        .map(|light| PilotSums::take(light, 0..FIRST_PAIRS));
    let mut sums: Vec<PilotSums> = few.collect();
    let works = sums.iter().map(PilotSums::work_per_sample);
    let most = budget.work(works.fold(f64::INFINITY, f64::min));
    for (sum, light) in sums.iter_mut().zip(&lights) {
        let pairs = (most / sum.work * FIRST_PAIRS as f64) as usize;
        *sum += PilotSums::take(light, FIRST_PAIRS..pairs.clamp(FIRST_PAIRS, MOST_PAIRS));
    }
    if handle.stop().is_raised() {
        return first(Basis::Ended);
    }
    // Those whose samples take too long for a judgement are out.
    let judged = candidates.iter().zip(sums);
    let judged = judged.filter(|(_, sum)| sum.pairs() >= LEAST_PAIRS as f64);
    let (integrators, sums): (Vec<Integrator>, Vec<PilotSums>) = judged.unzip();
    if sums.is_empty() {
        return first(Basis::TooShort);
    }
    let told = sums.iter().zip(relative_variances(&sums, film));
    let told = told
        .zip(integrators)
        .map(|((sum, variance), integrator)| Candidate {
            integrator,
            relative_variance: variance.max(NOISELESS),
            work: sum.work_per_sample(),
            samples: sum.paths as u64,
        });
    let told: Vec<Candidate> = told.collect();
    Choice {
        integrator: best(&told, candidates[0]),
        basis: Basis::Pilot,
        candidates: told,
    }
}

/// The group of channels in which emitters have the most power.
fn brightest(scenes: &[Scene]) -> usize {
    let power = |group: &usize| -> f64 {
        let scene = &scenes[*group];
        let powers = scene.powers(scene.film().channels_of(*group));
        powers.map(|power| power.sum()).sum()
    };
    let groups = (0..scenes.len()).rev();
    groups
        .max_by(|a, b| power(a).total_cmp(&power(b)))
        .unwrap_or(0)
}

/// What the pilot of a candidate may take.
#[derive(Clone, Copy, Debug)]
struct Budget {
    /// Samples of pixels.
    samples: f64,
    /// Work.
    work: f64,
}

impl Budget {
    fn new(extent: Extent, film: &FilmSpec, candidates: usize) -> Self {
        let pixels = (film.width * film.height) as f64;
        let samples = extent.samples.map(|spp| SHARE * spp as f64 * pixels);
        let time = extent.seconds.map(|s| SHARE * s * WORK_PER_SECOND);
        let each = |limit: f64| limit / candidates as f64;
        Budget {
            samples: each(samples.unwrap_or(f64::INFINITY)),
            work: each(time.map_or(MOST_WORK, |time| time.min(MOST_WORK))),
        }
    }

    /// The work if a sample takes so much.
    fn work(&self, sample: f64) -> f64 {
        self.work.min(self.samples * sample)
    }
}

/// The candidate with the least relative variance × work: the `first` one unless another is clearly better.
fn best(candidates: &[Candidate], first: Integrator) -> Integrator {
    let rated = candidates.iter().map(|candidate| {
        let handicap = if candidate.integrator == first {
            BETTER
        } else {
            1.0
        };
        (candidate.integrator, handicap * candidate.inefficiency())
    });
    let sound = rated.filter(|(_, inefficiency)| inefficiency.is_finite());
    let best = sound.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(first, |(integrator, _)| integrator)
}

/// What the samples of a tile, or of a cell of several, add up to. Values are sums over channels.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    /// Pairs of samples of its pixels.
    pairs: f64,
    /// Sum of these samples, and sum of the squares of the differences within pairs.
    own: f64,
    scatter: f64,
    /// Sum of contributions to its pixels that come from any sample, and of the squares of those of one path to one pixel.
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

/// What a pilot of one candidate has seen.
#[derive(Clone, Debug)]
struct PilotSums {
    tiles: Vec<Tile>,
    /// Samples of pixels, and those of which each sample of a pair is the mean.
    paths: f64,
    together: f64,
    work: f64,
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
            tiles: vec![Tile::default(); SIDE * SIDE],
            paths: 0.0,
            together: together as f64,
            work: 0.0,
        }
    }

    /// Takes some of the pairs of a pilot.
    fn take(light: &LightSamples, pairs: Range<usize>) -> Self {
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
        let pixels = film.width * film.height;
        let together = together(light);
        let mut sums = PilotSums::nothing(together);
        let mut ws = light.source.workspace();
        let mut found = Vec::new();
        let mut splats = Vec::new();
        for i in pairs {
            if light.source.is_stopped() {
                break;
            }
            // Multiples of the golden ratio spread evenly.
            let place = (0.618_033_988_749_894_9 * i as f64).fract();
            let pixel = ((place * pixels as f64) as usize).min(pixels - 1);
            let means = [0, 1].map(|k| {
                // Each in a replicate of its own, for samples of one replicate are not independent; at all instants of a period in turn.
                let unit = light
                    .source
                    .scene
                    .whole_periods(1)
                    .next_multiple_of(together);
                let place = i as u64 % (unit / together) * together;
                let first = FIRST.next_multiple_of(unit) + unit * (2 * i as u64 + k) + place;
                let mut sum = 0.0;
                for sample in first..first + together {
                    light.take(pixel, sample, &mut ws, &mut found);
                    sum += own(&found);
                    sums.splat(light, pixel, &mut splats, &found);
                    found.clear();
                }
                sum / together as f64
            });
            let tile = &mut sums.tiles[tile_of(pixel, film)];
            tile.pairs += 1.0;
            tile.own += means[0] + means[1];
            tile.scatter += (means[0] - means[1]).powi(2);
            sums.paths += (2 * together) as f64;
        }
        sums.work = ws.stats().cost();
        sums
    }

    /// Adds what a path contributes to other pixels than its own.
    fn splat(
        &mut self,
        light: &LightSamples,
        own: usize,
        splats: &mut Vec<(usize, f64)>,
        found: &[Contribution],
    ) {
        splats.clear();
        for contribution in found.iter().filter(|c| c.image.is_some()) {
            let value = brightness(contribution.weighted());
            splat(light.source, own, contribution, |pixel, filter| {
                splats.push((pixel, value * filter))
            });
        }
        splats.sort_by_key(|(pixel, _)| *pixel);
        for same in splats.chunk_by(|a, b| a.0 == b.0) {
            let value: f64 = same.iter().map(|(_, value)| value).sum();
            let tile = &mut self.tiles[tile_of(same[0].0, light.source.scene.film())];
            tile.splats += value;
            tile.squares += value * value;
        }
    }

    fn work_per_sample(&self) -> f64 {
        self.work / self.paths
    }

    /// What the tiles of each cell add up to, of `side` cells along either side.
    fn cells(&self, side: usize) -> Vec<Tile> {
        let mut cells = vec![Tile::default(); side * side];
        for (i, tile) in self.tiles.iter().enumerate() {
            let [column, row] = [i % SIDE, i / SIDE].map(|place| place * side / SIDE);
            cells[row * side + column] += *tile;
        }
        cells
    }

    fn pairs(&self) -> f64 {
        self.tiles.iter().map(|tile| tile.pairs).sum()
    }

    /// Brightness of a cell that is a share of the image, and the mean variance of a sample of its pixels.
    ///
    /// There are as many paths in a sample of the image as there are pixels, P. A pixel to which a path contributes c, mostly
    /// nothing, has the brightness P⟨c⟩ and the variance P⟨c²⟩ − P⟨c⟩², of which the last is small.
    fn estimate(&self, cell: &Tile, share: f64) -> Option<CellEstimate> {
        (cell.pairs > 0.0).then(|| CellEstimate {
            brightness: cell.own / (2.0 * cell.pairs) + cell.splats / (share * self.paths),
            variance: self.together * cell.scatter / (2.0 * cell.pairs)
                + cell.squares / (share * self.paths),
            samples: 2.0 * self.together * cell.pairs,
        })
    }
}

/// What a candidate says of a cell.
#[derive(Clone, Copy, Debug)]
struct CellEstimate {
    brightness: f64,
    variance: f64,
    samples: f64,
}

/// Samples of a replicate that are taken together.
fn together(light: &LightSamples) -> u64 {
    light.source.replicates.size().min(TOGETHER)
}

fn brightness(value: Spectrum) -> f64 {
    finite(value, &mut 0).sum()
}

/// What contributions bring to the pixel of their own sample.
fn own(found: &[Contribution]) -> f64 {
    found
        .iter()
        .filter(|c| c.image.is_none())
        .map(|c| brightness(c.weighted()))
        .sum()
}

fn tile_of(pixel: usize, film: &FilmSpec) -> usize {
    let [column, row] = [
        pixel % film.width * SIDE / film.width,
        pixel / film.width * SIDE / film.height,
    ];
    row * SIDE + column
}

/// The relative variance of a pixel's sample by each candidate.
///
/// All are relative to the same brightness, cell by cell: the mean of what candidates say, each in proportion to how sure it is.
fn relative_variances(sums: &[PilotSums], film: &FilmSpec) -> Vec<f64> {
    let pairs = sums
        .iter()
        .map(PilotSums::pairs)
        .fold(f64::INFINITY, f64::min) as usize;
    let side = ((pairs / PAIRS_PER_CELL).max(1).ilog2() / 2).min(SIDE.ilog2());
    let side = 1 << side;
    let mut shares = vec![0.0; side * side];
    for (i, count) in pixels_of_tiles(film).into_iter().enumerate() {
        let [column, row] = [i % SIDE, i / SIDE].map(|place| place * side / SIDE);
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
        let scale = pooled_brightness(&estimates, &whole).powi(2) + (DARK * mean).powi(2);
        for (variance, estimate) in variances.iter_mut().zip(&estimates) {
            *variance += share * estimate.variance / scale;
        }
    }
    variances
}

/// The brightness that is most likely by what all candidates say of a cell, given what they say of the whole image: few samples that
/// happen to be alike are not sure.
fn pooled_brightness(estimates: &[CellEstimate], whole: &[CellEstimate]) -> f64 {
    let brightest = whole.iter().map(|w| w.brightness).fold(0.0, f64::max);
    let floor = SURE * brightest * brightest + f64::MIN_POSITIVE.sqrt();
    let weighted = estimates.iter().zip(whole).map(|(estimate, whole)| {
        let known = estimate.samples * estimate.variance + PRIOR * whole.variance;
        let variance = known / (estimate.samples + PRIOR) + floor;
        let weight = estimate.samples / variance;
        (weight, weight * estimate.brightness)
    });
    let (weights, sum) = weighted.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// The relative variance by light that a candidate has hardly seen, and others have. It must come in fewer than one of its n samples: Δ of the
/// image's brightness then has a variance of nΔ² or more.
fn missing(whole: &[CellEstimate], mean: f64) -> Vec<f64> {
    let bound = |sign: f64| {
        move |estimate: &CellEstimate| {
            let error = (estimate.variance / estimate.samples).sqrt();
            estimate.brightness + sign * MISSING * error
        }
    };
    let seen = whole.iter().map(bound(-1.0)).fold(0.0, f64::max);
    let missed = whole.iter().map(|estimate| {
        let missed = (seen - bound(1.0)(estimate)).max(0.0);
        estimate.samples * missed * missed / (mean * mean + f64::MIN_POSITIVE)
    });
    missed.collect()
}

/// Pixels in each tile.
fn pixels_of_tiles(film: &FilmSpec) -> Vec<f64> {
    let count = |size: usize| {
        let mut counts = [0.0; SIDE];
        (0..size).for_each(|place| counts[place * SIDE / size] += 1.0);
        counts
    };
    let (columns, rows) = (count(film.width), count(film.height));
    let tiles = rows.iter().flat_map(|r| columns.iter().map(move |c| r * c));
    tiles.collect()
}
