//! Images over texture coordinates, in Mitsuba's convention. (0, 0) is the corner of the first
//! pixel, u runs along a row and v over the rows.

use super::TextureError;
use crate::Spectrum;
use crate::shape::Site;
use glam::{DAffine2, DVec2};

/// Interpolation between the centres of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BitmapFilter {
    /// Linear in both directions.
    Bilinear,
    /// Pixels are constant over their area.
    Nearest,
}

/// Continuation outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Repeats the image.
    Repeat,
    /// Repeats the image, with every other copy mirrored.
    Mirror,
    /// Repeats the pixels at the edge.
    Clamp,
}

impl Wrap {
    /// Returns the pixel that represents index `i` along an axis of `n` pixels.
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

/// Largest absolute coordinate. Beyond it, coordinates have no digits left for a position in the
/// image.
const MAX_COORDINATE: f64 = 1e15;

/// Image over texture coordinates.
#[derive(Clone, Debug)]
pub struct Bitmap {
    size: [usize; 2],
    /// Number of channels of a pixel: one, which stands for all spectral channels, or several.
    channels: usize,
    data: Vec<f32>,
    filter: BitmapFilter,
    wrap: Wrap,
    to_uv: DAffine2,
}

impl Bitmap {
    /// Creates an image of `size` (width, height), with pixels row by row, each of `channels`
    /// channels. A single channel gives the value of all channels. `to_uv` is applied to texture
    /// coordinates before the lookup.
    ///
    /// # Errors
    /// Fails if there are no pixels, no channels, or too many channels. Fails if the number of
    /// values does not match, or if a value is not finite.
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

    /// Returns the map to coordinates that are integers on the lines between which the image is
    /// bilinear.
    pub(super) fn cells(&self) -> DAffine2 {
        let [x, y] = self.size.map(|n| n as f64);
        let pixels = DAffine2::from_scale(DVec2::new(x, y)) * self.to_uv;
        match self.filter {
            BitmapFilter::Nearest => pixels,
            BitmapFilter::Bilinear => DAffine2::from_translation(DVec2::splat(-0.5)) * pixels,
        }
    }

    /// Returns the derivatives of the first channel with respect to texture coordinates; zero
    /// without interpolation (docs/theory.md#bump-and-normal-maps).
    pub(super) fn gradient(&self, site: &Site) -> DVec2 {
        self.gradient_of(site, |pixel| pixel[0])
    }

    /// Returns the derivatives of a linear function of the channels with respect to texture
    /// coordinates.
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

    /// Returns a point in pixels, relative to the corner of the first pixel.
    fn place(&self, site: &Site) -> DVec2 {
        let uv = self.to_uv.transform_point2(site.uv.get().into());
        let p = uv * DVec2::new(self.size[0] as f64, self.size[1] as f64);
        let p = if p.is_nan() { DVec2::ZERO } else { p };
        p.clamp(DVec2::splat(-MAX_COORDINATE), DVec2::splat(MAX_COORDINATE))
    }

    pub(super) fn at(&self, site: &Site) -> Spectrum {
        let p = self.place(site);
        match self.filter {
            BitmapFilter::Nearest => self.pixel(p.floor()),
            BitmapFilter::Bilinear => self.between(p - 0.5),
        }
    }

    /// Returns true if the image has no jumps.
    pub fn is_continuous(&self) -> bool {
        self.filter == BitmapFilter::Bilinear
    }

    /// Returns width and height.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Calls `see` with each pixel that contributes to the value at a point, and its weight. The
    /// value is the sum of weights times pixels. A pixel may be reported several times.
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

    /// Interpolates between the four pixels around a point, whose coordinates are relative to the
    /// centre of a pixel.
    fn between(&self, p: DVec2) -> Spectrum {
        let (low, t) = (p.floor(), p - p.floor());
        let row = |low: DVec2| self.pixel(low) * (1.0 - t.x) + self.pixel(low + DVec2::X) * t.x;
        row(low) * (1.0 - t.y) + row(low + DVec2::Y) * t.y
    }

    fn pixel(&self, corner: DVec2) -> Spectrum {
        let first = self.pixel_at(corner) * self.channels;
        spectrum(&self.data[first..first + self.channels])
    }

    /// Returns the index of the pixel at a corner.
    fn pixel_at(&self, corner: DVec2) -> usize {
        let [x, y] = [0, 1].map(|k| self.wrap.index(corner[k] as i64, self.size[k] as i64));
        y * self.size[0] + x
    }

    /// Returns the values of all pixels.
    pub(super) fn values(&self) -> impl Iterator<Item = Spectrum> + '_ {
        self.data.chunks_exact(self.channels).map(spectrum)
    }
}

/// Converts the channels of a pixel to a spectrum; a single channel stands for all.
fn spectrum(values: &[f32]) -> Spectrum {
    match values {
        [all] => Spectrum::splat(f64::from(*all)),
        _ => Spectrum(std::array::from_fn(|c| {
            values.get(c).copied().map_or(0.0, f64::from)
        })),
    }
}
