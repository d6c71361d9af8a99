//! Estimators whose pixels share photon maps, one map for each sample of the whole image.
//!
//! Samples of the whole image are independent of one another, as for splats. So are the samples of
//! one pixel, but the pixels of one sample are not.
//!
//! Theory: docs/theory.md#progressive-photon-maps.

use super::source::{PILOT, SampledRay, Source, finite};
use super::splats::{FoundImages, ImageScores};
use super::strategies::StrategyScores;
use crate::Spectrum;
use crate::film::{Decomposition, Film, Pending, Scores};
use crate::integrator::{Gathering, PhotonMapping, even_channel_pdf};
use crate::path::BalanceTotals;
use crate::photons::{Followed, PhotonMap};
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Pixels per task.
const PIXELS_PER_TASK: usize = 16;

/// Sample of a pixel.
struct Taken {
    value: Spectrum,
    /// Part of the value that is bias.
    bias: Spectrum,
    /// Values by layer, if the film has layers.
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

/// Takes a range of samples of the whole image for the source's channel group.
pub(super) fn pass(
    source: &Source,
    mapping: &PhotonMapping,
    samples: Range<u64>,
    film: &Film,
) -> (FoundImages, Stats) {
    let mut stats = Stats::default();
    let (mut images, mut balances) = (Vec::new(), BalanceTotals::default());
    let decomposition = film.layers().map(|layers| *layers.decomposition());
    let sorts = film.outliers(source.group).is_some();
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
        let pixels = film.width() * film.height();
        let parts: Vec<(Vec<Taken>, Stats)> = (0..pixels.div_ceil(PIXELS_PER_TASK))
            .into_par_iter()
            .with_max_len(1)
            .map(|task| {
                let range = task * PIXELS_PER_TASK..pixels.min((task + 1) * PIXELS_PER_TASK);
                part(source, &gathering, decomposition, sample, range)
            })
            .collect();
        let (mut values, mut debiased) = (Vec::with_capacity(pixels), Vec::with_capacity(pixels));
        let (mut layers, mut sorted) = (Vec::new(), Vec::new());
        for (part, counts) in parts {
            stats += counts;
            for taken in part {
                let pixel = values.len();
                let is_finite = taken.value.is_finite();
                let bias = if is_finite {
                    taken.bias
                } else {
                    Spectrum::ZERO
                };
                let value = finite(taken.value, &mut stats.not_finite);
                values.push(value);
                debiased.push(finite(value - bias, &mut stats.not_finite));
                if sorts {
                    sorted.push((pixel, value));
                }
                if let (Some(decomposition), true) = (decomposition, is_finite) {
                    let first = pixel * decomposition.layers();
                    let placed = taken.layers.into_iter();
                    layers.extend(placed.map(|(layer, value)| (first + layer, value)));
                }
            }
        }
        images.push(ImageScores {
            image: Scores::of_image(values, layers, sorted),
            debiased: vec![debiased],
            strategies: StrategyScores::default(),
        });
    }
    ((images, balances), stats)
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
