//! Estimators whose samples contribute all over the image.
//!
//! One sample of every pixel together make one sample of the whole image: contributions to other pixels
//! are added up first, and then each pixel takes its sum as one sample. So pixels' samples are
//! independent of one another over the sample's number, and the variance of their mean is known as
//! for any other estimator. Sums are formed in the order of samples, pixels and paths, whatever thread
//! computed them: the same seed gives the same bits.

use super::source::{Source, add};
use super::strategies::Strategies;
use crate::Spectrum;
use crate::film::{Film, footprint};
use crate::integrator::Contribution;
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Pixels per unit of work.
const PIXELS_PER_TASK: usize = 16;
/// Pixels times samples that are kept before they are added up: enough to keep all threads busy.
const BLOCK: usize = 1 << 14;

/// One sample of a few neighbouring pixels: contributions, and the pixel whose sample each is.
type Part = Vec<(usize, Contribution)>;

/// Adds a range of samples to every pixel of the source's channel group.
pub(super) fn pass(
    source: &Source,
    samples: Range<u64>,
    (film, mut strategies): (&mut Film, Option<&mut Strategies>),
    counter: &AtomicU64,
) -> Stats {
    let pixels = film.width() * film.height();
    let block = (BLOCK / pixels).max(1) as u64;
    let mut stats = Stats::default();
    let mut start = samples.start;
    while start < samples.end {
        let end = samples.end.min(start + block);
        let parts = parts(source, start..end, pixels, counter);
        stats += parts.1;
        for (sample, parts) in (start..end).zip(parts.0) {
            let image = add_up(source, parts.iter().flatten(), Contribution::weighted);
            for (pixel, value) in film.group_mut(source.group).iter_mut().zip(image) {
                add(pixel, value, &mut stats.not_finite);
            }
            if let Some(strategies) = strategies.as_deref_mut() {
                strategies.add(source, sample, parts.iter().flatten());
            }
        }
        start = end;
    }
    stats
}

/// For each sample the parts of the image in order.
fn parts(
    source: &Source,
    samples: Range<u64>,
    pixels: usize,
    counter: &AtomicU64,
) -> (Vec<Vec<Part>>, Stats) {
    let tasks = pixels.div_ceil(PIXELS_PER_TASK);
    let numbers: Vec<(u64, usize)> = samples
        .clone()
        .flat_map(|sample| (0..tasks).map(move |task| (sample, task)))
        .collect();
    let results: Vec<(Part, Stats)> = numbers
        .into_par_iter()
        .map(|(sample, task)| {
            let first = task * PIXELS_PER_TASK;
            let range = first..pixels.min(first + PIXELS_PER_TASK);
            part(source, sample, range, counter)
        })
        .collect();
    let mut stats = Stats::default();
    let mut sorted = Vec::new();
    for (i, (part, counts)) in results.into_iter().enumerate() {
        stats += counts;
        if i % tasks == 0 {
            sorted.push(Vec::with_capacity(tasks));
        }
        if let Some(last) = sorted.last_mut() {
            last.push(part);
        }
    }
    (sorted, stats)
}

fn part(source: &Source, sample: u64, pixels: Range<usize>, counter: &AtomicU64) -> (Part, Stats) {
    let mut ws = source.workspace();
    let (mut found, mut part) = (Vec::new(), Part::new());
    let taken = pixels.len() as u64;
    for pixel in pixels {
        source.sample(pixel, sample, &mut ws, &mut found);
        for contribution in found.drain(..) {
            if contribution.weighted().is_finite() {
                part.push((pixel, contribution));
            } else {
                ws.stats.not_finite += 1;
            }
        }
    }
    counter.fetch_add(taken, Ordering::Relaxed);
    (part, ws.stats())
}

/// The sum over contributions of what `value` says that they are, for every pixel.
pub(super) fn add_up<'a>(
    source: &Source,
    contributions: impl Iterator<Item = &'a (usize, Contribution)>,
    value: impl Fn(&Contribution) -> Spectrum,
) -> Vec<Spectrum> {
    let spec = source.scene.film();
    let size = (spec.width, spec.height);
    let mut image = vec![Spectrum::ZERO; size.0 * size.1];
    for (own, contribution) in contributions {
        match contribution.image {
            None => image[*own] += value(contribution),
            // A pixel's filter per unit of the image's area is their number times that per pixel, and
            // there are as many paths as pixels.
            Some(place) => {
                for (pixel, filter) in footprint(size, spec.filter, place) {
                    image[pixel] += value(contribution) * filter;
                }
            }
        }
    }
    image
}
