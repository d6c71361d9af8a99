//! Images: layers of named channels, read and written as EXR, NPY and PNG, and shown on screens.

pub mod cie;
pub mod denoised;
mod encoded;
pub mod exposure;
pub mod exr;
mod exr_header;
pub mod hdr;
pub mod npy;
mod open;
pub mod pfm;
pub mod png;
pub mod tone;
pub mod white;

pub use open::{channel_name, unknown_format};

use std::path::Path;

use ::image::ImageFormat;

use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::tensor::Tensor;

/// Image of several layers with named channels, as in EXR files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageLayers {
    /// Number of pixels per row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// The layers. The main layer has an empty name.
    pub layers: Vec<Layer>,
    /// Texts about the image by name, such as the hash of its scene and its seed. EXR reserves some
    /// names, such as `version`, `type`, `name`, `comments` and `owner`.
    pub attributes: Vec<(String, String)>,
}

/// Layer of an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// Name of the layer, for example `variance`; empty for the main layer.
    pub name: String,
    /// Channels, for example `R`, each with its values row by row from the top left.
    pub channels: Vec<(String, Vec<f32>)>,
}

/// Returns the name of the layer with the variances of another layer.
fn variance_of(layer: &str) -> String {
    match layer {
        "" => "variance".to_owned(),
        _ => format!("variance.{layer}"),
    }
}

impl Layer {
    /// Returns the channel with this name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, values)| values.as_slice())
    }

    /// Returns the channels R, G and B, if the layer has all of them.
    fn colours(&self) -> Option<[&[f32]; 3]> {
        let [red, green, blue] = ["R", "G", "B"].map(|name| self.channel(name));
        Some([red?, green?, blue?])
    }
}

impl ImageLayers {
    /// Returns the layer with this name; the main layer's name is empty.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// Returns the attribute with this name.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, value)| value.as_str())
    }

    /// Returns the main layer in colour: its R, G and B, or its Y in all three.
    pub fn rgb(&self) -> Option<RgbImage> {
        let main = self.layer("")?;
        let grey = || Some([main.channel("Y")?; 3]);
        Some(self.of_channels(main.colours().or_else(grey)?))
    }

    /// Returns the main layer in colour, or the only layer with R, G and B.
    fn colours(&self) -> Result<RgbImage, Problem> {
        if let Some(main) = self.rgb() {
            return Ok(main);
        }
        let mut layers = self.layers.iter().filter_map(Layer::colours);
        if let (Some(only), None) = (layers.next(), layers.next()) {
            return Ok(self.of_channels(only));
        }
        const SHOWN: usize = 20;
        let names = self.layers.iter().flat_map(|layer| {
            let names = layer.channels.iter().map(|(name, _)| name);
            names.map(|name| exr::channel_name(&layer.name, name))
        });
        let names: Vec<String> = names.collect();
        let more = if names.len() > SHOWN { ", …" } else { "" };
        let shown = names[..names.len().min(SHOWN)].join(", ");
        Err(Problem::Mismatch {
            expected: "the channels R, G, B or Y, or R, G, B in one layer".to_owned(),
            found: format!("{shown}{more}"),
        })
    }

    fn of_channels(&self, [red, green, blue]: [&[f32]; 3]) -> RgbImage {
        let pixels = red
            .iter()
            .zip(green)
            .zip(blue)
            .map(|((r, g), b)| [*r, *g, *b])
            .collect();
        RgbImage {
            width: self.width,
            height: self.height,
            pixels,
        }
    }

    /// Checks that the image has pixels, and that all channels have its size.
    fn check(&self) -> Result<(), Problem> {
        let count = self.width.checked_mul(self.height);
        let channels = self.layers.iter().flat_map(|l| &l.channels);
        if count == Some(0) || self.layers.iter().all(|l| l.channels.is_empty()) {
            return Err(Problem::Empty(
                "the image has no pixels or no channels".to_owned(),
            ));
        }
        for (name, values) in channels {
            if Some(values.len()) != count {
                return Err(Problem::Mismatch {
                    expected: format!("{} x {} values", self.width, self.height),
                    found: format!("{} in channel '{name}'", values.len()),
                });
            }
        }
        Ok(())
    }
}

/// Colour image with linear values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RgbImage {
    /// Number of pixels per row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Pixels row by row from the top left.
    pub pixels: Vec<[f32; 3]>,
}

impl RgbImage {
    /// Reads a colour image, such as an environment map, from an `.exr`, `.hdr` (`.rgbe`), `.pfm`,
    /// `.png`, `.jpg`, `.bmp` or `.tga` file, by its extension. sRGB values of `.png`, `.jpg`,
    /// `.bmp` and `.tga` files are converted to linear values. From an `.exr` file without main
    /// layer, the only layer with R, G and B is read.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is not a valid image, and NaN or infinite values.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::read_within(path, Limits::default())
    }

    /// Reads a file within a limit of memory, as [`RgbImage::read`].
    ///
    /// # Errors
    ///
    /// As for [`RgbImage::read`].
    pub fn read_within(path: &Path, limits: Limits) -> Result<Self, FileError> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        let image = match extension.as_deref() {
            Some("exr") => {
                let image = exr::read_within(path, limits)?.colours();
                image.map_err(|problem| problem.at(path))?
            }
            Some("png") => png::read_within(path, limits)?,
            Some("jpg" | "jpeg") => encoded::read(path, (ImageFormat::Jpeg, "JPEG"), limits)?,
            Some("hdr" | "rgbe") => hdr::read(path, limits)?,
            Some("pfm") => pfm::read(path, limits)?,
            Some("bmp") => encoded::read(path, (ImageFormat::Bmp, "BMP"), limits)?,
            Some("tga") => encoded::read(path, (ImageFormat::Tga, "TGA"), limits)?,
            _ => {
                let message =
                    "colour images are read from .exr, .hdr, .pfm, .png, .jpg, .bmp and .tga"
                        .to_owned();
                return Err(Problem::Unsupported(message).at(path));
            }
        };
        image.check_finite().map_err(|problem| problem.at(path))?;
        Ok(image)
    }

    /// Makes an image from an array of linear values: rows from the top and columns, or three axes
    /// with one or three channels.
    ///
    /// # Errors
    ///
    /// Another shape, no pixels, and NaN or infinite values.
    pub fn of_tensor(tensor: &Tensor) -> Result<Self, Problem> {
        let (height, width, channels) = match *tensor.shape() {
            [height, width] => (height, width, 1),
            [height, width, channels @ (1 | 3)] => (height, width, channels),
            _ => (0, 0, 1),
        };
        if tensor.is_empty() || height * width * channels != tensor.len() {
            return Err(Problem::Mismatch {
                expected: "pixels as rows and columns, and perhaps one or three channels"
                    .to_owned(),
                found: format!("an array of shape {:?}", tensor.shape()),
            });
        }
        let value =
            |pixel: usize, c: usize| tensor.get(channels * pixel + c.min(channels - 1)) as f32;
        let pixel = |i| std::array::from_fn(|c| value(i, c));
        let image = RgbImage {
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
        };
        image.check_finite()?;
        Ok(image)
    }

    /// Returns true if the numbers in an image file, by its extension, are encoded as in sRGB.
    /// Reading the image decodes them.
    pub fn is_encoded(path: &Path) -> bool {
        let extension = path.extension().and_then(|e| e.to_str());
        let linear = ["exr", "hdr", "rgbe", "pfm"];
        !extension.is_some_and(|e| linear.iter().any(|l| e.eq_ignore_ascii_case(l)))
    }

    /// Reads the bytes of a `.bmp` file, as [`RgbImage::read_within`].
    ///
    /// # Errors
    ///
    /// As for [`RgbImage::read_within`], except errors of the file system.
    pub fn decode_bmp(bytes: &[u8], limits: Limits) -> Result<Self, Problem> {
        encoded::decode(bytes, (ImageFormat::Bmp, "BMP"), limits)
    }

    /// Reads the bytes of a `.tga` file, as [`RgbImage::read_within`].
    ///
    /// # Errors
    ///
    /// As for [`RgbImage::read_within`], except errors of the file system.
    pub fn decode_tga(bytes: &[u8], limits: Limits) -> Result<Self, Problem> {
        encoded::decode(bytes, (ImageFormat::Tga, "TGA"), limits)
    }

    fn check_finite(&self) -> Result<(), Problem> {
        let bad = |pixel: &[f32; 3]| pixel.iter().any(|v| !v.is_finite());
        let Some(index) = self.pixels.iter().position(bad) else {
            return Ok(());
        };
        let count = self.pixels.iter().filter(|p| bad(p)).count();
        let (x, y) = (index % self.width, index / self.width);
        let place = match count {
            1 => format!("pixel ({x}, {y})"),
            _ => format!("pixel ({x}, {y}), the first of {count},"),
        };
        let value = self.pixels[index].into_iter().find(|v| !v.is_finite());
        Err(Problem::NotFinite {
            place,
            value: value.map_or(f64::NAN, f64::from),
        })
    }
}
