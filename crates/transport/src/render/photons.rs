//! Estimators whose pixels share photon maps: one for each sample of the whole image.
//!
//! As for splats, samples of the whole image are independent of one another, and so are those of a pixel,
//! while pixels of one sample are not.
//!
//! Theory: docs/theory.md#progressive-photon-maps.

use super::Debiased;
use super::source::{PILOT, SampledRay, Source, add};
use super::splats::Layered;
use crate::Spectrum;
use crate::film::{Decomposition, Film, Pending};
use crate::integrator::{Gathering, PhotonMapping, even_channel_pdf};
use crate::path::BalanceTotals;
use crate::photons::{Followed, PhotonMap};
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Pixels per unit of work.
const PIXELS_PER_TASK: usize = 16;

/// One sample of a pixel.
struct Taken {
    value: Spectrum,
    /// The part of it that is bias.
    bias: Spectrum,
    /// Values by layer, if light is told apart.
    layers: Vec<(usize, Spectrum)>,
}

/// Radius of the first photon map of a source.
pub(super) fn first_radius(source: &Source, mapping: &PhotonMapping) -> f64 {
    let automatic = || map(source, mapping, PILOT).found.first_radius(source.scene);
    mapping.radius.unwrap_or_else(automatic)
}

fn map(source: &Source, mapping: &PhotonMapping, sample: u64) -> Followed<PhotonMap> {
    let (scene, channels) = (source.scene, source.channels());
    let bounds = mapping.bounds(even_channel_pdf(channels));
    source.with_light_paths(sample, bounds, mapping.paths(scene), PhotonMap::trace)
}

/// Adds a range of samples to every pixel of the source's channel group.
pub(super) fn pass(
    source: &Source,
    mapping: &PhotonMapping,
    samples: Range<u64>,
    film: &mut Film,
    debiased: &mut Debiased,
    balances: &mut BalanceTotals,
) -> Stats {
    let mut stats = Stats::default();
    for sample in samples {
        if source.is_stopped() {
            break;
        }
        let Followed {
            found: map,
            stats: counts,
            balance,
        } = map(source, mapping, sample);
        stats += counts;
        balances.enter(&balance);
        let gathering = Gathering {
            scene: source.scene.at(sample),
            mapping,
            map: &map,
            radii: mapping.radii(source.prepared.radius, sample),
            channel_pdf: even_channel_pdf(source.channels()),
        };
        let decomposition = film.layers().map(|layers| *layers.decomposition());
        let pixels = film.width() * film.height();
        let parts: Vec<(Vec<Taken>, Stats)> = (0..pixels.div_ceil(PIXELS_PER_TASK))
            .into_par_iter()
            .with_max_len(1)
            .map(|task| {
                let range = task * PIXELS_PER_TASK..pixels.min((task + 1) * PIXELS_PER_TASK);
                part(source, &gathering, decomposition, sample, range)
            })
            .collect();
        let mut taken = Vec::with_capacity(pixels);
        for (part, counts) in parts {
            stats += counts;
            taken.extend(part);
        }
        add_sample(source.group, &taken, film, debiased, &mut stats);
    }
    stats
}

fn part(
    source: &Source,
    gathering: &Gathering,
    decomposition: Option<Decomposition>,
    sample: u64,
    pixels: Range<usize>,
) -> (Vec<Taken>, Stats) {
    let mut ws = source.workspace();
    let mut pending = decomposition.map(|d| (d, Pending::new(d.layers())));
    let count = pixels.len() as u64;
    let taken = pixels.map(|pixel| {
        let SampledRay {
            ray,
            weight,
            mut sampler,
            ..
        } = source.ray(pixel, sample);
        ws.stats.paths += 1;
        let (mut value, mut bias) = (Spectrum::ZERO, Spectrum::ZERO);
        gathering.along(ray, &mut sampler, &mut ws, |light| {
            if !source.shows(&light.path) {
                return;
            }
            value += light.value * weight;
            bias += light.bias * weight;
            if let Some((decomposition, pending)) = &mut pending {
                pending.add(decomposition.layer(&light.path), light.value * weight);
            }
        });
        let mut layers = Vec::new();
        if let Some((_, pending)) = &mut pending {
            pending.take(|layer, value| layers.push((layer, value)));
        }
        Taken {
            value,
            bias,
            layers,
        }
    });
    let taken = taken.collect();
    source.handle.count(count);
    (taken, ws.stats())
}

/// Adds a sample of every pixel.
fn add_sample(
    group: usize,
    taken: &[Taken],
    film: &mut Film,
    debiased: &mut Debiased,
    stats: &mut Stats,
) {
    let mut layered = Layered::new(film.parts_mut(group).layers, taken.len());
    let mut parts = film.parts_mut(group);
    let mut levels = parts.outliers.as_mut().map(|c| c.levels_mut());
    let (mut sum, mut sum_debiased) = (Spectrum::ZERO, Spectrum::ZERO);
    let pixels = parts.pixels.iter_mut().zip(debiased.film.group_mut(group));
    for (i, ((pixel, other), taken)) in pixels.zip(taken).enumerate() {
        let finite = taken.value.is_finite();
        let bias = if finite { taken.bias } else { Spectrum::ZERO };
        let value = add(pixel, taken.value, &mut stats.not_finite);
        sum += value;
        sum_debiased += add(other, value - bias, &mut stats.not_finite);
        if let Some(levels) = &mut levels {
            levels.add(i, value);
        }
        if let (Some(layered), true) = (&mut layered, finite) {
            for &(layer, value) in &taken.layers {
                layered.add(i, layer, value);
            }
        }
    }
    if let (Some(layered), Some(layers)) = (&mut layered, parts.layers) {
        layered.finish(layers);
    }
    film.add_whole(group, sum / taken.len() as f64);
    debiased
        .film
        .add_whole(group, sum_debiased / taken.len() as f64);
}
