//! Estimators whose pixels share photon maps, one map for each sample of the whole image.
//!
//! Samples of the whole image are independent of one another, as for splats. So are the samples of
//! one pixel, but the pixels of one sample are not.
//!
//! Theory: docs/theory.md#progressive-photon-maps.

use super::source::{PILOT_SAMPLE, SampledRay, Source, finite};
use super::splats::{FoundImages, ImageScores, spread};
use super::strategies::StrategyScores;
use crate::Spectrum;
use crate::film::{Decomposition, Film, Pending, Scores};
use crate::integrator::{Gathering, PhotonMapping, even_channel_pdf};
use crate::path::BalanceTotals;
use crate::photons::{Followed, PhotonMap};
use crate::stats::Stats;
use rayon::prelude::*;
use std::ops::Range;

/// Cells per task.
const CELLS_PER_TASK: usize = 16;

/// Sample of a cell.
#[derive(Clone, Default)]
struct Taken {
    value: Spectrum,
    /// Part of the value that is bias.
    bias: Spectrum,
    /// Values by layer, if the film has layers.
    layers: Vec<(usize, Spectrum)>,
}

/// Returns the radius of the first photon map of a source.
pub(super) fn first_radius(source: &Source, mapping: &PhotonMapping) -> f64 {
    let automatic = || {
        map(source, mapping, PILOT_SAMPLE)
            .found
            .first_radius(source.scene, mapping.neighbours())
    };
    mapping.radius.unwrap_or_else(automatic)
}

fn map(source: &Source, mapping: &PhotonMapping, sample: u64) -> Followed<PhotonMap> {
    let (scene, channels) = (source.scene, source.channels());
    let bounds = mapping.bounds(even_channel_pdf(channels));
    source.with_light_paths(sample, bounds, mapping.paths(scene), |paths| {
        mapping.trace(paths)
    })
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
            smooths_directions: mapping.smooths_directions(sample),
            radii: mapping.radii(source.prepared.radius, sample),
            channel_pdf: even_channel_pdf(source.channels()),
        };
        let cells = source.cells.count();
        let parts: Vec<(Vec<Taken>, Stats)> = (0..cells.div_ceil(CELLS_PER_TASK))
            .into_par_iter()
            .with_max_len(1)
            .map(|task| {
                let range = task * CELLS_PER_TASK..cells.min((task + 1) * CELLS_PER_TASK);
                part(source, &gathering, decomposition, sample, range)
            })
            .collect();
        let mut taken: Vec<Taken> = Vec::with_capacity(cells);
        for (part, counts) in parts {
            stats += counts;
            taken.extend(part);
        }
        for taken in taken.iter_mut().filter(|taken| !taken.value.is_finite()) {
            stats.not_finite += 1;
            *taken = Taken::default();
        }
        let footprint = source.footprint(&source.image_sample(sample));
        let mut image_of = |value: &(dyn Fn(&Taken) -> Spectrum + Sync)| {
            let mut image = vec![Spectrum::ZERO; film.width() * film.height()];
            spread(source, &footprint, |cell| value(&taken[cell]), &mut image);
            let not_finite = &mut stats.not_finite;
            image
                .iter_mut()
                .for_each(|value| *value = finite(*value, not_finite));
            image
        };
        let values = image_of(&|taken| taken.value);
        let debiased = image_of(&|taken| taken.value - taken.bias);
        let sorted = if sorts {
            values.iter().copied().enumerate().collect()
        } else {
            Vec::new()
        };
        let layers = decomposition.map_or(Vec::new(), |decomposition| {
            let layers = decomposition.layers();
            let mut pending = Pending::new(values.len() * layers);
            for (cell, taken) in taken.iter().enumerate() {
                source.cells.each_pixel(&footprint, cell, |pixel, weight| {
                    for (layer, value) in &taken.layers {
                        pending.add(pixel * layers + layer, *value * weight);
                    }
                });
            }
            let mut placed = Vec::new();
            pending.take(|place, value| placed.push((place, value)));
            placed
        });
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
    cells: Range<usize>,
) -> (Vec<Taken>, Stats) {
    let mut ws = source.workspace();
    let mut pending = decomposition.map(|d| (d, Pending::new(d.layers())));
    let count = source.cells.pixels_among(cells.clone());
    let sample = source.image_sample(sample);
    let footprint = source.footprint(&sample);
    let taken = cells.map(|cell| {
        if !source.cells.counts(&footprint, cell) {
            return Taken::default();
        }
        let SampledRay {
            ray,
            weight,
            mut sampler,
            ..
        } = source.ray(cell, &sample);
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
    source.handle.count(count as u64);
    (taken, ws.stats())
}
