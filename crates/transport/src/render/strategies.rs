//! One image for each strategy of a bidirectional estimator: to see what each is good for, and to find
//! out which one is wrong if they disagree.

use super::source::{Source, add};
use super::splats::splat;
use crate::Spectrum;
use crate::film::Film;
use crate::integrator::Contribution;
use crate::sampling::Replicates;
use crate::scene::FilmSpec;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Strategies with more vertices than this from either end are not told apart from the last.
pub(super) const MOST_VERTICES: u32 = 8;

/// What one strategy found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StrategyImage {
    /// Number of vertices from the emitter, its own point included.
    pub s: u32,
    /// Number of vertices from the sensor, its own point included.
    pub t: u32,
    /// Its share of the image: these films add up to the image.
    pub weighted: Film,
    /// What it finds on its own: the light of all paths that it can sample.
    pub unweighted: Film,
}

/// Films of all strategies that have come up, weighted and unweighted. Numbers of samples are those of the render: a
/// strategy that comes up late had found nothing in earlier samples.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Strategies {
    layers: BTreeMap<(u32, u32), [Layer; 2]>,
}

/// A film, and the sample of the whole image that is being added up.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Layer {
    film: Film,
    /// Empty between passes.
    #[serde(skip)]
    image: Vec<Spectrum>,
}

impl Layer {
    fn new(spec: &FilmSpec, replicates: Replicates) -> Self {
        let film = Film::in_groups(spec.width, spec.height, spec.channels, spec.group_size);
        Layer {
            film: film.in_replicates(replicates),
            image: Vec::new(),
        }
    }

    /// Adds a value to the sample of a pixel.
    fn add(&mut self, pixel: usize, value: Spectrum) {
        let pixels = self.film.width() * self.film.height();
        self.image.resize(pixels, Spectrum::ZERO);
        self.image[pixel] += value;
    }

    /// Takes what was added up as a sample of every pixel, or as the mean of a replicate.
    fn finish(&mut self, group: usize) {
        for (pixel, value) in self.film.group_mut(group).iter_mut().zip(&mut self.image) {
            add(pixel, std::mem::take(value), &mut 0);
        }
    }
}

impl Strategies {
    /// All films.
    pub(super) fn films(&self) -> impl Iterator<Item = &Film> {
        self.layers.values().flatten().map(|layer| &layer.film)
    }

    /// Adds the samples of others.
    pub(super) fn merge(&mut self, other: &Strategies) {
        for (strategy, layers) in &other.layers {
            match self.layers.get_mut(strategy) {
                None => _ = self.layers.insert(*strategy, layers.clone()),
                Some(kept) => {
                    let pairs = kept.iter_mut().zip(layers);
                    pairs.for_each(|(kept, layer)| kept.film.merge(&layer.film));
                }
            }
        }
    }

    /// Adds a share of contributions to a sample of the whole image.
    pub(super) fn splat(
        &mut self,
        source: &Source,
        contributions: &[(usize, Contribution)],
        share: f64,
    ) {
        for (own, contribution) in contributions {
            let (s, t) = contribution.strategy;
            let key = (s.min(MOST_VERTICES), t.min(MOST_VERTICES));
            let new = || [(); 2].map(|()| Layer::new(source.scene.film(), source.replicates));
            let layers = self.layers.entry(key).or_insert_with(new);
            let values = [contribution.weighted(), contribution.value];
            for (layer, value) in layers.iter_mut().zip(values) {
                splat(source, *own, contribution, |pixel, filter| {
                    layer.add(pixel, value * (filter * share));
                });
            }
        }
    }

    /// Ends a sample of the whole image.
    pub(super) fn finish(&mut self, source: &Source) {
        for layer in self.layers.values_mut().flatten() {
            layer.finish(source.group);
        }
    }

    /// The images of so many samples per pixel.
    pub(crate) fn into_images(mut self, samples: u64) -> Vec<StrategyImage> {
        for layer in self.layers.values_mut().flatten() {
            layer.film.fill_up(samples);
        }
        let layers = self.layers.into_iter();
        layers
            .map(|((s, t), [weighted, unweighted])| StrategyImage {
                s,
                t,
                weighted: weighted.film,
                unweighted: unweighted.film,
            })
            .collect()
    }
}
