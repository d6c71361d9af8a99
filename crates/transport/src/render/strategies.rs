//! One image for each strategy of a bidirectional estimator: to see what each is good for, and to find
//! out which one is wrong if they disagree.

use super::source::{Source, add};
use super::splats::splat;
use crate::Spectrum;
use crate::film::Film;
use crate::integrator::Contribution;
use crate::scene::FilmSpec;
use std::collections::BTreeMap;

/// Strategies with more vertices than this from either end are not told apart from the last.
pub(super) const MOST_VERTICES: u32 = 8;

/// What one strategy found.
#[derive(Clone, Debug)]
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

/// Films of all strategies that have come up, weighted and unweighted.
pub(super) struct Strategies {
    spec: FilmSpec,
    layers: BTreeMap<(u32, u32), [Layer; 2]>,
}

/// A film, and the sample of the whole image that is being added up.
struct Layer {
    film: Film,
    image: Vec<Spectrum>,
}

impl Layer {
    fn new(spec: &FilmSpec) -> Self {
        Layer {
            film: Film::in_groups(spec.width, spec.height, spec.channels, spec.lanes),
            image: vec![Spectrum::ZERO; spec.width * spec.height],
        }
    }

    /// Takes what was added up as the `sample`th sample of every pixel.
    fn finish(&mut self, group: usize, sample: u64) {
        for (pixel, value) in self.film.group_mut(group).iter_mut().zip(&mut self.image) {
            // A strategy that came up now for the first time had found nothing in earlier samples.
            pixel.count = sample;
            add(pixel, std::mem::take(value), &mut 0);
        }
    }
}

impl Strategies {
    pub fn new(spec: &FilmSpec) -> Self {
        Strategies {
            spec: *spec,
            layers: BTreeMap::new(),
        }
    }

    /// Adds contributions to a sample of the whole image.
    pub fn splat(&mut self, source: &Source, contributions: &[(usize, Contribution)]) {
        for (own, contribution) in contributions {
            let (s, t) = contribution.strategy;
            let key = (s.min(MOST_VERTICES), t.min(MOST_VERTICES));
            let new = || [Layer::new(&self.spec), Layer::new(&self.spec)];
            let layers = self.layers.entry(key).or_insert_with(new);
            let values = [contribution.weighted(), contribution.value];
            for (layer, value) in layers.iter_mut().zip(values) {
                splat(source, *own, contribution, |pixel, filter| {
                    layer.image[pixel] += value * filter;
                });
            }
        }
    }

    /// Ends the `sample`th sample of the whole image.
    pub fn finish(&mut self, source: &Source, sample: u64) {
        for layer in self.layers.values_mut().flatten() {
            layer.finish(source.group, sample);
        }
    }

    pub fn into_images(self) -> Vec<StrategyImage> {
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
