//! Estimators whose samples contribute to several pixels.
//!
//! Each sample of the whole image consists of a sample of every cell of the film. Contributions to
//! a pixel are added up first. Then each pixel takes its sum as one sample, or as one sample of a
//! replicate. The samples of a pixel, or its replicates, are therefore independent of one another.
//! The variance of their mean is estimated as for any other estimator. The sums of one sample are
//! formed in the order of cells and paths, independent of threads: equal seeds give equal bits.
//!
//! Theory: docs/theory.md#film.

use super::Debiased;
use super::followed::{FollowedSamples, FoundPart};
use super::shared;
use super::source::{LightSamples, Source, finite};
use super::strategies::{Strategies, StrategyScores};
use crate::Spectrum;
use crate::film::{Decomposition, Film, Footprint, Pending, PlacedValue, Scores};
use crate::integrator::{Contribution, Merging};
use crate::path::{BalanceSums, BalanceTotals};
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Cells per task.
const CELLS_PER_TASK: usize = 16;
/// Pixels per task when the samples of cells are spread over pixels.
const PIXELS_PER_TASK: usize = 1 << 10;
/// Tasks per thread whose contributions are kept until they are added up: enough to keep all
/// threads busy, few enough to fit into memory.
const TASKS_PER_THREAD: usize = 1 << 7;
/// Assumed number of contributions to a cell's sample. The true number depends on the scene.
const CONTRIBUTIONS: usize = 32;

/// Returns the bytes of the contributions that are kept until they are added up. The film has
/// `pixels` pixels, and each contribution has `parts` parts. If contributions are not kept one by
/// one, the result is the bytes of the sums of cells.
pub(super) fn waiting(pixels: usize, parts: usize, keeps: bool) -> usize {
    let pixels = pixels.min(tasks_of_block() * CELLS_PER_TASK);
    let parts = parts * size_of::<(usize, FoundPart)>();
    let contributions = CONTRIBUTIONS * (size_of::<(usize, Contribution)>() + parts);
    pixels * (size_of::<Spectrum>() + if keeps { contributions } else { 0 })
}

/// Returns the number of tasks whose contributions are kept at the same time.
fn tasks_of_block() -> usize {
    TASKS_PER_THREAD * rayon::current_num_threads()
}

/// Results of one sample of a few neighbouring cells.
#[derive(Default)]
struct SplatSamples {
    /// Light that each cell contributes at the point of its sensor ray on the film.
    own: Vec<Spectrum>,
    /// Bias in `own`, if the integrator has a known bias.
    bias: Vec<Spectrum>,
    /// Contributions, each with the cell whose sample found it: all of them if
    /// [`Wanted::keeps_own`], otherwise those with a position on the image.
    contributions: Vec<(usize, Contribution)>,
    /// Parts of the contributions' light, if the film keeps [parts](crate::film::LightParts).
    parts: Option<Vec<(usize, FoundPart)>>,
}

/// Films to which samples of the whole image are added.
pub(super) struct ImageFilms<'a> {
    pub film: &'a mut Film,
    /// Image without its known bias.
    pub debiased: Option<&'a mut Debiased>,
    /// Images of strategies.
    pub strategies: Option<&'a mut Strategies>,
}

/// Sample of the whole image, or a replicate of samples, for one group of channels.
pub(super) struct ImageScores {
    pub image: Scores,
    /// Single samples of the image without its known bias, if the estimator has a known bias.
    pub debiased: Vec<Vec<Spectrum>>,
    pub strategies: StrategyScores,
}

impl ImageScores {
    /// Adds the scores to films.
    pub(super) fn add(self, source: &Source, films: &mut ImageFilms) {
        films.film.add_image(source.group, self.image);
        if let Some(debiased) = &mut films.debiased {
            for values in self.debiased {
                let scores = Scores::of_image(values, Vec::new(), Vec::new());
                debiased.film.add_image(source.group, scores);
            }
        }
        if let Some(strategies) = &mut films.strategies {
            strategies.add(source, self.strategies);
        }
    }
}

/// Samples of the whole image of one group of channels, and the fate of the emitters' power.
pub(super) type FoundImages = (Vec<ImageScores>, BalanceTotals);

/// Task: some cells of one sample.
#[derive(Clone, Debug)]
struct Task {
    sample: u64,
    cells: Range<usize>,
}

/// Tasks in the order in which their results are added up.
struct Tasks {
    cells: usize,
    per_sample: u64,
}

impl Tasks {
    fn over(cells: usize) -> Self {
        Tasks {
            cells,
            per_sample: cells.div_ceil(CELLS_PER_TASK) as u64,
        }
    }

    fn get(&self, number: u64) -> Task {
        let from = (number % self.per_sample) as usize * CELLS_PER_TASK;
        Task {
            sample: number / self.per_sample,
            cells: from..self.cells.min(from + CELLS_PER_TASK),
        }
    }

    /// Divides the tasks of some samples into blocks. Each block belongs to one sample if cells
    /// share light subpaths.
    fn blocks(&self, samples: Range<u64>, is_shared: bool) -> impl Iterator<Item = Range<u64>> {
        let run = if is_shared {
            1
        } else {
            samples.end - samples.start
        };
        let (per_sample, end) = (self.per_sample, samples.end);
        let block = tasks_of_block() as u64;
        let runs = samples.step_by(run.max(1) as usize);
        runs.flat_map(move |first| {
            let tasks = first * per_sample..end.min(first + run) * per_sample;
            let end = tasks.end;
            let starts = tasks.step_by(block as usize);
            starts.map(move |start| start..end.min(start + block))
        })
    }
}

/// Takes a range of samples of the whole image, whole replicates, for the source's channel group.
/// Also finds images of strategies if `separates_strategies`.
pub(super) fn pass(
    light: &LightSamples,
    samples: Range<u64>,
    film: &Film,
    separates_strategies: bool,
) -> (FoundImages, Stats) {
    let source = light.source;
    let tasks = Tasks::over(source.cells.count());
    let decomposition = film.layers().map(|layers| *layers.decomposition());
    let mut assembly = Assembly::new(light, film, decomposition, separates_strategies);
    let wanted = Wanted {
        decomposition: decomposition.unwrap_or_default(),
        keeps_own: separates_strategies || decomposition.is_some(),
    };
    let is_shared = light.integrator.shares_light_paths();
    let mut shared = None;
    for block in tasks.blocks(samples, is_shared) {
        if source.is_stopped() {
            break;
        }
        if is_shared && block.start.is_multiple_of(tasks.per_sample) {
            // Drop the old subpaths first: there is no memory for two sets.
            drop(shared.take());
            let sample = block.start / tasks.per_sample;
            shared = shared::trace(light, sample, wanted.decomposition).map(|followed| {
                assembly.stats += followed.stats;
                assembly.balance += followed.balance;
                followed.found
            });
        }
        let numbers: Vec<u64> = block.clone().collect();
        let parts: Vec<(SplatSamples, Stats, BalanceSums)> = numbers
            .into_par_iter()
            .with_max_len(1)
            .map(|number| part(light, tasks.get(number), shared.as_ref(), &wanted))
            .collect();
        for (number, (part, counts, particles)) in block.zip(parts) {
            assembly.stats += counts;
            assembly.balance += particles;
            let Task { sample, cells } = tasks.get(number);
            if cells.start == 0 {
                assembly.begin(sample);
            }
            assembly.add(part);
            if cells.end == tasks.cells {
                assembly.end(sample);
            }
        }
    }
    ((assembly.found, assembly.balances), assembly.stats)
}

/// Sums from which samples of the whole image are assembled.
struct Assembly<'a> {
    source: &'a Source<'a>,
    /// True if the integrator has a known bias.
    blurs: bool,
    /// True if samples are sorted by brightness.
    sorts: bool,
    /// True if samples are also added to images of strategies.
    separates_strategies: bool,
    /// Footprint of the current sample.
    footprint: Footprint,
    /// Values of the current sample by cell.
    own: Vec<Spectrum>,
    /// Bias of the current sample by cell, if the integrator has a known bias.
    bias: Vec<Spectrum>,
    /// Light of the current sample with positions of its own on the image, by pixel.
    image: Vec<Spectrum>,
    /// Mean of the current replicate up to the last sample, by pixel.
    replicate: Vec<Spectrum>,
    layered: Option<Layered>,
    debiased: Vec<Vec<Spectrum>>,
    sorted: Vec<PlacedValue>,
    strategies: StrategyScores,
    balance: BalanceSums,
    found: Vec<ImageScores>,
    balances: BalanceTotals,
    stats: Stats,
}

impl<'a> Assembly<'a> {
    fn new(
        light: &LightSamples<'a>,
        film: &Film,
        decomposition: Option<Decomposition>,
        separates_strategies: bool,
    ) -> Self {
        let source = light.source;
        Assembly {
            source,
            blurs: light.integrator.blurs(),
            sorts: film.outliers(source.group).is_some(),
            separates_strategies,
            footprint: source.footprint(&source.image_sample(0)),
            own: Vec::new(),
            bias: Vec::new(),
            image: Vec::new(),
            replicate: Vec::new(),
            layered: decomposition.map(|d| Layered::new(d, film.width() * film.height())),
            debiased: Vec::new(),
            sorted: Vec::new(),
            strategies: StrategyScores::default(),
            balance: BalanceSums::default(),
            found: Vec::new(),
            balances: BalanceTotals::default(),
            stats: Stats::default(),
        }
    }

    /// Returns the number of pixels of the film.
    fn pixels(&self) -> usize {
        let film = self.source.scene.film();
        film.width * film.height
    }

    /// Returns the weight of a sample in its replicate: a power of two, so that products are exact.
    fn share(&self) -> f64 {
        1.0 / self.source.replicates.size() as f64
    }

    /// Starts a sample.
    fn begin(&mut self, sample: u64) {
        self.footprint = self.source.footprint(&self.source.image_sample(sample));
        self.own.clear();
        self.own.reserve_exact(self.source.cells.count());
        self.bias.clear();
        self.image.clear();
        self.image.resize(self.pixels(), Spectrum::ZERO);
    }

    /// Adds the results of the next cells of the current sample.
    fn add(&mut self, part: SplatSamples) {
        let share = self.share();
        for (cell, contribution) in part.contributions.iter().filter(|(_, c)| c.image.is_some()) {
            let value = contribution.weighted();
            let place = Place::of(*cell, contribution.image);
            splat(self.source, &self.footprint, place, |pixel, filter| {
                // Planted error "filter of the light image not normalised", found by morgana-transport/transport::agreement::estimators_agree_quickly:
                // self.image[pixel] += value * filter.ceil();
                self.image[pixel] += value * filter;
            });
        }
        if let Some(layered) = &mut self.layered {
            layered.splat(self.source, &self.footprint, &part, share);
        }
        if self.separates_strategies {
            let contributions = &part.contributions;
            self.strategies
                .splat(self.source, &self.footprint, contributions, share);
        }
        self.own.extend(part.own);
        self.bias.extend(part.bias);
    }

    /// Ends the current sample, and the replicate after its last sample.
    fn end(&mut self, sample: u64) {
        let (share, size) = (self.share(), self.source.replicates.size());
        self.balances.enter(&std::mem::take(&mut self.balance));
        let mut image = std::mem::take(&mut self.image);
        if self.blurs {
            let unbiased = |cell: usize| self.own[cell] - self.bias[cell];
            let mut values = image.clone();
            spread(self.source, &self.footprint, unbiased, &mut values);
            values
                .iter_mut()
                .for_each(|value| *value = finite(*value, &mut 0));
            self.debiased.push(values);
        }
        spread(
            self.source,
            &self.footprint,
            |cell| self.own[cell],
            &mut image,
        );
        for value in &mut image {
            *value = finite(*value, &mut self.stats.not_finite);
        }
        if self.sorts {
            if self.sorted.is_empty() {
                self.sorted.reserve_exact(image.len() * size as usize);
            }
            self.sorted.extend(image.iter().copied().enumerate());
        }
        image.iter_mut().for_each(|value| *value *= share);
        if self.replicate.is_empty() {
            self.replicate = image;
        } else {
            let values = self.replicate.iter_mut().zip(&image);
            values.for_each(|(mean, value)| *mean += *value);
            self.image = image;
        }
        if (sample + 1).is_multiple_of(size) {
            let layers = self.layered.as_mut().map_or(Vec::new(), Layered::finish);
            self.found.push(ImageScores {
                image: Scores::of_image(
                    std::mem::take(&mut self.replicate),
                    layers,
                    std::mem::take(&mut self.sorted),
                ),
                debiased: std::mem::take(&mut self.debiased),
                strategies: std::mem::take(&mut self.strategies),
            });
        }
    }
}

/// Adds values of cells to an image, with the weights of a sample's footprint.
pub(super) fn spread(
    source: &Source,
    footprint: &Footprint,
    value: impl Fn(usize) -> Spectrum + Sync,
    image: &mut [Spectrum],
) {
    let cells = &source.cells;
    let pixels = image.par_iter_mut().enumerate();
    pixels
        .with_min_len(PIXELS_PER_TASK)
        .for_each(|(pixel, sum)| {
            cells.each_cell(footprint, pixel, |cell, weight| {
                *sum += value(cell) * weight
            });
            if cells.overlap() {
                *sum = sum.map(rounded);
            }
        });
}

/// Rounds a number to 44 binary digits (T. J. Dekker, "A floating-point technique for extending the
/// available precision", 1971). Weights add up to one, except for rounding. An even image then
/// stays exactly even.
fn rounded(x: f64) -> f64 {
    let split = x * (f64::from(1 << 9) + 1.0);
    split - (split - x)
}

/// Results of cells that callers need in addition to the sums.
struct Wanted {
    /// Decomposition of light into layers and parts.
    decomposition: Decomposition,
    /// True if contributions without positions on the image are returned one by one.
    keeps_own: bool,
}

/// Takes the samples of a task.
fn part(
    light: &LightSamples,
    task: Task,
    shared: Option<&Merging>,
    wanted: &Wanted,
) -> (SplatSamples, Stats, BalanceSums) {
    let source = light.source;
    let mut ws = source.workspace();
    let mut balance = BalanceSums::default();
    let (mut found, mut part) = (Vec::new(), SplatSamples::default());
    let mut followed = FollowedSamples::of(light, &wanted.decomposition);
    part.parts = followed.is_some().then(Vec::new);
    let sample = source.image_sample(task.sample);
    let footprint = source.footprint(&sample);
    let may_skip = !light.integrator.splats();
    let taken = source.cells.pixels_among(task.cells.clone());
    for cell in task.cells {
        let counts = !may_skip || source.cells.counts(&footprint, cell);
        if !counts || source.is_stopped() {
            part.own.push(Spectrum::ZERO);
            continue;
        }
        match &mut followed {
            Some(followed) => followed.take(cell, &sample, &mut ws, &mut found),
            None => shared::take(light, shared, cell, &sample, &mut ws, &mut found),
        }
        if light.integrator.splats() {
            let particle = std::mem::take(&mut ws.particle_balance);
            balance.add(&particle, &mut ws.stats.not_finite);
        }
        let (mut own, mut bias) = (Spectrum::ZERO, Spectrum::ZERO);
        for contribution in found.drain(..) {
            if !contribution.is_finite() {
                ws.stats.not_finite += 1;
                continue;
            }
            if contribution.image.is_none() {
                own += contribution.weighted();
                // Only light without a position on the image is blurred.
                bias += contribution.bias * contribution.weight;
            }
            if wanted.keeps_own || contribution.image.is_some() {
                part.contributions.push((cell, contribution));
            }
        }
        part.own.push(own);
        if light.integrator.blurs() {
            part.bias.push(bias);
        }
        if let (Some(parts), Some(followed)) = (&mut part.parts, &followed) {
            let found = followed.parts().filter(|part| !part.value.is_zero());
            parts.extend(found.map(|part| {
                let value = finite(part.value, &mut ws.stats.not_finite);
                (cell, FoundPart { value, ..part })
            }));
        }
    }
    source.handle.count(taken as u64);
    (part, ws.stats(), balance)
}

/// Position of a contribution on the film.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    /// Point of the sensor ray of a cell.
    Cell(usize),
    /// Point of the sensor's image.
    Image([f64; 2]),
}

impl Place {
    /// Returns the position of a contribution to the sample of a cell: see [`Contribution::image`].
    pub(super) fn of(cell: usize, image: Option<[f64; 2]>) -> Self {
        image.map_or(Place::Cell(cell), Place::Image)
    }
}

/// Calls `count` with each pixel that receives a part of a contribution, and with the factor of
/// this pixel. `footprint` is the footprint of the sample.
pub(super) fn splat(
    source: &Source,
    footprint: &Footprint,
    place: Place,
    count: impl FnMut(usize, f64),
) {
    match place {
        Place::Cell(cell) => source.cells.each_pixel(footprint, cell, count),
        Place::Image(image) => splat_image(source, image, count),
    }
}

/// Calls `count` with each pixel that receives light at a point of the sensor's image, and with the
/// factor of this pixel.
pub(super) fn splat_image(source: &Source, image: [f64; 2], mut count: impl FnMut(usize, f64)) {
    let spec = source.scene.film();
    // A pixel's filter per unit of the image's area is the filter per pixel times the number of
    // pixels of the whole image. There are as many light subpaths as cells.
    let share = spec.pixels_of_image() / source.cells.count() as f64;
    let footprint = Footprint::at(&spec.filter, spec.position(image));
    footprint.each([spec.width, spec.height], [0, 0], |pixel, weight| {
        count(pixel, weight * share);
    });
}

/// Sums of the layers of a sample of the whole image.
struct Layered {
    decomposition: Decomposition,
    /// Values by pixel and layer.
    pending: Pending,
}

impl Layered {
    fn new(decomposition: Decomposition, pixels: usize) -> Self {
        Layered {
            decomposition,
            pending: Pending::new(pixels * decomposition.layers()),
        }
    }

    /// Adds samples of some cells with a footprint, times `share`.
    fn splat(
        &mut self,
        source: &Source,
        footprint: &Footprint,
        samples: &SplatSamples,
        share: f64,
    ) {
        let layers = self.decomposition.layers();
        let pending = &mut self.pending;
        let mut add = |own: usize, part: &FoundPart| {
            splat(
                source,
                footprint,
                Place::of(own, part.image),
                |pixel, filter| {
                    pending.add(pixel * layers + part.layer, part.value * (filter * share));
                },
            );
        };
        if let Some(parts) = &samples.parts {
            return parts.iter().for_each(|(own, part)| add(*own, part));
        }
        for (own, contribution) in &samples.contributions {
            let part = FoundPart {
                layer: self.decomposition.layer(&contribution.path),
                image: contribution.image,
                value: contribution.weighted(),
            };
            add(*own, &part);
        }
    }

    /// Returns the values that are not zero with their places, pixel × number of layers + layer.
    /// Resets the sums.
    fn finish(&mut self) -> Vec<PlacedValue> {
        let mut values = Vec::new();
        self.pending
            .take(|place, value| values.push((place, value)));
        values
    }
}
