//! Images as files.

use crate::config::ImageFormat;
use io::FileError;
use io::image::png::Depth;
use io::image::tone::Tone;
use io::image::{ImageLayers, exr, npy, png};
use std::path::Path;

/// Writes an image, completely or not at all; an EXR file holds all of its layers, the others the main one.
pub fn write(
    path: &Path,
    format: ImageFormat,
    image: &ImageLayers,
    tone: Tone,
) -> Result<(), FileError> {
    match format {
        ImageFormat::Exr => exr::write(path, image),
        ImageFormat::Npy => npy::write(path, image, ""),
        ImageFormat::Png => {
            let shown = image.on_screen().unwrap_or_default();
            png::write(path, &shown, Depth::Eight, tone)
        }
    }
}
