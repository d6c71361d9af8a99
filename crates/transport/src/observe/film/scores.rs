//! Scores of a pass, kept until the pass is complete: an aborted pass leaves the film unchanged.

use super::Film;
use super::layers::CellsMut;
use super::outliers::LevelsMut;
use super::pixels::PixelsMut;
use crate::Spectrum;
use rayon::prelude::*;

/// Scores of a run of pixels, for one group of channels.
#[derive(Debug, Default)]
pub(crate) struct Scores {
    /// Number of scores of each pixel.
    counts: Vec<u32>,
    /// Scores, pixel by pixel.
    values: Vec<Spectrum>,
    /// Non-zero scores of layers, each with its place: pixel × number of layers + layer.
    layers: Vec<PlacedValue>,
    /// Single samples with their pixels, if samples are sorted by brightness.
    samples: Vec<PlacedValue>,
}

/// Value with its place in a larger array.
pub(crate) type PlacedValue = (usize, Spectrum);

impl Scores {
    /// Bytes per score of a pixel.
    pub(crate) const BYTES: usize = size_of::<u32>() + size_of::<Spectrum>();
    /// Bytes per score of a layer, and per sample that is sorted by brightness.
    pub(crate) const PLACED_BYTES: usize = size_of::<PlacedValue>();

    /// Creates empty scores with room for `scores` scores of `pixels` pixels.
    pub(crate) fn with_capacity(pixels: usize, scores: usize) -> Self {
        Scores {
            counts: Vec::with_capacity(pixels),
            values: Vec::with_capacity(scores),
            ..Scores::default()
        }
    }

    /// Creates scores from one value per pixel, scores of layers with their places, and single
    /// samples with their pixels.
    pub(crate) fn of_image(
        values: Vec<Spectrum>,
        layers: Vec<PlacedValue>,
        samples: Vec<PlacedValue>,
    ) -> Self {
        Scores {
            counts: vec![1; values.len()],
            values,
            layers,
            samples,
        }
    }

    /// Begins the next pixel.
    pub(crate) fn begin_pixel(&mut self) {
        self.counts.push(0);
    }

    /// Adds a score of the current pixel.
    pub(crate) fn add(&mut self, value: Spectrum) {
        self.values.push(value);
        if let Some(count) = self.counts.last_mut() {
            *count += 1;
        }
    }

    /// Adds a score of a layer; `place` is pixel × number of layers + layer.
    pub(crate) fn add_to_layer(&mut self, place: usize, value: Spectrum) {
        self.layers.push((place, value));
    }

    /// Adds a sample that will be sorted by brightness.
    pub(crate) fn add_sample(&mut self, pixel: usize, value: Spectrum) {
        self.samples.push((pixel, value));
    }

    /// Frees unused memory.
    pub(crate) fn shrink(&mut self) {
        self.values.shrink_to_fit();
        self.layers.shrink_to_fit();
        self.samples.shrink_to_fit();
    }
}

/// Run of pixels of a film to which scores are added.
struct RunMut<'a> {
    pixels: PixelsMut<'a>,
    layers: Option<CellsMut<'a>>,
    levels: Option<LevelsMut<'a>>,
}

impl RunMut<'_> {
    fn add(&mut self, scores: &Scores) {
        let counts = scores.counts.iter().enumerate();
        let pixels = counts.flat_map(|(pixel, count)| (0..*count).map(move |_| pixel));
        for (pixel, value) in pixels.zip(&scores.values) {
            self.pixels.add(pixel, *value);
        }
        if let Some(layers) = &mut self.layers {
            for (place, value) in &scores.layers {
                layers.add(*place, *value);
            }
        }
        if let Some(levels) = &mut self.levels {
            for (pixel, value) in &scores.samples {
                levels.add(*pixel, *value);
            }
        }
    }
}

impl Film {
    /// Adds scores to all pixels of a group. Each element of `scores` covers `run` pixels.
    pub(crate) fn add_scores(&mut self, group: usize, run: usize, scores: Vec<Scores>) {
        let mut layers = self.layers.as_mut();
        let mut layers = layers.as_mut().map(|l| l.group_mut(group).chunks_mut(run));
        let mut outliers = self.outliers.as_mut();
        let mut levels = outliers.as_mut().map(|o| o[group].chunks_mut(run));
        let runs = self.groups[group].chunks_mut(run).zip(scores);
        let runs = runs.map(|(pixels, scores)| {
            let run = RunMut {
                pixels,
                layers: layers.as_mut().and_then(Iterator::next),
                levels: levels.as_mut().and_then(Iterator::next),
            };
            (run, scores)
        });
        let runs: Vec<(RunMut, Scores)> = runs.collect();
        let runs = runs.into_par_iter();
        runs.for_each(|(mut run, scores)| run.add(&scores));
    }

    /// Adds one score of each pixel of a group, and records their mean over the image. The mean is
    /// needed where one path contributes to many pixels: the error of the image's mean then does
    /// not follow from the errors of pixels.
    pub(crate) fn add_image(&mut self, group: usize, scores: Scores) {
        let pixels = self.shape.width * self.shape.height;
        let sum = scores.values.iter().fold(Spectrum::ZERO, |sum, v| sum + *v);
        self.groups[group].whole.add(sum / pixels as f64);
        if let Some(layers) = &mut self.layers {
            let mut sums = vec![Spectrum::ZERO; layers.decomposition().layers()];
            for (place, value) in &scores.layers {
                sums[place % layers.decomposition().layers()] += *value;
            }
            let means = sums.into_iter().map(|sum| sum / pixels as f64);
            layers.group_mut(group).add_whole(means);
        }
        self.add_scores(group, pixels, vec![scores]);
    }
}
