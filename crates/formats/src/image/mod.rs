//! Images: layers of named channels, written to EXR, NPY and PNG and read back; what a screen shows of them.

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

pub use open::{channel_name, unknown_format};

use std::path::Path;

use ::image::ImageFormat;

use crate::error::{FileError, Problem};
use crate::input::Limits;
use crate::tensor::Tensor;

/// An image of several layers with named channels, as EXR files hold it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageLayers {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The layers. The main layer has an empty name.
    pub layers: Vec<Layer>,
    /// Text about the image, by name: the hash of its scene, its seed, ... EXR reserves some names,
    /// such as `version`, `type`, `name`, `comments` and `owner`.
    pub attributes: Vec<(String, String)>,
}

/// One layer of an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// Its name, for example `variance`; empty for the main layer.
    pub name: String,
    /// The channels, for example `R`, each with its values row by row from the top left.
    pub channels: Vec<(String, Vec<f32>)>,
}

/// Name of the layer with the variances of another.
fn variance_of(layer: &str) -> String {
    match layer {
        "" => "variance".to_owned(),
        _ => format!("variance.{layer}"),
    }
}

impl Layer {
    /// The channel with this name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, values)| values.as_slice())
    }

    /// The channels R, G and B, if it has all of them.
    fn colours(&self) -> Option<[&[f32]; 3]> {
        let [red, green, blue] = ["R", "G", "B"].map(|name| self.channel(name));
        Some([red?, green?, blue?])
    }
}

impl ImageLayers {
    /// The layer with this name; the main layer's is empty.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// The attribute with this name.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, value)| value.as_str())
    }

    /// The main layer in colour: its R, G and B, or its Y in all three.
    pub fn rgb(&self) -> Option<RgbImage> {
        let main = self.layer("")?;
        let grey = || Some([main.channel("Y")?; 3]);
        Some(self.of_channels(main.colours().or_else(grey)?))
    }

    /// The main layer in colour, or the only layer that has R, G and B.
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

    /// Refuses an image without pixels and channels that do not fit its size.
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

/// A colour image with linear values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RgbImage {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels row by row from the top left.
    pub pixels: Vec<[f32; 3]>,
}

impl RgbImage {
    /// Reads a colour image, such as an environment map, from an `.exr`, `.hdr` (`.rgbe`), `.pfm`, `.png`,
    /// `.jpg`, `.bmp` or `.tga` file, by its extension. Values of the latter four are taken as sRGB and made linear. Of an `.exr`
    /// file without main layer, the only layer that has R, G and B is read.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is no valid image, and NaN or infinite values.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::read_within(path, Limits::default())
    }

    /// As [`RgbImage::read`], of a file that may take so much memory.
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

    /// An array of linear values: rows from the top and columns, or three axes with one or three channels.
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

    /// Whether the numbers in an image file, by its extension, are encoded as in sRGB; reading the image decodes them.
    pub fn is_encoded(path: &Path) -> bool {
        let extension = path.extension().and_then(|e| e.to_str());
        let linear = ["exr", "hdr", "rgbe", "pfm"];
        !extension.is_some_and(|e| linear.iter().any(|l| e.eq_ignore_ascii_case(l)))
    }

    /// As [`RgbImage::read_within`], of the bytes of a `.bmp` file.
    ///
    /// # Errors
    ///
    /// As for [`RgbImage::read_within`], but for the file system.
    pub fn decode_bmp(bytes: &[u8], limits: Limits) -> Result<Self, Problem> {
        encoded::decode(bytes, (ImageFormat::Bmp, "BMP"), limits)
    }

    /// As [`RgbImage::read_within`], of the bytes of a `.tga` file.
    ///
    /// # Errors
    ///
    /// As for [`RgbImage::read_within`], but for the file system.
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
