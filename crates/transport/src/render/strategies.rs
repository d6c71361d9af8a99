//! Images of the strategies of a bidirectional estimator. The images show for which light each
//! strategy is good, and which one is wrong if they disagree.

use super::source::{Source, finite};
use super::splats::{Place, splat};
use crate::Spectrum;
use crate::film::{Film, FilmShape, Footprint, Scores};
use crate::integrator::Contribution;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Maximum number of vertices from either end that are distinguished. Strategies with more vertices
/// share the last image.
pub(super) const MAX_VERTICES: u32 = 8;

/// Image of one strategy.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StrategyImage {
    /// Number of vertices from the emitter, including the point on the emitter.
    pub s: u32,
    /// Number of vertices from the sensor, including the point on the sensor.
    pub t: u32,
    /// Contribution of the strategy to the image; these films of all strategies add up to the
    /// image.
    pub weighted: Film,
    /// Light that the strategy finds without the others: the light of all paths that it can sample.
    pub unweighted: Film,
}

/// Numbers of vertices from the emitter and from the sensor.
type Strategy = (u32, u32);

/// Films of all strategies that have found light, weighted and unweighted. The render counts the
/// samples. A strategy without an entry found no light in these samples.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Strategies {
    films: BTreeMap<Strategy, [Film; 2]>,
}

/// Sample of the whole image, or the mean of a replicate, for each strategy that found light in it:
/// weighted and unweighted.
#[derive(Debug, Default)]
pub(super) struct StrategyScores(BTreeMap<Strategy, [Vec<Spectrum>; 2]>);

impl StrategyScores {
    /// Adds contributions with a footprint, times `share`.
    pub(super) fn splat(
        &mut self,
        source: &Source,
        footprint: &Footprint,
        contributions: &[(usize, Contribution)],
        share: f64,
    ) {
        let spec = source.scene.film();
        for (own, contribution) in contributions {
            let (s, t) = contribution.strategy;
            let key = (s.min(MAX_VERTICES), t.min(MAX_VERTICES));
            let new = || [(); 2].map(|()| vec![Spectrum::ZERO; spec.width * spec.height]);
            let images = self.0.entry(key).or_insert_with(new);
            let values = [contribution.weighted(), contribution.value];
            for (image, value) in images.iter_mut().zip(values) {
                let place = Place::of(*own, contribution.image);
                splat(source, footprint, place, |pixel, filter| {
                    image[pixel] += value * (filter * share);
                });
            }
        }
    }
}

impl Strategies {
    /// Returns all films.
    pub(super) fn films(&self) -> impl Iterator<Item = &Film> {
        self.films.values().flatten()
    }

    /// Adds the samples of other images of strategies.
    pub(super) fn merge(&mut self, other: &Strategies) {
        for (strategy, films) in &other.films {
            match self.films.get_mut(strategy) {
                None => _ = self.films.insert(*strategy, films.clone()),
                Some(kept) => {
                    let pairs = kept.iter_mut().zip(films);
                    pairs.for_each(|(kept, film)| kept.merge(film));
                }
            }
        }
    }

    /// Adds a sample of the whole image, or the mean of a replicate.
    pub(super) fn add(&mut self, source: &Source, scores: StrategyScores) {
        let spec = source.scene.film();
        let shape = FilmShape {
            replicates: source.replicates,
            ..FilmShape::of_light(spec)
        };
        for (strategy, images) in scores.0 {
            let films = self.films.entry(strategy);
            let films = films.or_insert_with(|| [(); 2].map(|()| Film::of(shape)));
            for (film, mut image) in films.iter_mut().zip(images) {
                image.iter_mut().for_each(|v| *v = finite(*v, &mut 0));
                let scores = Scores::of_image(image, Vec::new(), Vec::new());
                film.add_scores(source.group, spec.width * spec.height, vec![scores]);
            }
        }
    }

    /// Returns the images of `samples` samples per pixel.
    pub(crate) fn into_images(mut self, samples: u64) -> Vec<StrategyImage> {
        for film in self.films.values_mut().flatten() {
            film.fill_up(samples);
        }
        let films = self.films.into_iter();
        films
            .map(|((s, t), [weighted, unweighted])| StrategyImage {
                s,
                t,
                weighted,
                unweighted,
            })
            .collect()
    }
}
