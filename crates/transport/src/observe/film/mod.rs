//! Films: sums of samples per pixel (docs/theory.md#film).

mod cells;
mod decomposition;
mod filter;
mod footprint;
mod layers;
mod outliers;
mod pixels;
mod scores;
mod signed_filter;
mod spec;
mod summary;

pub(crate) use cells::Cells;
pub use decomposition::{Decomposition, LayerAxis, LightParts, PartsFacts, PathFacts};
pub use filter::Filter;
pub(crate) use footprint::Footprint;
pub use layers::Layers;
pub(crate) use layers::Pending;
pub use outliers::OutlierRejection;
pub use pixels::Pixel;
pub(crate) use pixels::bytes_of_pixel;
pub(crate) use scores::{PlacedValue, Scores};
pub use signed_filter::SignedFilter;
pub use spec::{FilmSpec, FilmWindow};

use crate::Spectrum;
use crate::sampling::Replicates;
use pixels::GroupSums;
use serde::{Deserialize, Serialize};

/// Accumulated image: `width × height` pixels from the top left. Its channels are kept in groups of
/// at most [`Spectrum::CHANNELS`].
///
/// Samples are drawn in proportion to the filter's value. Every pixel is therefore a plain mean of
/// independent samples, or replicates, with an unbiased estimate of its variance. For filters with
/// negative lobes, samples are drawn in proportion to the filter's modulus and weighted by its
/// sign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Film {
    shape: FilmShape,
    groups: Vec<GroupSums>,
    layers: Option<Layers>,
    /// Samples by brightness for each group, if rare bright samples receive less weight.
    outliers: Option<Vec<OutlierRejection>>,
}

/// Size of a film, and the quantities that it keeps per pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FilmShape {
    pub width: usize,
    pub height: usize,
    pub channels: usize,
    /// Channels per group, at most [`Spectrum::CHANNELS`].
    pub group_size: usize,
    /// Kind of replicates to which samples belong.
    pub replicates: Replicates,
    /// Criteria that separate light into layers.
    pub decomposition: Decomposition,
    /// True if samples are sorted by brightness for [`OutlierRejection`].
    pub sorts: bool,
    /// If the samples of different cells are independent: variance of a pixel over the variance of
    /// the samples of cells (see [`Cells::noise`]). `None` if pixels share paths.
    pub noise: Option<f64>,
}

impl FilmShape {
    /// Creates the shape of a film without layers and with independent samples.
    pub(crate) fn plain([width, height]: [usize; 2], channels: usize, group_size: usize) -> Self {
        FilmShape {
            width,
            height,
            channels,
            group_size,
            replicates: Replicates::default(),
            decomposition: Decomposition::default(),
            sorts: false,
            noise: None,
        }
    }

    /// Creates the shape of a plain film for the light of a scene.
    pub(crate) fn of_light(spec: &FilmSpec) -> Self {
        Self::plain([spec.width, spec.height], spec.channels, spec.group_size)
    }

    fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Returns the number of channels of a group.
    fn channels_of(&self, group: usize) -> usize {
        (self.channels - group * self.group_size).min(self.group_size)
    }

    /// Returns the number of channels of each group.
    fn groups(&self) -> impl Iterator<Item = usize> {
        (0..self.channels.div_ceil(self.group_size)).map(|group| self.channels_of(group))
    }
}

impl Film {
    /// Creates an empty film with as few channel groups as possible; no argument may be zero.
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        let size = [width, height];
        Self::of(FilmShape::plain(size, channels, Spectrum::CHANNELS))
    }

    /// Creates an empty film; no size may be zero.
    pub(crate) fn of(shape: FilmShape) -> Self {
        let pixels = shape.pixels();
        let layers = || Layers::new(shape.decomposition, pixels, shape.groups());
        let outliers = || shape.groups().map(|c| OutlierRejection::new(pixels, c));
        Film {
            groups: shape.groups().map(|c| GroupSums::new(pixels, c)).collect(),
            layers: shape.decomposition.is_some().then(layers),
            outliers: shape.sorts.then(|| outliers().collect()),
            shape,
        }
    }

    /// Returns the kind of replicates to which the samples of pixels belong.
    pub fn replicates(&self) -> Replicates {
        self.shape.replicates
    }

    /// Returns the size of the film, and the quantities that it keeps per pixel.
    pub(crate) fn shape(&self) -> FilmShape {
        self.shape
    }

    /// Returns true if another film keeps the same quantities for the same number of pixels.
    pub fn is_like(&self, other: &Film) -> bool {
        self.fits(&other.shape) && other.fits(&self.shape)
    }

    /// Returns true if the film has this shape, and sums of the sizes that the shape implies. A
    /// film that was read from a file may violate this.
    pub(crate) fn fits(&self, shape: &FilmShape) -> bool {
        let (pixels, channels) = (shape.pixels(), || shape.groups());
        self.shape == *shape
            && (self.groups.iter().map(GroupSums::size))
                .eq(channels().map(|c| GroupSums::sized(pixels, c)))
            && match &self.layers {
                Some(layers) => layers.fits(shape.decomposition, pixels, channels()),
                None => !shape.decomposition.is_some(),
            }
            && match &self.outliers {
                Some(outliers) => {
                    let sizes = channels().map(|c| OutlierRejection::sized(pixels, c));
                    shape.sorts && outliers.iter().map(OutlierRejection::size).eq(sizes)
                }
                None => !shape.sorts,
            }
    }

    /// Adds the samples of another film of [equal shape](Film::is_like).
    pub fn merge(&mut self, other: &Film) {
        let groups = self.groups.iter_mut().zip(&other.groups);
        groups.for_each(|(group, other)| group.merge(other));
        if let (Some(layers), Some(other)) = (&mut self.layers, &other.layers) {
            layers.merge(other);
        }
        if let (Some(outliers), Some(other)) = (&mut self.outliers, &other.outliers) {
            let pairs = outliers.iter_mut().zip(other);
            pairs.for_each(|(outliers, other)| outliers.merge(other));
        }
    }

    /// Returns the width in pixels.
    pub fn width(&self) -> usize {
        self.shape.width
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> usize {
        self.shape.height
    }

    /// Returns the number of spectral channels.
    pub fn channels(&self) -> usize {
        self.shape.channels
    }

    /// Returns the number of channel groups.
    pub fn groups(&self) -> usize {
        self.groups.len()
    }

    /// Returns the sums of all pixels of a group, row by row.
    pub fn pixels(&self, group: usize) -> impl ExactSizeIterator<Item = Pixel> {
        (0..self.shape.width * self.shape.height).map(move |i| self.pixel(group, i, None))
    }

    /// Adds one sample of a pixel, for one group of channels.
    pub fn add(&mut self, group: usize, pixel: usize, value: Spectrum) {
        self.groups[group].all_mut().add(pixel, value);
    }

    /// Returns means with less weight for rare bright samples, in the layout of [`Film::mean`], or
    /// `None` if the film does not sort samples. These means are biased: see [`OutlierRejection`].
    pub fn reweighted(&self) -> Option<Vec<f32>> {
        let outliers = self.outliers.as_ref()?.iter();
        let samples = self.count(0);
        let groups: Vec<_> = outliers
            .map(|c| c.reweighted(self.shape.width, samples))
            .collect();
        let pixel = |i: usize| {
            let values = groups.iter().enumerate();
            let values = values.flat_map(move |(g, group)| &group[i].0[..self.channels_of(g)]);
            values.map(|v| *v as f32)
        };
        Some(
            (0..self.shape.width * self.shape.height)
                .flat_map(pixel)
                .collect(),
        )
    }

    /// Layers, if the film separates light.
    pub fn layers(&self) -> Option<&Layers> {
        self.layers.as_ref()
    }

    /// Returns the samples of a group by brightness, if the film sorts them.
    pub fn outliers(&self, group: usize) -> Option<&OutlierRejection> {
        Some(&self.outliers.as_ref()?[group])
    }

    /// Sets the number of samples of every pixel to `samples`, a multiple of the replicate size.
    /// Samples that were not added count as zero.
    pub(crate) fn fill_up(&mut self, samples: u64) {
        let count = samples / self.shape.replicates.size();
        self.groups
            .iter_mut()
            .for_each(|group| group.fill_up(count));
    }

    /// Returns the sums of a pixel of a group, in one layer or in all layers.
    pub(crate) fn pixel(&self, group: usize, i: usize, layer: Option<usize>) -> Pixel {
        let all = &self.groups[group];
        match (layer, &self.layers) {
            (Some(layer), Some(layers)) => layers.pixel(group, i, layer, all.count(i)),
            _ => all.pixel(i),
        }
    }

    /// Returns the mean of a channel of a pixel, in one layer or in all layers: see [`Film::mean`]
    /// and [`Film::layer_mean`].
    pub fn mean_at(&self, layer: Option<usize>, channel: usize, pixel: usize) -> f32 {
        let (group, offset) = (
            channel / self.shape.group_size,
            channel % self.shape.group_size,
        );
        self.pixel(group, pixel, layer).mean_of(offset) as f32
    }

    /// Returns the variance of [`Film::mean_at`].
    pub fn variance_at(&self, layer: Option<usize>, channel: usize, pixel: usize) -> f32 {
        let (group, offset) = (
            channel / self.shape.group_size,
            channel % self.shape.group_size,
        );
        self.pixel(group, pixel, layer).variance_of(offset) as f32
    }

    /// Returns the mean square of the samples of a channel of a pixel: their second moment. For
    /// [replicates](Replicates), the mean square of their means.
    pub fn second_moment_at(&self, channel: usize, pixel: usize) -> f32 {
        let (group, offset) = (
            channel / self.shape.group_size,
            channel % self.shape.group_size,
        );
        let pixel = self.pixel(group, pixel, None);
        pixel.moments[offset].mean_square(pixel.count) as f32
    }

    /// Returns the effective number of samples of a pixel: see
    /// [`Moments::effective`](crate::moments::Moments::effective). Each [replicate](Replicates)
    /// counts as one sample.
    pub fn effective_at(&self, layer: Option<usize>, channel: usize, pixel: usize) -> f32 {
        let (group, offset) = (
            channel / self.shape.group_size,
            channel % self.shape.group_size,
        );
        self.pixel(group, pixel, layer).moments[offset].effective() as f32
    }

    /// Returns true if [`Film::variance_at`] is unreliable: see
    /// [`Moments::few`](crate::moments::Moments::few).
    pub fn few_at(&self, layer: Option<usize>, channel: usize, pixel: usize) -> bool {
        let (group, offset) = (
            channel / self.shape.group_size,
            channel % self.shape.group_size,
        );
        self.pixel(group, pixel, layer).moments[offset].few()
    }

    /// Evaluates a quantity at every channel and pixel, row by row with channels interleaved.
    fn plane<T>(&self, quantity: impl Fn(usize, usize) -> T) -> Vec<T> {
        let quantity = &quantity;
        let pixel = |pixel| (0..self.shape.channels).map(move |channel| quantity(channel, pixel));
        let mut out =
            Vec::with_capacity(self.shape.width * self.shape.height * self.shape.channels);
        out.extend((0..self.shape.width * self.shape.height).flat_map(pixel));
        out
    }

    /// Means, row by row with channels interleaved.
    pub fn mean(&self) -> Vec<f32> {
        self.plane(|c, i| self.mean_at(None, c, i))
    }

    /// Returns the variances of the means, in the layout of [`Film::mean`].
    pub fn variance(&self) -> Vec<f32> {
        self.plane(|c, i| self.variance_at(None, c, i))
    }

    /// Returns the effective numbers of samples of a layer, or of all light, in the layout of
    /// [`Film::mean`]: see [`Film::effective_at`].
    pub fn effective(&self, layer: Option<usize>) -> Vec<f32> {
        self.plane(|c, i| self.effective_at(layer, c, i))
    }

    /// Returns true wherever the variance of a layer, or of all light, is unreliable, in the layout
    /// of [`Film::mean`]: see [`Film::few_at`].
    pub fn few(&self, layer: Option<usize>) -> Vec<bool> {
        self.plane(|c, i| self.few_at(layer, c, i))
    }

    /// Returns the means of a layer, in the layout of [`Film::mean`]. The layers add up to the
    /// image, if [parts](LightParts) other than the light itself are left out.
    /// [`Decomposition::slots`] describes the numbers of layers.
    pub fn layer_mean(&self, layer: usize) -> Vec<f32> {
        self.plane(|c, i| self.mean_at(Some(layer), c, i))
    }

    /// Returns the variances of the means of a layer, in the layout of [`Film::mean`].
    pub fn layer_variance(&self, layer: usize) -> Vec<f32> {
        self.plane(|c, i| self.variance_at(Some(layer), c, i))
    }

    /// Returns the number of samples of a pixel.
    pub fn count(&self, pixel: usize) -> u64 {
        self.groups[0].count(pixel) * self.shape.replicates.size()
    }

    /// Returns the number of samples of each pixel, row by row.
    pub fn counts(&self) -> Vec<u64> {
        let pixels = 0..self.shape.width * self.shape.height;
        pixels.map(|pixel| self.count(pixel)).collect()
    }

    /// Returns the smallest and largest number of samples of a pixel.
    pub fn least_and_most(&self) -> [u64; 2] {
        let counts = self.counts();
        let [least, most] = [counts.iter().min(), counts.iter().max()];
        [least, most].map(|count| count.copied().unwrap_or(0))
    }

    /// Returns the total number of samples over all pixels and groups.
    pub fn samples(&self) -> u64 {
        let replicates: u64 = self.groups.iter().map(GroupSums::samples).sum();
        replicates * self.shape.replicates.size()
    }

    /// Returns the number of channels of a group.
    pub(crate) fn channels_of(&self, group: usize) -> usize {
        self.shape.channels_of(group)
    }
}
