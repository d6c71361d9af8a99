//! One image for each strategy of a bidirectional estimator: to see what each is good for, and to find
//! out which one is wrong if they disagree.

use super::source::{Source, finite};
use super::splats::splat;
use crate::Spectrum;
use crate::film::{Film, FilmShape, Scores};
use crate::integrator::Contribution;
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

/// Numbers of vertices from the emitter and from the sensor.
type Strategy = (u32, u32);

/// Films of all strategies that have come up, weighted and unweighted. Numbers of samples are those of the render: a
/// strategy had found nothing in samples in which it did not come up.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Strategies {
    films: BTreeMap<Strategy, [Film; 2]>,
}

/// A sample of the whole image, or the mean of a replicate, by each strategy that comes up in it: weighted and unweighted.
#[derive(Debug, Default)]
pub(super) struct StrategyScores(BTreeMap<Strategy, [Vec<Spectrum>; 2]>);

impl StrategyScores {
    /// Adds a share of contributions.
    pub(super) fn splat(
        &mut self,
        source: &Source,
        contributions: &[(usize, Contribution)],
        share: f64,
    ) {
        let spec = source.scene.film();
        for (own, contribution) in contributions {
            let (s, t) = contribution.strategy;
            let key = (s.min(MOST_VERTICES), t.min(MOST_VERTICES));
            let new = || [(); 2].map(|()| vec![Spectrum::ZERO; spec.width * spec.height]);
            let images = self.0.entry(key).or_insert_with(new);
            let values = [contribution.weighted(), contribution.value];
            for (image, value) in images.iter_mut().zip(values) {
                splat(source, *own, contribution.image, |pixel, filter| {
                    image[pixel] += value * (filter * share);
                });
            }
        }
    }
}

impl Strategies {
    /// All films.
    pub(super) fn films(&self) -> impl Iterator<Item = &Film> {
        self.films.values().flatten()
    }

    /// Adds the samples of others.
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

    /// The images of so many samples per pixel.
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
