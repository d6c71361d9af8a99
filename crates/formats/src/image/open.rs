//! Images of any format as layers of named channels.

use std::path::Path;

use super::denoised::DENOISED;
use super::exposure::Exposure;
use super::png::Depth;
use super::tone::{Curve, Tone};
use super::{ImageLayers, Layer, RgbImage, exr, png, variance_of};
use crate::atomic;
use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::npy::{self, NpyArray, NpyData};

impl ImageLayers {
    /// Reads an `.exr`, `.png`, `.jpg` or `.npy` file, by its extension.
    ///
    /// Values of PNG and JPEG files are sRGB, and are converted to linear values in the channels R,
    /// G and B. The exposure and tone map that texts of a PNG file state are undone. An array is
    /// `[row, column, channel]` or `[row, column]`: three channels are R, G and B, a single channel
    /// is Y, and others have numbers from 0.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, is invalid, or has another extension, and arrays of other
    /// shapes.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::read_within(path, Limits::default())
    }

    /// Reads a file within a limit of memory, as [`ImageLayers::read`].
    ///
    /// # Errors
    ///
    /// As for [`ImageLayers::read`].
    pub fn read_within(path: &Path, limits: Limits) -> Result<Self, FileError> {
        let extension = path.extension().and_then(|e| e.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => exr::read_within(path, limits),
            Some("png") => Ok(colours(&png::read_untoned(path, limits)?)),
            Some("jpg" | "jpeg") => Ok(colours(&RgbImage::read_within(path, limits)?)),
            Some("npy") => from_array(npy::read(path)?).map_err(|problem| problem.at(path)),
            Some("tif" | "tiff") => {
                let message = "TIFF images, which do not state the encoding of their values: convert the file to .exr or .npy with linear values, or to .png with sRGB values";
                Err(Problem::Unsupported(message.into()).at(path))
            }
            _ => {
                let message = "images are read from .exr, .png, .jpg and .npy".to_owned();
                Err(Problem::Unsupported(message).at(path))
            }
        }
    }

    /// Writes the image in the format of the file's extension.
    ///
    /// An `.exr` file has all layers, and an `.npy` file the first layer. A `.png` file has the
    /// first layer for a screen, with the exposure of [`Exposure::Auto`].
    ///
    /// # Errors
    ///
    /// A file that cannot be written, or has another extension.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        self.write_exposed(path, Exposure::Auto)
    }

    /// Writes the image as [`write`](ImageLayers::write), with a given `exposure` of a `.png` file.
    ///
    /// # Errors
    ///
    /// Fails like [`write`](ImageLayers::write).
    pub fn write_exposed(&self, path: &Path, exposure: Exposure) -> Result<(), FileError> {
        let extension = path.extension().and_then(|e| e.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => exr::write(path, self),
            Some("npy") => super::npy::write(path, self, ""),
            Some("png") => self.write_png(path, exposure, Curve::default()).map(drop),
            _ => Err(unknown_format(path)),
        }
    }

    /// Writes the main layer for a screen to a PNG file, completely or not at all. Returns the
    /// exposure and the tone curve. The file states whether the image is
    /// [denoised](super::denoised).
    ///
    /// # Errors
    ///
    /// As for [`png::write()`].
    pub fn write_png(
        &self,
        path: &Path,
        exposure: Exposure,
        curve: Curve,
    ) -> Result<Tone, FileError> {
        let shown = self.on_screen().unwrap_or_default();
        let tone = exposure.tone(curve, &shown);
        let texts = self.attributes.iter();
        let texts: Vec<_> = texts.filter(|(name, _)| name == DENOISED).collect();
        let bytes = png::encode_described(&shown, Depth::Eight, tone, &texts);
        atomic::write_bytes(path, &bytes.map_err(|problem| problem.at(path))?)?;
        Ok(tone)
    }

    /// Returns an image with a single layer and its variance. The layer becomes the main layer. An
    /// empty name is the main layer.
    ///
    /// # Errors
    ///
    /// A layer that does not exist.
    pub fn focused(mut self, layer: &str) -> Result<Self, Problem> {
        let variance = variance_of(layer);
        if self.layer(layer).is_none() {
            return Err(Problem::Unsupported(self.missing(layer)));
        }
        self.layers
            .retain(|l| l.name == layer || l.name == variance);
        for l in &mut self.layers {
            l.name = if l.name == layer { "" } else { "variance" }.to_owned();
        }
        Ok(self)
    }

    /// Makes a message that a layer does not exist, with some existing layers.
    fn missing(&self, layer: &str) -> String {
        const SHOWN: usize = 20;
        let names = self.layers.iter().map(|l| l.name.as_str());
        let names: Vec<&str> = names.filter(|n| !n.is_empty()).take(SHOWN).collect();
        if layer.is_empty() {
            format!(
                "the image has no main layer; choose one of its layers: {}",
                names.join(", ")
            )
        } else if names.is_empty() {
            format!("no layer '{layer}': the image has no layers")
        } else {
            format!(
                "no layer '{layer}': the image has the layers {}",
                names.join(", ")
            )
        }
    }
}

/// Returns the default name of one of `count` channels.
pub fn channel_name(channel: usize, count: usize) -> String {
    match count {
        1 => "Y".to_owned(),
        3 => ["R", "G", "B"][channel].to_owned(),
        _ => channel.to_string(),
    }
}

/// Makes an error for a file extension in which images cannot be written.
pub fn unknown_format(path: &Path) -> FileError {
    let message = "images are written to .exr, .png and .npy".to_owned();
    Problem::Unsupported(message).at(path)
}

fn from_array(array: NpyArray) -> Result<ImageLayers, Problem> {
    let (height, width, channels) = match array.shape[..] {
        [height, width] => (height, width, 1),
        [height, width, channels] => (height, width, channels),
        _ => {
            let found = format!("an array with {} axes", array.shape.len());
            let expected = "[row, column, channel] or [row, column]".to_owned();
            return Err(Problem::Mismatch { expected, found });
        }
    };
    let data: Vec<f32> = match array.data {
        NpyData::F32(data) => data,
        NpyData::F64(data) => data.into_iter().map(|v| v as f32).collect(),
    };
    let index = |c: usize, i: usize| {
        if array.fortran_order {
            (c * width + i % width) * height + i / width
        } else {
            i * channels + c
        }
    };
    let plane = |c: usize| (0..width * height).map(|i| data[index(c, i)]).collect();
    let image = planar(width, height, (0..channels).map(plane).collect());
    image.check()?;
    Ok(image)
}

/// Makes an image of the channels R, G and B.
fn colours(image: &RgbImage) -> ImageLayers {
    let plane = |c: usize| image.pixels.iter().map(|p| p[c]).collect();
    planar(image.width, image.height, (0..3).map(plane).collect())
}

fn planar(width: usize, height: usize, planes: Vec<Vec<f32>>) -> ImageLayers {
    let count = planes.len();
    let planes = planes.into_iter().enumerate();
    ImageLayers {
        width,
        height,
        layers: vec![Layer {
            name: String::new(),
            channels: planes
                .map(|(c, values)| (channel_name(c, count), values))
                .collect(),
        }],
        attributes: Vec::new(),
    }
}
