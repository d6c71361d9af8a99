//! Allocation of samples to pixels.
//!
//! Consider a pixel of variance v whose samples take work c. Each pixel receives samples in
//! proportion to √(v/c). The mean over the image, and the pixels on average, then have the least
//! variance for their work (Neyman 1934). A pilot estimates v and c. Its samples are not part of
//! the image, so every pixel's mean and variance stay unbiased (docs/theory.md#adaptive-sampling).
//!
//! The shares do not depend on the total number of samples. Parts of a render therefore agree about
//! which samples each pixel takes.

use super::RenderOptions;
use super::passes::Passes;
use super::source::{LightSamples, finite};
use crate::Spectrum;
use crate::path::Workspace;
use crate::scene::{FilmSpec, Scene};
use crate::sum::ReproducibleSum;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// Number of samples of the image that all pixels take before they have different shares, rounded
/// up to whole replicates and periods. For fewer samples, the pilot takes more work than it saves.
pub const ADAPTIVE_FROM: u64 = 16;
/// Samples per pixel in the pilot.
const PILOT_SAMPLES: u64 = 4;
/// First number of the pilot's samples, beyond the numbers of all renders.
// Planted error "samples shared out by what the image itself has seen", found by morgana-transport/transport::adaptive::what_a_pilot_sees_by_chance_does_not_bias_the_image:
// const FIRST_SAMPLE: u64 = 0;
const FIRST_SAMPLE: u64 = 1 << 62;
/// Pixels per task of the pilot.
const PIXELS_PER_TASK: usize = 64;
/// Radius, in pixels along both axes, over which variances are averaged. The variance of one pixel
/// is too uncertain.
const AVERAGING_RADIUS: usize = 2;
/// Variance that is added to the variance of each pixel, as a fraction of the mean variance of all
/// pixels. The pilot may have missed rare light.
const PRIOR_FRACTION: f32 = 0.05;
/// Number of units in a share of one: the pixel takes one sample per sample of the image.
const UNIT_SHARE: u16 = 256;
/// Smallest share of a pixel, in units of 1/[`UNIT_SHARE`]; [`MAX_SHARE`] is the largest.
const MIN_SHARE: u16 = UNIT_SHARE / 2;
const MAX_SHARE: u16 = 8 * UNIT_SHARE;
/// Bytes per pixel while shares are computed: forecasts, benefits and shares.
pub(super) const BYTES: usize = size_of::<PixelForecast>() + size_of::<f32>() + size_of::<u16>();
/// Number of bisection steps for the scale of shares, more than integer shares need.
const HALVINGS: u32 = 40;

/// Allocation of samples to pixels. The share of a pixel is the number of samples that it takes per
/// sample of the image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Allocation {
    /// Number of samples that are taken together: whole replicates at all instants of a period.
    unit: u64,
    shares: Shares,
}

/// Shares: the number of samples that each pixel takes per sample of the image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Shares {
    /// Shares of one for all pixels.
    Even,
    /// Shares that a pilot will determine when they are needed.
    Open,
    /// Share of each pixel, in units of 1/[`UNIT_SHARE`].
    Known(Vec<u16>),
}

impl Allocation {
    /// Creates the allocation of a new render.
    pub(super) fn new(scene: &Scene, options: &RenderOptions) -> Self {
        let shares = if options.is_adaptive() {
            Shares::Open
        } else {
            Shares::Even
        };
        Allocation {
            unit: scene.whole_periods(1, options.replicates()),
            shares,
        }
    }

    /// Returns true if this allocation is valid for a render of `pixels` pixels that begins with
    /// `blank`.
    pub(super) fn fits(&self, blank: &Allocation, pixels: usize) -> bool {
        let sound = |share| (MIN_SHARE..=MAX_SHARE).contains(share);
        let fits = match &self.shares {
            Shares::Known(shares) => shares.len() == pixels && shares.iter().all(sound),
            _ => true,
        };
        fits && self.agrees(blank)
    }

    /// Returns true if both allocations can belong to parts of one render.
    pub(super) fn agrees(&self, other: &Allocation) -> bool {
        self.unit == other.unit
            && match (&self.shares, &other.shares) {
                (Shares::Even, Shares::Even) => true,
                (Shares::Even, _) | (_, Shares::Even) => false,
                (Shares::Known(a), Shares::Known(b)) => a == b,
                (Shares::Open, _) | (_, Shares::Open) => true,
            }
    }

    /// Copies the shares of `other`, an allocation of the same render, if `self` has none.
    pub(super) fn adopt(&mut self, other: &Allocation) {
        if self.shares == Shares::Open {
            self.clone_from(other);
        }
    }

    /// Returns the number of samples of the image, from number `at` on, that can be taken before
    /// shares are needed.
    pub(super) fn ready(&self, at: u64) -> u64 {
        match self.shares {
            Shares::Open => (self.from() * self.unit).saturating_sub(at),
            _ => u64::MAX,
        }
    }

    /// Returns the number of the first unit with shares.
    fn from(&self) -> u64 {
        ADAPTIVE_FROM.div_ceil(self.unit)
    }

    /// Returns the numbers of the samples of a pixel that belong to a sample of the image. If
    /// `sample` is the first one of a replicate, each of them is the first one of a replicate.
    pub(super) fn samples(&self, pixel: usize, sample: u64) -> impl Iterator<Item = u64> + use<> {
        let (unit, place) = (sample / self.unit, sample % self.unit);
        let units = match &self.shares {
            Shares::Known(shares) => {
                let share = u64::from(shares[pixel]);
                // Planted error "samples that a pixel takes twice", found by morgana-transport/transport::adaptive::errors_are_smaller_and_true_and_means_agree:
                // self.taken(unit, share)..self.taken(unit + 1, share) + 1
                self.taken(unit, share)..self.taken(unit + 1, share)
            }
            _ => unit..unit + 1,
        };
        let size = self.unit;
        units.map(move |unit| unit * size + place)
    }

    /// Returns the number of units that a pixel has taken before a unit of the image.
    fn taken(&self, unit: u64, share: u64) -> u64 {
        let shared = unit.saturating_sub(self.from());
        let one = u64::from(UNIT_SHARE);
        let taken = unit - shared + (shared * share + one / 2) / one;
        // Sums have no room for more.
        taken.min(ReproducibleSum::MAX_NUMBERS / self.unit)
    }

    /// Runs the pilot and computes the shares. Calls `between` now and then; when it breaks, the
    /// allocation stays as it is.
    pub(super) fn measure(
        &mut self,
        lights: &[LightSamples],
        mut between: impl FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let film = lights[0].source.scene.film();
        let tasks = (film.width * film.height).div_ceil(PIXELS_PER_TASK);
        let mut forecasts = Vec::with_capacity(film.width * film.height);
        let mut passes = Passes::over(std::iter::once(0..tasks as u64));
        while let Some(at) = passes.at() {
            if at > 0 {
                between()?;
            }
            let pass = passes.begin(|next| next);
            let taken = (pass.start as usize..pass.end as usize).into_par_iter();
            forecasts.par_extend(
                taken
                    .with_max_len(1)
                    .flat_map_iter(|task| task_of_pilot(lights, film, self.unit, task)),
            );
            passes.end();
            if lights[0].source.is_stopped() {
                return ControlFlow::Break(());
            }
        }
        self.shares = Shares::Known(shares(&forecasts, film.width));
        ControlFlow::Continue(())
    }
}

/// Expected variance and work of a pixel's samples, in single precision because every pixel of the
/// film has one.
#[derive(Clone, Copy, Debug, Default)]
struct PixelForecast {
    /// Variance, summed over channels.
    variance: f32,
    work: f32,
}

impl PixelForecast {
    /// Adds `factor` times the other forecast.
    fn plus(self, other: PixelForecast, factor: f32) -> Self {
        PixelForecast {
            variance: self.variance + factor * other.variance,
            work: self.work + factor * other.work,
        }
    }
}

/// Takes the pilot's samples of the pixels of a task.
fn task_of_pilot(
    lights: &[LightSamples],
    film: &FilmSpec,
    unit: u64,
    task: usize,
) -> Vec<PixelForecast> {
    let first = task * PIXELS_PER_TASK;
    let pixels = first..(film.width * film.height).min(first + PIXELS_PER_TASK);
    let mut forecasts = vec![PixelForecast::default(); pixels.len()];
    for light in lights {
        let mut ws = light.source.workspace();
        for (pixel, forecast) in pixels.clone().zip(&mut forecasts) {
            *forecast = forecast.plus(pilot(light, pixel, unit, &mut ws), 1.0);
        }
    }
    forecasts
}

/// Takes the pilot's samples of one pixel.
fn pilot(light: &LightSamples, pixel: usize, unit: u64, ws: &mut Workspace) -> PixelForecast {
    let (first, instants) = (
        FIRST_SAMPLE.next_multiple_of(unit),
        light.source.scene.instants() as u64,
    );
    let before = ws.stats().cost();
    let mut found = Vec::new();
    let (mut sum, mut squares) = (Spectrum::ZERO, 0.0);
    for i in 0..PILOT_SAMPLES {
        // Place each sample in its own replicate, because samples of one replicate are not
        // independent. Distribute the samples over the instants of a period.
        let sample = first + unit * i + instants * i / PILOT_SAMPLES;
        light.take_pixel(pixel, sample, ws, &mut found);
        let values = found.drain(..).map(|c| c.weighted());
        let value = finite(values.fold(Spectrum::ZERO, |a, b| a + b), &mut 0);
        sum += value;
        squares += (value * value).sum();
    }
    let n = PILOT_SAMPLES as f64;
    PixelForecast {
        variance: ((squares - (sum * sum).sum() / n).max(0.0) / (n - 1.0)) as f32,
        work: ((ws.stats().cost() - before) / n) as f32,
    }
}

/// Returns the share of each pixel, row by row in `width` columns. Shares are in proportion to
/// √(v/c) within limits, and one on average.
fn shares(forecasts: &[PixelForecast], width: usize) -> Vec<u16> {
    let variances = forecasts.iter().map(|o| f64::from(o.variance));
    let mean = (variances.sum::<f64>() / forecasts.len() as f64) as f32;
    if !(mean > 0.0 && mean.is_finite()) {
        return vec![UNIT_SHARE; forecasts.len()];
    }
    let worth = |o: PixelForecast| ((o.variance / mean + PRIOR_FRACTION) / o.work.max(1.0)).sqrt();
    let worths: Vec<f32> = smoothed(forecasts, width).map(worth).collect();
    let scale = scale(&worths);
    let share = |worth: &f32| limited(scale * f64::from(*worth)).round() as u16;
    worths.iter().map(share).collect()
}

fn limited(share: f64) -> f64 {
    share.clamp(f64::from(MIN_SHARE), f64::from(MAX_SHARE))
}

/// Finds the factor for which the mean share is one.
fn scale(worths: &[f32]) -> f64 {
    let sum = |scale: f64| {
        worths
            .iter()
            .map(|w| limited(scale * f64::from(*w)))
            .sum::<f64>()
    };
    let wanted = f64::from(UNIT_SHARE) * worths.len() as f64;
    let extreme =
        |f: fn(f32, f32) -> f32| f64::from(worths.iter().copied().reduce(f).unwrap_or(1.0));
    let mut low = f64::from(MIN_SHARE) / extreme(f32::max);
    let mut high = f64::from(MAX_SHARE) / extreme(f32::min);
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        if sum(middle) < wanted {
            low = middle
        } else {
            high = middle
        }
    }
    high
}

/// Averages forecasts over the pixels around each pixel. At the image's edges there are fewer.
fn smoothed(forecasts: &[PixelForecast], width: usize) -> impl Iterator<Item = PixelForecast> {
    let height = forecasts.len() / width;
    let near = move |at: usize, end: usize| {
        at.saturating_sub(AVERAGING_RADIUS)..end.min(at + AVERAGING_RADIUS + 1)
    };
    let mean = move |i: usize| {
        let (rows, columns) = (near(i / width, height), near(i % width, width));
        let share = 1.0 / (rows.len() * columns.len()) as f32;
        let around = rows.flat_map(|row| &forecasts[row * width..][columns.clone()]);
        around.fold(PixelForecast::default(), |sum, o| sum.plus(*o, share))
    };
    (0..forecasts.len()).map(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn allocation(unit: u64, shares: Vec<u16>) -> Allocation {
        Allocation {
            unit,
            shares: Shares::Known(shares),
        }
    }

    /// All samples of the image below a number map to the first samples of each pixel, each exactly
    /// once. The number of a pixel's samples is its share times the samples after the common
    /// samples, in whole units.
    #[test]
    fn pixels_take_their_first_samples_once() {
        for unit in [1, 3, 8, 24] {
            let shares = vec![MIN_SHARE, 200, UNIT_SHARE, 700, MAX_SHARE];
            let allocation = allocation(unit, shares.clone());
            for (pixel, share) in shares.into_iter().enumerate() {
                let even = ADAPTIVE_FROM.next_multiple_of(unit);
                for end in [1, 15, 16, 17, 24, 48, 240, 1000].map(|n: u64| n * unit) {
                    let taken = (0..end).flat_map(|sample| allocation.samples(pixel, sample));
                    let mut taken: Vec<u64> = taken.collect();
                    taken.sort_unstable();
                    let count = taken.len() as u64;
                    assert_eq!(taken, (0..count).collect::<Vec<_>>());
                    assert!(count.is_multiple_of(unit));
                    let shared = end.saturating_sub(even) * u64::from(share);
                    let wanted = (end - end.saturating_sub(even)) as f64;
                    let wanted = wanted + shared as f64 / f64::from(UNIT_SHARE);
                    assert!((count as f64 - wanted).abs() <= 0.5 * unit as f64);
                }
            }
        }
    }

    /// Sums have room for the samples that the largest share receives in the longest render.
    #[test]
    fn no_pixel_gets_more_than_there_is_room_for() {
        for unit in [1, 8, 256] {
            let allocation = allocation(unit, vec![]);
            let units = allocation.taken(ReproducibleSum::MAX_NUMBERS / unit, MAX_SHARE.into());
            assert!(units * unit <= ReproducibleSum::MAX_NUMBERS);
        }
    }

    /// The scene has a bright spot, and a part where samples take nine times the work.
    #[test]
    fn shares_weigh_noise_against_work() {
        let (width, height) = (40, 30);
        let forecast = |i: usize| PixelForecast {
            variance: if i / width < 10 { 16.0 } else { 1.0 },
            work: if i % width < 20 { 9.0 } else { 1.0 },
        };
        let forecasts: Vec<_> = (0..width * height).map(forecast).collect();
        let shares = shares(&forecasts, width);
        let mean = shares.iter().map(|s| f64::from(*s)).sum::<f64>() / shares.len() as f64;
        // Shares are rounded to 1/256.
        assert!(
            (mean / f64::from(UNIT_SHARE) - 1.0).abs() < 0.5 / 256.0,
            "{mean}"
        );
        let at = |row: usize, column: usize| f64::from(shares[row * width + column]);
        let prior = f64::from(PRIOR_FRACTION) * 6.0;
        let noise = ((16.0 + prior) / (1.0 + prior)).sqrt();
        assert!((at(2, 30) / at(20, 30) / noise - 1.0).abs() < 0.01);
        assert!((at(2, 30) / at(2, 5) / 3.0 - 1.0).abs() < 0.01);
        assert_eq!(at(20, 5), f64::from(MIN_SHARE));
    }

    /// Equal variances and equal work give equal shares.
    #[test]
    fn equals_get_equal_shares() {
        for variance in [0.0, 1.0, f32::INFINITY, f32::NAN] {
            let forecast = PixelForecast {
                variance,
                work: 10.0,
            };
            assert_eq!(shares(&[forecast; 12], 4), [UNIT_SHARE; 12], "{variance}");
        }
    }
}
