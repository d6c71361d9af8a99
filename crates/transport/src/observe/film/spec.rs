//! Size of pictures, and the part of a sensor's image that they show.

use super::Filter;

/// Size of a picture, and weights of its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmSpec {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Number of spectral channels.
    pub channels: usize,
    /// Number of channels that share their paths, 1 to
    /// [`Spectrum::CHANNELS`](crate::Spectrum::CHANNELS). It is one where the index depends on the
    /// wavelength.
    pub group_size: usize,
    /// Reconstruction filter.
    pub filter: Filter,
    /// Part of the sensor's image that the picture shows; `None` for the whole image.
    pub window: Option<FilmWindow>,
}

/// Place of a picture on the image of its sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmWindow {
    /// Width and height of the whole image in pixels, > 0.
    pub image: [usize; 2],
    /// Top left corner of the picture, in pixels from the top left corner of the image; both
    /// finite. Parts of the picture beyond the image show what a larger image would show.
    pub corner: [f64; 2],
}

impl FilmSpec {
    /// Converts a position, in pixels from the picture's top left corner, to units of the sensor's
    /// image.
    pub fn image(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match &self.window {
            None => [x / self.width as f64, y / self.height as f64],
            Some(w) => [
                (x + w.corner[0]) / w.image[0] as f64,
                (y + w.corner[1]) / w.image[1] as f64,
            ],
        }
    }

    /// Converts a position on the sensor's image to pixels of the picture: the inverse of
    /// [`FilmSpec::image`].
    pub fn position(&self, [s, t]: [f64; 2]) -> [f64; 2] {
        match &self.window {
            None => [s * self.width as f64, t * self.height as f64],
            Some(w) => [
                s * w.image[0] as f64 - w.corner[0],
                t * w.image[1] as f64 - w.corner[1],
            ],
        }
    }

    /// Returns the number of pixels of the whole image of the sensor.
    pub(crate) fn pixels_of_image(&self) -> f64 {
        let size = self.window.map_or([self.width, self.height], |w| w.image);
        size[0] as f64 * size[1] as f64
    }

    /// Returns the number of channel groups. Each has its own scene and its own paths.
    pub fn groups(&self) -> usize {
        self.channels.div_ceil(self.group_size)
    }

    /// Returns the number of channels in a group.
    pub fn channels_of(&self, group: usize) -> usize {
        (self.channels - group * self.group_size).min(self.group_size)
    }
}
