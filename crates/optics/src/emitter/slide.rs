//! Image of a projector, divided into cells in which it is bilinear.

use crate::Spectrum;
use crate::sampling::BilinearCell;
use crate::texture::{BitmapFilter, Wrap};

/// Image for a projector.
#[derive(Clone, Debug)]
pub struct Slide {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Radiances of the screen, ≥ 0 and not all 0, row by row from the top. Their number must match
    /// `size`.
    pub pixels: Vec<Spectrum>,
    /// Interpolation between the centres of pixels.
    pub filter: BitmapFilter,
    /// Continuation of the image, for interpolation at its edges.
    pub wrap: Wrap,
}

/// Cell along an axis: between the centres of two pixels, or a pixel if the filter is `nearest`.
struct Interval {
    /// Start and end, in [0, 1].
    edges: [f64; 2],
    /// Pixels on the two sides.
    pixels: [usize; 2],
    /// Start and end as fractions of the distance between the centres of these pixels.
    fractions: [f64; 2],
}

impl Slide {
    /// Returns the numbers of columns and rows of cells.
    pub(super) fn counts(&self) -> [usize; 2] {
        match self.filter {
            BitmapFilter::Nearest => self.size,
            BitmapFilter::Bilinear => self.size.map(|n| n + 1),
        }
    }

    /// Returns all cells, row by row.
    pub(super) fn cells(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.counts();
        (0..rows).flat_map(move |j| (0..columns).map(move |i| [i, j]))
    }

    fn interval(&self, axis: usize, k: usize) -> Interval {
        let n = self.size[axis];
        match self.filter {
            BitmapFilter::Nearest => Interval {
                edges: [k, k + 1].map(|k| k as f64 / n as f64),
                pixels: [k; 2],
                fractions: [0.0; 2],
            },
            BitmapFilter::Bilinear => {
                let begins = if k == 0 { 0.5 } else { 0.0 };
                let ends = if k == n { 0.5 } else { 1.0 };
                let fractions = [begins, ends];
                let k = k as i64;
                Interval {
                    edges: fractions.map(|t| (k as f64 - 0.5 + t) / n as f64),
                    pixels: [k - 1, k].map(|k| self.wrap.index(k, n as i64)),
                    fractions,
                }
            }
        }
    }

    /// Returns the radiances at the corners of a cell: above and below, left and right.
    fn corners(&self, cell: [usize; 2]) -> [[Spectrum; 2]; 2] {
        let [across, down] = [0, 1].map(|axis| self.interval(axis, cell[axis]));
        let row = |y: usize| {
            let [left, right] = across.pixels.map(|x| self.pixels[y * self.size[0] + x]);
            across.fractions.map(|t| mix([left, right], t))
        };
        let [above, below] = down.pixels.map(row);
        down.fractions
            .map(|t| [0, 1].map(|k| mix([above[k], below[k]], t)))
    }

    /// Returns the radiances in a cell, summed over the channels.
    pub(super) fn values(&self, cell: [usize; 2]) -> BilinearCell {
        BilinearCell::new(self.corners(cell).map(|row| row.map(|p| p.sum())))
    }

    /// Returns the fraction of the image that a cell covers.
    pub(super) fn area(&self, cell: [usize; 2]) -> f64 {
        let [width, height] = [0, 1].map(|axis| {
            let [begin, end] = self.interval(axis, cell[axis]).edges;
            end - begin
        });
        width * height
    }

    /// Returns the image coordinates, in [0, 1]², of a point of a cell.
    pub(super) fn coordinates(&self, cell: [usize; 2], within: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let [begin, end] = self.interval(axis, cell[axis]).edges;
            begin + within[axis] * (end - begin)
        })
    }

    /// Returns the cell at image coordinates in [0, 1]², and the position in it.
    pub(super) fn locate(&self, uv: [f64; 2]) -> ([usize; 2], [f64; 2]) {
        let shift = match self.filter {
            BitmapFilter::Nearest => 0.0,
            BitmapFilter::Bilinear => 0.5,
        };
        let counts = self.counts();
        let cell = [0, 1].map(|axis| {
            let x = uv[axis] * self.size[axis] as f64 + shift;
            (x as usize).min(counts[axis] - 1)
        });
        let within = [0, 1].map(|axis| {
            let [begin, end] = self.interval(axis, cell[axis]).edges;
            ((uv[axis] - begin) / (end - begin)).clamp(0.0, 1.0)
        });
        (cell, within)
    }

    /// Returns the radiance at image coordinates in [0, 1]².
    pub(super) fn at(&self, uv: [f64; 2]) -> Spectrum {
        let (cell, [x, y]) = self.locate(uv);
        mix(self.corners(cell).map(|row| mix(row, x)), y)
    }

    /// Calls `see` with each pixel that contributes at image coordinates in [0, 1]², and its
    /// weight.
    pub(super) fn weights(&self, uv: [f64; 2], mut see: impl FnMut(usize, f64)) {
        let (cell, within) = self.locate(uv);
        let [across, down] = [0, 1].map(|axis| {
            let Interval {
                pixels: [low, high],
                fractions: [begin, end],
                ..
            } = self.interval(axis, cell[axis]);
            let t = begin + within[axis] * (end - begin);
            [(low, 1.0 - t), (high, t)]
        });
        for (row, by_row) in down {
            for (column, by_column) in across {
                see(row * self.size[0] + column, by_row * by_column);
            }
        }
    }

    /// Returns the mean radiance.
    pub(super) fn mean(&self) -> Spectrum {
        self.cells().fold(Spectrum::ZERO, |sum, cell| {
            let middle = mix(self.corners(cell).map(|row| mix(row, 0.5)), 0.5);
            sum + middle * self.area(cell)
        })
    }
}

fn mix([a, b]: [Spectrum; 2], t: f64) -> Spectrum {
    a * (1.0 - t) + b * t
}
