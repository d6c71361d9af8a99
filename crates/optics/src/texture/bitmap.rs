//! Images over texture coordinates, in Mitsuba's convention: (0, 0) is the corner of the first pixel, u runs
//! along a row and v over the rows.

use super::TextureError;
use crate::Spectrum;
use crate::shape::Site;
use glam::{DAffine2, DVec2};

/// What is between the centres of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BitmapFilter {
    /// Linear in both directions.
    Bilinear,
    /// Pixels are constant over their area.
    Nearest,
}

/// What is outside of the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// The image again, every other time mirrored.
    Mirror,
    /// The pixels at its edge.
    Clamp,
}

impl Wrap {
    /// The pixel that stands for number `i` along an axis of `n`.
    pub(crate) fn index(self, i: i64, n: i64) -> usize {
        let i = match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n);
                i.min(2 * n - 1 - i)
            }
            Wrap::Clamp => i.clamp(0, n - 1),
        };
        i as usize
    }
}

/// Coordinates beyond this have lost all digits of a position in the image.
const FARTHEST: f64 = 1e15;

/// An image.
#[derive(Clone, Debug)]
pub struct Bitmap {
    size: [usize; 2],
    /// Channels of a pixel: one, which stands for all, or those that travel together.
    channels: usize,
    data: Vec<f32>,
    filter: BitmapFilter,
    wrap: Wrap,
    to_uv: DAffine2,
}

impl Bitmap {
    /// An image of `size` (width, height), pixels row by row, each of `channels` channels; one channel stands
    /// for all. `to_uv` is applied to texture coordinates before the image is looked up.
    ///
    /// # Errors
    /// No pixels, or no channels or too many; values that are not as many as the pixels have, or not finite.
    pub fn new(
        size: [usize; 2],
        channels: usize,
        data: Vec<f32>,
        filter: BitmapFilter,
        wrap: Wrap,
        to_uv: DAffine2,
    ) -> Result<Self, TextureError> {
        if !(1..=Spectrum::CHANNELS).contains(&channels) || size.contains(&0) {
            return Err(TextureError::Empty);
        }
        let expected = size[0].saturating_mul(size[1]).saturating_mul(channels);
        if data.len() != expected {
            let found = data.len();
            return Err(TextureError::Count { expected, found });
        }
        if let Some(index) = data.iter().position(|v| !v.is_finite()) {
            return Err(TextureError::NotFinite { index });
        }
        Ok(Bitmap {
            size,
            channels,
            data,
            filter,
            wrap,
            to_uv,
        })
    }

    /// Coordinates that are whole numbers on the lines between which the image is bilinear.
    pub(super) fn cells(&self) -> DAffine2 {
        let [x, y] = self.size.map(|n| n as f64);
        let pixels = DAffine2::from_scale(DVec2::new(x, y)) * self.to_uv;
        match self.filter {
            BitmapFilter::Nearest => pixels,
            BitmapFilter::Bilinear => DAffine2::from_translation(DVec2::splat(-0.5)) * pixels,
        }
    }

    /// The derivatives of the first channel with respect to texture coordinates; zero if it is not interpolated
    /// (docs/theory.md#bump-and-normal-maps).
    pub(super) fn gradient(&self, site: &Site) -> DVec2 {
        self.gradient_of(site, |pixel| pixel[0])
    }

    /// The same of a linear function of the channels.
    pub fn gradient_of(&self, site: &Site, of: impl Fn(Spectrum) -> f64) -> DVec2 {
        if self.filter == BitmapFilter::Nearest {
            return DVec2::ZERO;
        }
        let p = self.place(site) - 0.5;
        let (low, t) = (p.floor(), p - p.floor());
        let value = |x: f64, y: f64| of(self.pixel(low + DVec2::new(x, y)));
        let [a, b, c, d] = [
            value(0.0, 0.0),
            value(1.0, 0.0),
            value(0.0, 1.0),
            value(1.0, 1.0),
        ];
        let in_pixels = DVec2::new(
            (b - a) * (1.0 - t.y) + (d - c) * t.y,
            (c - a) * (1.0 - t.x) + (d - b) * t.x,
        );
        let [x, y] = self.size.map(|n| n as f64);
        self.to_uv.matrix2.transpose() * (in_pixels * DVec2::new(x, y))
    }

    /// A point in pixels, from the corner of the first.
    fn place(&self, site: &Site) -> DVec2 {
        let uv = self.to_uv.transform_point2(site.uv.get().into());
        let p = uv * DVec2::new(self.size[0] as f64, self.size[1] as f64);
        let p = if p.is_nan() { DVec2::ZERO } else { p };
        p.clamp(DVec2::splat(-FARTHEST), DVec2::splat(FARTHEST))
    }

    pub(super) fn at(&self, site: &Site) -> Spectrum {
        let p = self.place(site);
        match self.filter {
            BitmapFilter::Nearest => self.pixel(p.floor()),
            BitmapFilter::Bilinear => self.between(p - 0.5),
        }
    }

    /// Whether it has no jumps.
    pub fn is_continuous(&self) -> bool {
        self.filter == BitmapFilter::Bilinear
    }

    /// Width and height.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Calls `see` with each pixel that counts in the value at a point, and its weight: the value is the sum of weights times pixels. A pixel may come
    /// several times.
    pub(crate) fn weights(&self, site: &Site, mut see: impl FnMut(usize, f64)) {
        let p = self.place(site);
        if self.filter == BitmapFilter::Nearest {
            return see(self.pixel_at(p.floor()), 1.0);
        }
        let p = p - 0.5;
        let (low, t) = (p.floor(), p - p.floor());
        for (corner, weight) in [
            (DVec2::ZERO, (1.0 - t.x) * (1.0 - t.y)),
            (DVec2::X, t.x * (1.0 - t.y)),
            (DVec2::Y, (1.0 - t.x) * t.y),
            (DVec2::ONE, t.x * t.y),
        ] {
            see(self.pixel_at(low + corner), weight);
        }
    }

    /// Linear between the four pixels around a point, whose coordinates count from a pixel's centre.
    fn between(&self, p: DVec2) -> Spectrum {
        let (low, t) = (p.floor(), p - p.floor());
        let row = |low: DVec2| self.pixel(low) * (1.0 - t.x) + self.pixel(low + DVec2::X) * t.x;
        row(low) * (1.0 - t.y) + row(low + DVec2::Y) * t.y
    }

    fn pixel(&self, corner: DVec2) -> Spectrum {
        let first = self.pixel_at(corner) * self.channels;
        spectrum(&self.data[first..first + self.channels])
    }

    /// The number of the pixel at a corner.
    fn pixel_at(&self, corner: DVec2) -> usize {
        let [x, y] = [0, 1].map(|k| self.wrap.index(corner[k] as i64, self.size[k] as i64));
        y * self.size[0] + x
    }

    /// The values of all pixels.
    pub(super) fn values(&self) -> impl Iterator<Item = Spectrum> + '_ {
        self.data.chunks_exact(self.channels).map(spectrum)
    }
}

/// The channels of a pixel; one stands for all.
fn spectrum(values: &[f32]) -> Spectrum {
    match values {
        [all] => Spectrum::splat(f64::from(*all)),
        _ => Spectrum(std::array::from_fn(|c| {
            values.get(c).copied().map_or(0.0, f64::from)
        })),
    }
}
