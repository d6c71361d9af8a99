//! OpenEXR files.
//!
//! All layers share one part: a channel `R` of the layer `variance` is stored as `variance.R`, as
//! viewers and compositors expect. Samples are 32-bit floats with lossless ZIP compression.

use std::collections::HashSet;
use std::io::{Cursor, ErrorKind, Read, Seek, Write};
use std::path::Path;

use exr::block::lines::LineRefMut;
use exr::error::Error;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::MetaData;
use exr::meta::attribute::{Chromaticities, LevelMode, SampleType};
use exr::meta::header::Header;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, LayerAttributes,
    ReadChannels, ReadLayers, Text, Vec2, WritableImage,
};

use super::{ImageLayers, Layer, exr_header};
use crate::atomic;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Maximum memory for each sample while reading, in bytes. A sample exists in the file's format, in
/// this crate's format, and in a block before and after unpacking. The block may be the whole
/// image.
const BYTES_PER_SAMPLE: u64 = 16;
/// Maximum length of the name of a channel or an attribute in the format, in bytes.
const MAX_NAME: usize = 255;

/// Primaries and white (D65) of red, green and blue: ITU-R BT.709. Readers assume them if a file
/// has no chromaticities.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.3, 0.6),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.329),
};

type Flat = exr::prelude::Layer<AnyChannels<FlatSamples>>;

/// Content of an EXR file without the values of its channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrHeader {
    /// Number of pixels per row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Names of the channels with their layers, such as `variance.R`.
    pub channels: Vec<String>,
    /// Texts by name, as in [`ImageLayers::attributes`].
    pub attributes: Vec<(String, String)>,
}

/// Writes an image, completely or not at all. Equal images give equal bytes.
///
/// # Errors
///
/// An image without pixels; channels that do not have its size; names that are empty, too long,
/// duplicate or reserved by the format; and all errors of [`atomic::write()`].
pub fn write(path: &Path, image: &ImageLayers) -> Result<(), FileError> {
    image.check().map_err(|problem| problem.at(path))?;
    let planes: Vec<&[f32]> = planes(image).collect();
    write_values(path, &frame(image), |channel, pixel| planes[channel][pixel])
}

/// Writes an image whose values are computed during writing. `value` returns the value of a
/// channel, by its index in `frame`, at a pixel, row by row from the top left.
///
/// # Errors
///
/// Fails like [`write()`].
pub fn write_values(
    path: &Path,
    frame: &ExrHeader,
    value: impl Fn(usize, usize) -> f32 + Sync,
) -> Result<(), FileError> {
    frame.check().map_err(|problem| problem.at(path))?;
    atomic::write(path, |file| {
        encode_to(&mut *file, frame, &value).map_err(|e| match e {
            Error::Io(error) => error,
            other => std::io::Error::other(format!("cannot be stored as EXR: {other}")),
        })?;
        exr_header::sort_in_file(file)
    })
}

/// Encodes an image as an EXR file.
///
/// # Errors
///
/// Fails like [`write()`], except for errors of the file system.
pub fn encode(image: &ImageLayers) -> Result<Vec<u8>, Problem> {
    image.check()?;
    let frame = frame(image);
    frame.check()?;
    let planes: Vec<&[f32]> = planes(image).collect();
    let mut bytes = Vec::new();
    let value = |channel: usize, pixel: usize| planes[channel][pixel];
    let written = encode_to(&mut Cursor::new(&mut bytes), &frame, &value);
    written.map_err(|e| Problem::Malformed(format!("cannot be stored as EXR: {e}")))?;
    exr_header::sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Encodes an image. Attributes stay in the encoder's order, which changes from run to run.
fn encode_to(
    writer: &mut (impl Write + Seek),
    frame: &ExrHeader,
    value: &(impl Fn(usize, usize) -> f32 + Sync),
) -> Result<(), Error> {
    let mut attributes = LayerAttributes {
        software_name: Some(text(concat!("morgana ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    let others = frame.attributes.iter();
    let others = others.map(|(name, value)| (text(name), AttributeValue::Text(text(value))));
    attributes.other.extend(others);
    let channels = frame.channels.iter().enumerate().map(|(channel, name)| {
        let samples = Computed {
            channel,
            width: frame.width,
            value,
        };
        AnyChannel::new(text(name), samples)
    });
    let size = Vec2(frame.width, frame.height);
    let channels = AnyChannels::sort(channels.collect());
    let layer = exr::prelude::Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels);
    let mut file = Image::from_layer(layer);
    file.attributes.chromaticities = Some(REC_709);
    file.write().to_buffered(writer)
}

/// Samples of one channel that are computed during writing.
struct Computed<'a, F> {
    channel: usize,
    width: usize,
    value: &'a F,
}

impl<'s, F: Fn(usize, usize) -> f32 + Sync + 's> WritableSamples<'s> for Computed<'_, F> {
    type Writer = Computed<'s, F>;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'s self, _: &Header) -> Self::Writer {
        Computed { ..*self }
    }
}

impl<F: Fn(usize, usize) -> f32 + Sync> SamplesWriter for Computed<'_, F> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let Vec2(x, y) = line.location.position;
        let start = y * self.width + x;
        let written = line.write_samples(|i| (self.value)(self.channel, start + i));
        debug_assert!(written.is_ok(), "lines lie in memory");
    }
}

impl ExrHeader {
    fn check(&self) -> Result<(), Problem> {
        let mut names = HashSet::new();
        for name in &self.channels {
            let own = name.rsplit_once('.').map_or(name.as_str(), |(_, own)| own);
            check_name("channel", own)?;
            check_name("channel", name)?;
            if !names.insert(name) {
                return Err(taken("channel", own));
            }
        }
        let mut names = HashSet::new();
        for (name, _) in &self.attributes {
            check_name("attribute", name)?;
            if !names.insert(name) {
                return Err(taken("attribute", name));
            }
        }
        Ok(())
    }
}

fn frame(image: &ImageLayers) -> ExrHeader {
    let names = image.layers.iter().flat_map(|layer| {
        let names = layer.channels.iter().map(|(name, _)| name);
        names.map(|name| channel_name(&layer.name, name))
    });
    ExrHeader {
        width: image.width,
        height: image.height,
        channels: names.collect(),
        attributes: image.attributes.clone(),
    }
}

/// Returns the name of a layer's channel in a file.
pub fn channel_name(layer: &str, channel: &str) -> String {
    match layer {
        "" => channel.to_owned(),
        layer => format!("{layer}.{channel}"),
    }
}

fn planes(image: &ImageLayers) -> impl Iterator<Item = &[f32]> {
    let channels = image.layers.iter().flat_map(|layer| &layer.channels);
    channels.map(|(_, values)| values.as_slice())
}

fn check_name(what: &str, name: &str) -> Result<(), Problem> {
    if name.is_empty() || name.len() > MAX_NAME || name.contains('\0') {
        let message = format!("the {what} name '{name}' is empty, too long or holds a zero byte");
        return Err(Problem::Malformed(message));
    }
    Ok(())
}

fn taken(what: &str, name: &str) -> Problem {
    Problem::Malformed(format!("two {what}s have the name '{name}'"))
}

/// Converts a text, which is stored as UTF-8.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Reads all layers, and the attributes that are texts. Layers may be in separate parts.
///
/// # Errors
///
/// A file that cannot be read or is not a valid EXR file, deep data, and parts of different sizes.
pub fn read(path: &Path) -> Result<ImageLayers, FileError> {
    read_within(path, Limits::default())
}

/// Reads a file within a limit of memory, as [`read`].
///
/// # Errors
///
/// As for [`read`].
pub fn read_within(path: &Path, limits: Limits) -> Result<ImageLayers, FileError> {
    let (reader, size) = input::open(path)?;
    decode_from(reader, size, limits).map_err(|problem| problem.at(path))
}

/// Reads an image from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn decode(bytes: &[u8]) -> Result<ImageLayers, Problem> {
    decode_within(bytes, Limits::default())
}

/// Reads an image from the bytes of a file within a limit of memory, as [`decode`].
///
/// # Errors
///
/// As for [`read`].
pub fn decode_within(bytes: &[u8], limits: Limits) -> Result<ImageLayers, Problem> {
    decode_from(Cursor::new(bytes), bytes.len() as u64, limits)
}

fn decode_from(
    mut reader: impl Read + Seek,
    size: u64,
    limits: Limits,
) -> Result<ImageLayers, Problem> {
    let metadata = MetaData::read_from_buffered(&mut reader, false).map_err(describe)?;
    limits.check(samples(&metadata)?, BYTES_PER_SAMPLE, size)?;
    reader.rewind().map_err(Problem::Read)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels();
    let image = image.all_layers().all_attributes().non_parallel();
    let image = image.from_buffered(reader).map_err(describe)?;
    let mut result = ImageLayers::default();
    let Some(first) = image.layer_data.first() else {
        return Err(Problem::Empty("the file has no layers".to_owned()));
    };
    let size = first.size;
    (result.width, result.height) = (size.width(), size.height());
    for layer in image.layer_data {
        if layer.size != size {
            return Err(Problem::Unsupported("layers of different sizes".to_owned()));
        }
        add_part(&mut result, layer)?;
    }
    result.attributes.sort();
    result.check()?;
    Ok(result)
}

/// Returns the number of samples of all channels.
fn samples(metadata: &MetaData) -> Result<u64, Problem> {
    let samples = |header: &Header| {
        let Vec2(width, height) = header.layer_size;
        width
            .checked_mul(height)?
            .checked_mul(header.channels.list.len())
    };
    let headers = &mut metadata.headers.iter();
    let total = headers.try_fold(0usize, |n, h| n.checked_add(samples(h)?));
    let too_large = || Problem::TooLarge("more than 2^64 samples".into());
    total.map(|n| n as u64).ok_or_else(too_large)
}

fn add_part(image: &mut ImageLayers, part: Flat) -> Result<(), Problem> {
    let part_name = part
        .attributes
        .layer_name
        .as_ref()
        .map(string)
        .unwrap_or_default();
    for (name, value) in &part.attributes.other {
        if let AttributeValue::Text(value) = value {
            image.attributes.push((string(name), string(value)));
        }
    }
    for channel in part.channel_data.list {
        if channel.sampling != Vec2(1, 1) {
            return Err(Problem::Unsupported(
                "channels of lower resolution".to_owned(),
            ));
        }
        let full = string(&channel.name);
        let (layer, name) = full.rsplit_once('.').unwrap_or(("", &full));
        let layer = [part_name.as_str(), layer]
            .into_iter()
            .filter(|s| !s.is_empty());
        let layer = layer.collect::<Vec<_>>().join(".");
        let values = match channel.sample_data {
            FlatSamples::F32(values) => values,
            other => other.values_as_f32().collect(),
        };
        layer_mut(image, layer)
            .channels
            .push((name.to_owned(), values));
    }
    Ok(())
}

fn layer_mut(image: &mut ImageLayers, name: String) -> &mut Layer {
    let index = image
        .layers
        .iter()
        .position(|l| l.name == name)
        .unwrap_or_else(|| {
            image.layers.push(Layer {
                name,
                channels: Vec::new(),
            });
            image.layers.len() - 1
        });
    &mut image.layers[index]
}

fn describe(error: Error) -> Problem {
    match error {
        // Report a damaged file: the decoder seeks to a position outside it.
        Error::Io(error) if error.kind() == ErrorKind::InvalidInput => Problem::WrongFormat {
            format: "EXR",
            reason: "the file is damaged: its table refers to pixels outside of it".into(),
        },
        Error::Io(error) => Problem::Read(error),
        Error::NotSupported(what) => Problem::Unsupported(what.into_owned()),
        other => Problem::WrongFormat {
            format: "EXR",
            reason: other.to_string(),
        },
    }
}
