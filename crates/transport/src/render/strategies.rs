//! One image for each strategy of a bidirectional estimator: to see what each is good for, and to find
//! out which one is wrong if they disagree.

use super::source::{Source, add};
use super::splats::add_up;
use crate::film::Film;
use crate::integrator::Contribution;
use crate::scene::FilmSpec;
use std::collections::BTreeMap;

/// Strategies with more vertices than this from either end are not told apart from the last.
const MOST_VERTICES: u32 = 8;

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

/// Films of all strategies that have come up.
pub(super) struct Strategies {
    spec: FilmSpec,
    films: BTreeMap<(u32, u32), [Film; 2]>,
}

impl Strategies {
    pub fn new(spec: &FilmSpec) -> Self {
        Strategies {
            spec: *spec,
            films: BTreeMap::new(),
        }
    }

    /// Adds one sample of the whole image, the `sample`th.
    pub fn add<'a>(
        &mut self,
        source: &Source,
        sample: u64,
        contributions: impl Iterator<Item = &'a (usize, Contribution)>,
    ) {
        let mut sorted: BTreeMap<(u32, u32), Vec<(usize, Contribution)>> = BTreeMap::new();
        for (own, contribution) in contributions {
            let (s, t) = contribution.strategy;
            let key = (s.min(MOST_VERTICES), t.min(MOST_VERTICES));
            sorted.entry(key).or_default().push((*own, *contribution));
        }
        for key in sorted.keys() {
            let spec = self.spec;
            let empty = || Film::new(spec.width, spec.height, spec.channels);
            self.films.entry(*key).or_insert_with(|| [empty(), empty()]);
        }
        for (key, films) in &mut self.films {
            let found = sorted.get(key).map_or(&[][..], Vec::as_slice);
            let images = [
                add_up(source, found.iter(), Contribution::weighted),
                add_up(source, found.iter(), |c| c.value),
            ];
            for (film, image) in films.iter_mut().zip(images) {
                for (pixel, value) in film.group_mut(source.group).iter_mut().zip(image) {
                    // A strategy that first comes up now has found nothing in earlier samples.
                    pixel.count = sample;
                    add(pixel, value, &mut 0);
                }
            }
        }
    }

    pub fn into_images(self) -> Vec<StrategyImage> {
        let image = |((s, t), [weighted, unweighted]): ((u32, u32), [Film; 2])| StrategyImage {
            s,
            t,
            weighted,
            unweighted,
        };
        self.films.into_iter().map(image).collect()
    }
}
