//! Sums that a film keeps for each layer of a decomposition (docs/theory.md#layers).

use super::{Decomposition, Pixel};
use crate::Spectrum;
use crate::moments::Moments;
use serde::{Deserialize, Serialize};

/// Layers of a film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layers {
    decomposition: Decomposition,
    groups: Vec<LayerGroup>,
}

/// Layers of one group of channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LayerGroup {
    decomposition: Decomposition,
    channels: usize,
    /// Sums by pixel, layer and channel; the channel varies fastest.
    cells: Vec<Moments>,
    /// Samples of each layer's mean over the image, if pixels are not independent.
    whole: Vec<Pixel>,
}

impl Layers {
    /// Creates empty layers. `channels` yields the number of channels of each group.
    pub(super) fn new(
        decomposition: Decomposition,
        pixels: usize,
        channels: impl Iterator<Item = usize>,
    ) -> Self {
        let groups = channels.map(|channels| LayerGroup::new(decomposition, pixels, channels));
        Layers {
            decomposition,
            groups: groups.collect(),
        }
    }

    /// Returns the criteria by which light is separated.
    pub fn decomposition(&self) -> &Decomposition {
        &self.decomposition
    }

    pub(super) fn group_mut(&mut self, group: usize) -> &mut LayerGroup {
        &mut self.groups[group]
    }

    /// Returns the sums of a pixel in a layer over its `count` samples.
    pub(super) fn pixel(&self, group: usize, pixel: usize, layer: usize, count: u64) -> Pixel {
        let group = &self.groups[group];
        let first = (pixel * self.decomposition.layers() + layer) * group.channels;
        Pixel::of(&group.cells[first..first + group.channels], count)
    }

    /// Returns true if the stored sums have the sizes that `decomposition`, `pixels` and `channels`
    /// imply.
    pub(super) fn fits(
        &self,
        decomposition: Decomposition,
        pixels: usize,
        channels: impl Iterator<Item = usize>,
    ) -> bool {
        let layers = decomposition.layers();
        let sizes = |g: &LayerGroup| (g.decomposition, [g.channels, g.cells.len(), g.whole.len()]);
        let wanted = channels.map(|c| (decomposition, [c, pixels * layers * c, layers]));
        self.decomposition == decomposition && self.groups.iter().map(sizes).eq(wanted)
    }

    /// Adds the samples of other layers with the same shape.
    pub(super) fn merge(&mut self, other: &Layers) {
        for (group, other) in self.groups.iter_mut().zip(&other.groups) {
            let cells = group.cells.iter_mut().zip(&other.cells);
            cells.for_each(|(cell, other)| *cell += *other);
            let whole = group.whole.iter_mut().zip(&other.whole);
            whole.for_each(|(pixel, other)| *pixel += *other);
        }
    }

    pub(super) fn whole(&self, group: usize, layer: usize) -> &Pixel {
        &self.groups[group].whole[layer]
    }
}

impl LayerGroup {
    fn new(decomposition: Decomposition, pixels: usize, channels: usize) -> Self {
        let layers = decomposition.layers();
        LayerGroup {
            decomposition,
            channels,
            cells: vec![Moments::default(); pixels * layers * channels],
            whole: vec![Pixel::default(); layers],
        }
    }

    /// Splits the cells into runs of `pixels` pixels.
    pub(super) fn chunks_mut(&mut self, pixels: usize) -> impl Iterator<Item = CellsMut<'_>> {
        let (layers, channels) = (self.decomposition.layers(), self.channels);
        let chunks = self.cells.chunks_mut(pixels * layers * channels);
        chunks.map(move |cells| CellsMut { channels, cells })
    }

    /// Records a sample of each layer's mean over all pixels: see
    /// [`Film::add_image`](super::Film::add_image).
    pub(super) fn add_whole(&mut self, means: impl IntoIterator<Item = Spectrum>) {
        for (whole, mean) in self.whole.iter_mut().zip(means) {
            whole.add(mean);
        }
    }
}

/// Cells of a run of pixels.
#[derive(Debug)]
pub(super) struct CellsMut<'a> {
    channels: usize,
    cells: &'a mut [Moments],
}

impl CellsMut<'_> {
    /// Adds a sample at `place`, which is pixel × number of layers + layer.
    pub(super) fn add(&mut self, place: usize, value: Spectrum) {
        let first = place * self.channels;
        let cells = &mut self.cells[first..first + self.channels];
        for (cell, v) in cells.iter_mut().zip(value.0) {
            cell.add(v);
        }
    }
}

/// Sample under construction: a sparse vector of values at places.
#[derive(Debug)]
pub(crate) struct Pending {
    values: Vec<Spectrum>,
    touched: Vec<usize>,
}

impl Pending {
    /// Creates a vector of `places` zeros.
    pub(crate) fn new(places: usize) -> Self {
        Pending {
            values: vec![Spectrum::ZERO; places],
            touched: Vec::new(),
        }
    }

    /// Adds a value at a place.
    pub(crate) fn add(&mut self, place: usize, value: Spectrum) {
        if self.values[place].is_zero() {
            self.touched.push(place);
        }
        self.values[place] += value;
    }

    /// Passes each non-zero value to `to`, in the order in which their places were first used, and
    /// clears them.
    pub(crate) fn take(&mut self, mut to: impl FnMut(usize, Spectrum)) {
        for place in self.touched.drain(..) {
            let value = std::mem::take(&mut self.values[place]);
            if !value.is_zero() {
                to(place, value);
            }
        }
    }
}
