//! Points of a film at which samples are taken (docs/theory.md#film).

use super::{FilmSpec, Filter, Footprint};
use crate::sampling::PiecewiseLinear;

/// Cells of a film: its pixels, and a margin as wide as the reconstruction filter. A sample of the
/// image has one point in each cell.
///
/// The points of one sample have equal positions within their cells. Each pixel therefore receives
/// equal weights, which add up to one: an even image stays even. The density of the position is the
/// sum of the filters of all pixels. The mean of all samples of a pixel is therefore the filtered
/// image.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    film: [usize; 2],
    /// Number of cells beyond the film on each side.
    margin: usize,
    /// Density of the place in a cell along each axis; `None` if it is uniform.
    places: Option<PiecewiseLinear>,
    filter: Filter,
    /// True if each sample contributes to its own pixel only.
    are_apart: bool,
}

/// Intervals of a cell between which the density of places is linear.
const INTERVALS: usize = 256;
/// Places in a cell along an axis over which squares of weights are averaged.
const NOISE_PLACES: u32 = 32;
/// Largest deviation from one of a density that counts as uniform: the rounding of filters whose
/// values at all pixels add up to one.
const ROUNDING: f64 = 1e-12;

impl Cells {
    /// Returns the cells of a film.
    pub(crate) fn of(spec: &FilmSpec) -> Self {
        Cells {
            film: [spec.width, spec.height],
            margin: (spec.filter.radius() - 0.5).ceil() as usize,
            places: places(&spec.filter),
            filter: spec.filter,
            are_apart: false,
        }
    }

    /// Returns the cells of a film whose samples contribute to their own pixels only. Points have
    /// the density of the filter around the pixel's centre.
    pub(crate) fn apart(spec: &FilmSpec) -> Self {
        Cells {
            film: [spec.width, spec.height],
            margin: 0,
            places: None,
            filter: spec.filter,
            are_apart: true,
        }
    }

    /// Returns the number of cells.
    pub(crate) fn count(&self) -> usize {
        self.size().iter().product()
    }

    /// Returns the numbers of cells along both axes.
    fn size(&self) -> [usize; 2] {
        self.film.map(|pixels| pixels + 2 * self.margin)
    }

    /// Returns true if samples contribute to other pixels than their own.
    pub(crate) fn overlap(&self) -> bool {
        self.margin > 0
    }

    /// Returns the column and row of a cell, in pixels from the film's top left pixel.
    pub(crate) fn place(&self, cell: usize) -> [i64; 2] {
        let [columns, _] = self.size();
        [cell % columns, cell / columns].map(|i| i as i64 - self.margin as i64)
    }

    /// Returns the number of the cell that is a pixel.
    pub(crate) fn of_pixel(&self, pixel: usize) -> usize {
        let [columns, _] = self.size();
        let [column, row] = [pixel % self.film[0], pixel / self.film[0]];
        (row + self.margin) * columns + column + self.margin
    }

    /// Returns the number of pixels among cells.
    pub(crate) fn pixels_among(&self, cells: std::ops::Range<usize>) -> usize {
        let is_pixel = |cell: &usize| {
            let [column, row] = self.place(*cell);
            let [width, height] = self.film.map(|size| size as i64);
            (0..width).contains(&column) && (0..height).contains(&row)
        };
        if self.overlap() {
            cells.filter(is_pixel).count()
        } else {
            cells.len()
        }
    }

    /// Samples a point of a cell from independent uniform numbers. Returns the point in pixels from
    /// the cell's corner, and the weight of a sample there.
    pub(crate) fn point(&self, uniform: [f64; 2]) -> ([f64; 2], f64) {
        if self.are_apart {
            let offsets = uniform.map(|u| self.filter.sample(u));
            let weight = offsets.map(|offset| self.filter.weight(offset));
            return (offsets.map(|offset| 0.5 + offset), weight[0] * weight[1]);
        }
        match &self.places {
            Some(places) => (uniform.map(|u| places.sample(u).0), 1.0),
            None => (uniform, 1.0),
        }
    }

    /// Returns the footprint of a sample at a point of the cell that is the film's first pixel.
    pub(crate) fn footprint(&self, point: [f64; 2]) -> Footprint {
        if self.overlap() {
            Footprint::at(&self.filter, point)
        } else {
            Footprint::at(&Filter::Box, [0.5; 2])
        }
    }

    /// Returns the variance of a pixel relative to the variance of the samples of cells, if all
    /// cells have equal variances: the mean of the sum of squared weights.
    pub(crate) fn noise(&self) -> f64 {
        let places = (0..NOISE_PLACES).map(|i| (f64::from(i) + 0.5) / f64::from(NOISE_PLACES));
        let of_axis = |place: f64| {
            let (point, _) = self.point([place; 2]);
            let footprint = self.footprint(point);
            let [(_, weights), _] = footprint.axes();
            weights.iter().map(|weight| weight * weight).sum::<f64>()
        };
        (places.map(of_axis).sum::<f64>() / f64::from(NOISE_PLACES)).powi(2)
    }

    /// Returns true if a sample of a cell contributes to any pixel.
    pub(crate) fn counts(&self, footprint: &Footprint, cell: usize) -> bool {
        !self.overlap() || footprint.reaches(self.film, self.place(cell))
    }

    /// Calls `count` with each pixel to which a sample of a cell contributes, and its weight.
    pub(crate) fn each_pixel(
        &self,
        footprint: &Footprint,
        cell: usize,
        count: impl FnMut(usize, f64),
    ) {
        footprint.each(self.film, self.place(cell), count);
    }

    /// Calls `add` with each cell whose sample contributes to a pixel, and its weight.
    pub(crate) fn each_cell(
        &self,
        footprint: &Footprint,
        pixel: usize,
        mut add: impl FnMut(usize, f64),
    ) {
        let [columns, _] = self.size();
        let own = self.of_pixel(pixel) as i64;
        let [(left, horizontal), (top, vertical)] = footprint.axes();
        for (row, vertical) in (top..).zip(vertical) {
            for (column, horizontal) in (left..).zip(horizontal) {
                let weight = vertical * horizontal;
                if weight != 0.0 {
                    // A weight reaches from the cell to the pixel: the cell lies the other way.
                    add((own - row * columns as i64 - column) as usize, weight);
                }
            }
        }
    }
}

/// Returns the density of places in a cell along an axis: the sum of the filters of all pixels, or
/// `None` if it is uniform.
fn places(filter: &Filter) -> Option<PiecewiseLinear> {
    let nodes = || (0..=INTERVALS).map(|i| i as f64 / INTERVALS as f64);
    let reach = filter.radius().ceil() as i64 + 1;
    let density = |place: f64| -> f64 {
        let pixels = -reach..=reach;
        pixels
            .map(|pixel| filter.value(place - 0.5 - pixel as f64))
            .sum()
    };
    let densities: Vec<f64> = nodes().map(density).collect();
    if densities
        .iter()
        .all(|density| (density - 1.0).abs() < ROUNDING)
    {
        return None;
    }
    PiecewiseLinear::new(nodes().collect(), &densities).ok()
}

#[cfg(test)]
mod tests {
    use super::super::SignedFilter;
    use super::*;

    /// Points of a cell along an axis.
    const POINTS: usize = 20_000;

    /// Returns the mean over points of the sum of weights times a quantity of the distance from the
    /// pixel's centre.
    fn weighted(cells: &Cells, quantity: impl Fn(f64) -> f64) -> f64 {
        let at = |i: usize| {
            let (point, _) = cells.point([(i as f64 + 0.5) / POINTS as f64; 2]);
            let footprint = Footprint::at(&cells.filter, point);
            let [(first, weights), _] = footprint.axes();
            let distances = (first..).map(|pixel| point[0] - 0.5 - pixel as f64);
            let terms = distances
                .zip(weights)
                .map(|(x, weight)| weight * quantity(x));
            terms.sum::<f64>()
        };
        (0..POINTS).map(at).sum::<f64>() / POINTS as f64
    }

    /// Samples have the filter as the density of their weights around a pixel, narrow filters
    /// included.
    #[test]
    fn weights_have_the_density_of_the_filter() {
        for filter in [
            Filter::Box,
            Filter::Tent { radius: 0.3 },
            Filter::Tent { radius: 0.8 },
            Filter::Tent { radius: 1.0 },
            Filter::Gaussian { stddev: 0.2 },
            Filter::Gaussian { stddev: 0.5 },
            Filter::Signed(SignedFilter::cubic(1.0 / 3.0, 1.0 / 3.0)),
            Filter::Signed(SignedFilter::lanczos(3)),
        ] {
            let spec = FilmSpec {
                width: 8,
                height: 8,
                channels: 1,
                group_size: 1,
                filter,
                window: None,
            };
            let cells = Cells::of(&spec);
            for quantity in [|x: f64| x * x, |x: f64| (2.0 * x).cos()] {
                let found = weighted(&cells, quantity);
                let h = 2.0 * filter.radius() / POINTS as f64;
                let place = |i: usize| (i as f64 + 0.5) * h - filter.radius();
                let terms = (0..POINTS).map(|i| filter.value(place(i)) * quantity(place(i)));
                let expected = h * terms.sum::<f64>();
                assert!(
                    (found - expected).abs() < 2e-4,
                    "{filter:?}: {found} {expected}"
                );
            }
        }
    }

    /// Each cell passes to the pixels the weights that pixels take from cells, and no more.
    #[test]
    fn cells_and_pixels_agree_on_weights() {
        let spec = FilmSpec {
            width: 3,
            height: 2,
            channels: 1,
            group_size: 1,
            filter: Filter::Gaussian { stddev: 0.5 },
            window: None,
        };
        let cells = Cells::of(&spec);
        let footprint = cells.footprint([0.3, 0.8]);
        let mut passed = vec![0.0; 6 * cells.count()];
        for cell in 0..cells.count() {
            let mut any = false;
            cells.each_pixel(&footprint, cell, |pixel, weight| {
                any = true;
                passed[pixel * cells.count() + cell] += weight;
            });
            assert_eq!(any, cells.counts(&footprint, cell));
        }
        for pixel in 0..6 {
            let mut sum = 0.0;
            cells.each_cell(&footprint, pixel, |cell, weight| {
                sum += weight;
                passed[pixel * cells.count() + cell] -= weight;
            });
            assert!((sum - 1.0).abs() < 1e-12);
            assert_eq!(
                cells.place(cells.of_pixel(pixel)),
                [pixel % 3, pixel / 3].map(|i| i as i64)
            );
        }
        assert!(passed.iter().all(|weight| weight.abs() < 1e-15));
        assert_eq!(cells.pixels_among(0..cells.count()), 6);
    }
}
