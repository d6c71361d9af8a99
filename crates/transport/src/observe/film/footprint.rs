//! Pixels to which light at a point of the film contributes (docs/theory.md#film).

use super::Filter;
use smallvec::SmallVec;

/// Pixels around a point of the film, with their weights by the reconstruction filter.
///
/// The weights of all pixels, within the film and beyond, add up to one.
#[derive(Clone, Debug)]
pub(crate) struct Footprint {
    columns: Taps,
    rows: Taps,
}

/// Weights of consecutive pixels along one axis.
#[derive(Clone, Debug)]
struct Taps {
    first: i64,
    weights: SmallVec<[f64; 8]>,
}

/// Distance from the film, in pixels, beyond which a point contributes to no pixel. It is far
/// larger than any film, and keeps the numbers of pixels in the range of `i64`.
const MAX_DISTANCE: f64 = 1e9;

impl Taps {
    fn at(filter: &Filter, position: f64) -> Self {
        // False for a position that is not a number, too.
        let is_near = position.abs() < MAX_DISTANCE;
        let (first, end) = if is_near {
            let nearest = position - 0.5;
            let radius = filter.radius();
            let first = (nearest - radius).ceil() as i64;
            (first, (nearest + radius).floor() as i64 + 1)
        } else {
            (0, 0)
        };
        let value = |pixel: i64| filter.value(position - (pixel as f64 + 0.5));
        let mut weights: SmallVec<[f64; 8]> = (first..end).map(value).collect();
        let sum: f64 = weights.iter().sum();
        if sum != 0.0 {
            // Planted error "weights of pixels that do not add up to one", found by morgana-transport/transport::reconstruction::an_even_sky_stays_even:
            // weights.iter_mut().for_each(|weight| *weight /= sum.signum());
            weights.iter_mut().for_each(|weight| *weight /= sum);
        }
        Taps { first, weights }
    }

    /// Returns the pixels from 0 to below `size` with their weights; `offset` is added to their
    /// numbers.
    fn within(&self, size: usize, offset: i64) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let pixels = self.first + offset..;
        let inside = pixels.zip(&self.weights);
        inside.filter_map(move |(pixel, weight)| {
            let pixel = usize::try_from(pixel).ok()?;
            (pixel < size && *weight != 0.0).then_some((pixel, *weight))
        })
    }
}

impl Footprint {
    /// Returns the weights at a position in pixels from the film's top left corner.
    pub(crate) fn at(filter: &Filter, [x, y]: [f64; 2]) -> Self {
        Footprint {
            columns: Taps::at(filter, x),
            rows: Taps::at(filter, y),
        }
    }

    /// Moves the point by whole pixels, and calls `count` with each pixel of a `width × height`
    /// film whose weight is not zero, and with its weight.
    pub(crate) fn each(
        &self,
        [width, height]: [usize; 2],
        [across, down]: [i64; 2],
        mut count: impl FnMut(usize, f64),
    ) {
        for (row, vertical) in self.rows.within(height, down) {
            for (column, horizontal) in self.columns.within(width, across) {
                count(row * width + column, vertical * horizontal);
            }
        }
    }

    /// Returns true if a pixel of a film has weight: see [`Footprint::each`].
    pub(crate) fn reaches(&self, [width, height]: [usize; 2], [across, down]: [i64; 2]) -> bool {
        let columns = self.columns.within(width, across).next();
        columns.and(self.rows.within(height, down).next()).is_some()
    }

    /// Returns the weights along both axes, each with the pixel of the first weight.
    pub(crate) fn axes(&self) -> [(i64, &[f64]); 2] {
        [&self.columns, &self.rows].map(|taps| (taps.first, taps.weights.as_slice()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::SignedFilter;
    use super::*;

    /// Returns `place` in units of the image.
    fn pixels(size: [usize; 2], filter: Filter, place: [f64; 2]) -> Vec<(usize, f64)> {
        let mut found = Vec::new();
        let place = [0, 1].map(|axis| place[axis] * size[axis] as f64);
        Footprint::at(&filter, place).each(size, [0, 0], |pixel, weight| {
            found.push((pixel, weight));
        });
        found
    }

    #[test]
    fn a_box_is_one_pixel() {
        let at = |s, t| pixels([4, 2], Filter::Box, [s, t]);
        assert_eq!(at(0.0, 0.0), [(0, 1.0)]);
        assert_eq!(at(0.25, 0.0), [(1, 1.0)]);
        assert_eq!(at(0.999, 0.999), [(7, 1.0)]);
        for outside in [-1e-9, 1.0, 1e300, f64::NAN, f64::INFINITY] {
            assert_eq!(at(outside, 0.5), []);
        }
    }

    /// Weights at any point add up to one, with every filter, narrow ones included.
    #[test]
    fn weights_add_up_to_one() {
        let filters = [
            Filter::Box,
            Filter::Tent { radius: 0.7 },
            Filter::Tent { radius: 1.0 },
            Filter::Gaussian { stddev: 0.3 },
            Filter::Gaussian { stddev: 0.5 },
            Filter::Signed(SignedFilter::cubic(1.0 / 3.0, 1.0 / 3.0)),
            Filter::Signed(SignedFilter::lanczos(3)),
        ];
        for filter in filters {
            for i in 0..100 {
                let place = [i, 37 * i].map(|i| (30.0 + 0.05 * f64::from(i % 40)) / 64.0);
                let sum: f64 = pixels([64, 64], filter, place).iter().map(|p| p.1).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{filter:?} at {place:?}: {sum}");
            }
        }
        let beyond = pixels(
            [64, 64],
            Filter::Gaussian { stddev: 0.5 },
            [-0.5 / 64.0, 0.5],
        );
        assert!(!beyond.is_empty());
    }
}
