//! Division of a surface into pieces on which a texture is a polynomial.

use super::Texture;
use crate::shape::Chart;
use crate::spectrum::Spectrum;
use glam::{DAffine2, DVec2};

/// Error: the surface has too many pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooFine;

/// State of the division of a surface.
struct Cut<'v> {
    /// Number of further pieces allowed.
    left: u64,
    visit: &'v mut dyn FnMut(&[DVec2]),
}

/// Function that is called with each piece.
type Visit<'a, C> = dyn FnMut(&mut C, &[DVec2]) -> Result<(), TooFine> + 'a;

impl Texture {
    /// Computes the integral over the area of a chart, exact to rounding. `left` is the number of
    /// pieces still allowed, and is reduced.
    pub(crate) fn integral(&self, chart: &Chart, left: &mut u64) -> Result<Spectrum, TooFine> {
        let mut sum = Spectrum::ZERO;
        let mut visit = |piece: &[DVec2]| {
            chart.quadrature(piece, |q, weight| {
                sum += self.at(&chart.site(q)) * weight;
            });
        };
        let mut cut = Cut {
            left: *left,
            visit: &mut visit,
        };
        for polygon in chart.polygons() {
            cut.texture(self, &chart.uv(), &polygon)?;
        }
        *left = cut.left;
        Ok(sum)
    }
}

impl Cut<'_> {
    /// Cuts a convex polygon into convex pieces. On each piece, the texture is at most quadratic.
    fn texture(
        &mut self,
        texture: &Texture,
        uv: &DAffine2,
        polygon: &[DVec2],
    ) -> Result<(), TooFine> {
        match texture {
            // A quantity in space is not a polynomial. The scene reader refuses it for lights.
            Texture::Uniform(_) | Texture::Vertices(_) | Texture::Volume(_) => self.piece(polygon),
            Texture::Scaled(scaled) => self.texture(scaled.texture(), uv, polygon),
            Texture::Bitmap(bitmap) => {
                let pixels = bitmap.cells() * *uv;
                self.cells(polygon, &pixels, &mut |cut, cell| cut.piece(cell))
            }
            Texture::Checkerboard(board) => {
                let fields = board.cells() * *uv;
                self.cells(polygon, &fields, &mut |cut, cell| {
                    let middle = cell.iter().sum::<DVec2>() / cell.len() as f64;
                    let [x, y] = fields.transform_point2(middle).floor().to_array();
                    let colour = (x + y).rem_euclid(2.0) as usize;
                    cut.texture(&board.colours()[colour], uv, cell)
                })
            }
        }
    }

    fn piece(&mut self, polygon: &[DVec2]) -> Result<(), TooFine> {
        self.left = self.left.checked_sub(1).ok_or(TooFine)?;
        (self.visit)(polygon);
        Ok(())
    }

    /// Cuts a polygon at the lines on which one of its coordinates in `grid` is an integer.
    fn cells(
        &mut self,
        polygon: &[DVec2],
        grid: &DAffine2,
        visit: &mut Visit<'_, Self>,
    ) -> Result<(), TooFine> {
        let along = |axis: usize| move |q: DVec2| grid.transform_point2(q)[axis];
        self.strips(polygon, &along(0), &mut |cut, strip| {
            cut.strips(strip, &along(1), visit)
        })
    }

    /// Cuts a polygon where a linear function is an integer.
    fn strips(
        &mut self,
        polygon: &[DVec2],
        height: &dyn Fn(DVec2) -> f64,
        visit: &mut Visit<'_, Self>,
    ) -> Result<(), TooFine> {
        let heights = || polygon.iter().map(|q| height(*q));
        let low = heights().fold(f64::INFINITY, f64::min).floor();
        let high = heights().fold(f64::NEG_INFINITY, f64::max).ceil();
        // This condition also refuses NaN.
        if !(high - low <= self.left as f64 && low.abs() <= MAX_COORDINATE) {
            return Err(TooFine);
        }
        let count = ((high - low) as u64).max(1);
        for k in 0..count {
            let floor = low + k as f64;
            let above = clip(polygon, |q| height(q) - floor);
            let strip = clip(&above, |q| floor + 1.0 - height(q));
            if strip.len() >= 3 {
                visit(self, &strip)?;
            }
        }
        Ok(())
    }
}

/// Largest absolute coordinate. Beyond it, integers are no longer exact.
const MAX_COORDINATE: f64 = 1e15;

/// Returns the part of a convex polygon where a linear function is not negative.
fn clip(polygon: &[DVec2], height: impl Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, q) in polygon.iter().enumerate() {
        let next = polygon[(k + 1) % polygon.len()];
        let (a, b) = (height(*q), height(next));
        if a >= 0.0 {
            kept.push(*q);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            kept.push(q.lerp(next, a / (a - b)));
        }
    }
    kept
}
