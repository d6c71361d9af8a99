//! Image files, comparisons and thumbnails.

use crate::errors;
use crate::numbers::{array, ask_for_memory};
use io::compare::compare as differences;
use io::compare::flip::flip;
use io::image::exposure::Exposure;
use io::image::png::{Depth, encode};
use io::image::tone::Curve;
use io::image::{ImageLayers, Layer};
use io::{Limits, Problem};
use numpy::ndarray::Axis;
use numpy::{AllowTypeChange, PyArrayDyn, PyArrayLike3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use serde_json::json;
use std::path::PathBuf;

/// Layers of an image: name, names of channels, values (height, width, channels).
pub type Given<'py> = Vec<(String, Vec<String>, PyArrayLike3<'py, f32, AllowTypeChange>)>;
/// Values of a layer, (height, width, channels).
pub type Values<'py> = Bound<'py, PyArrayDyn<f32>>;
/// Layers of an image, as they are returned.
type LayerArrays<'py> = Vec<(String, Vec<String>, Values<'py>)>;
/// Memory for each value of an image while it is written or compared, in bytes: for a copy, for
/// double precision, and for compressed or filtered values.
const BYTES_PER_VALUE: usize = size_of::<f32>() + 2 * size_of::<f64>();
/// Texts by name.
pub type Attributes = Vec<(String, String)>;

/// Reads all layers and attributes of an image.
#[pyfunction]
pub fn read_image(
    py: Python<'_>,
    path: PathBuf,
    memory: Option<u64>,
) -> PyResult<(LayerArrays<'_>, Attributes)> {
    let image = py.detach(|| ImageLayers::read_within(&path, Limits { memory }));
    let image = image.map_err(|e| errors::file(&e))?;
    let size = [image.height, image.width];
    let found = |layer: Layer| {
        let values = layer_values(py, size, &layer)?;
        let names = layer.channels.into_iter().map(|(name, _)| name);
        Ok((layer.name, names.collect(), values))
    };
    let layers: PyResult<LayerArrays> = image.layers.into_iter().map(found).collect();
    Ok((layers?, image.attributes))
}

/// Makes an array of the values of a layer.
pub fn layer_values<'py>(
    py: Python<'py>,
    [height, width]: [usize; 2],
    layer: &Layer,
) -> PyResult<Values<'py>> {
    let planes = layer.channels.iter();
    let pixel = |i: usize| planes.clone().map(move |(_, plane)| plane[i]);
    let values = (0..height * width).flat_map(pixel).collect();
    array(py, values, &[height, width, layer.channels.len()])
}

/// Writes an image: all layers to an `.exr` file, the first layer to an `.npy` or `.png` file. A
/// PNG file is brightened by `exposure` stops, by default by an automatic number.
#[pyfunction]
pub fn write_image(
    path: PathBuf,
    layers: Given<'_>,
    attributes: Attributes,
    exposure: Option<f64>,
) -> PyResult<()> {
    let image = ImageLayers {
        attributes,
        ..image(&layers)?
    };
    let written = image.write_exposed(&path, exposed(exposure));
    written.map_err(|e| errors::file(&e))
}

/// Encodes the first layer for a screen, as the bytes of a PNG file.
#[pyfunction]
pub fn encode_png(layers: Given<'_>) -> PyResult<Vec<u8>> {
    let shown = image(&layers)?.on_screen().unwrap_or_default();
    let tone = Exposure::Auto.tone(Curve::default(), &shown);
    encode(&shown, Depth::Eight, tone).map_err(|e| errors::render(e.to_string()))
}

/// Returns the number of stops by which PNG files of the first layer are brightened.
#[pyfunction]
pub fn exposure(layers: Given<'_>) -> PyResult<f64> {
    let shown = image(&layers)?.on_screen().unwrap_or_default();
    Ok(Exposure::of(shown.pixels.into_iter()))
}

/// Converts a number of stops; `None` is an automatic number.
pub fn exposed(stops: Option<f64>) -> Exposure {
    stops.map_or(Exposure::Auto, Exposure::Stops)
}

/// Compares an image with a reference: numbers as JSON, and the map of visible differences.
#[pyfunction]
pub fn compare_images<'py>(
    py: Python<'py>,
    given: Given<'py>,
    reference: Given<'py>,
    block: usize,
) -> PyResult<(String, Bound<'py, PyArrayDyn<f32>>)> {
    let (given, reference) = (image(&given)?, image(&reference)?);
    let compared = py.detach(|| {
        let numbers = differences(&given, &reference, block)?;
        let shown = |image: &ImageLayers| image.on_screen().unwrap_or_default();
        Ok((numbers, flip(&shown(&given), &shown(&reference))?))
    });
    let (numbers, seen) = compared.map_err(|e: Problem| errors::render(e.to_string()))?;
    let z = numbers.z.as_ref().map(|z| {
        json!({
            "count": z.count,
            "mean_square": z.mean_square,
            "beyond_three": z.beyond_three,
            "limit": z.limit,
            "largest": z.worst.as_ref().map(|w| w.z.abs()),
            "channel": z.worst.as_ref().map(|w| &w.channel),
            "pixel": z.worst.as_ref().map(|w| w.pixel),
        })
    });
    let numbers = json!({
        "means": numbers.means,
        "rmse": numbers.rmse,
        "relative_mse": finite(numbers.relative_mse),
        "psnr": finite(numbers.psnr),
        "largest": numbers.largest,
        "z": z,
    });
    let map = array(py, seen, &[given.height, given.width])?;
    Ok((numbers.to_string(), map))
}

/// Converts infinities and NaN, which JSON does not have, to `None`.
fn finite(v: f64) -> Option<f64> {
    v.is_finite().then_some(v)
}

/// Converts layers to an image without attributes.
pub fn image(layers: &Given<'_>) -> PyResult<ImageLayers> {
    let count = layers.iter().map(|(_, _, values)| values.len()).sum();
    ask_for_memory(count, BYTES_PER_VALUE, "image")?;
    let shape = layers
        .first()
        .map_or(&[0, 0, 0][..], |(_, _, values)| values.shape());
    let layer = |(name, channels, values): &(
        String,
        Vec<String>,
        PyArrayLike3<'_, f32, AllowTypeChange>,
    )| {
        let values = values.as_array();
        let plane = |c: usize| values.index_axis(Axis(2), c).iter().copied().collect();
        let channels = channels.iter().take(values.shape()[2]).cloned().enumerate();
        Layer {
            name: name.clone(),
            channels: channels.map(|(c, name)| (name, plane(c))).collect(),
        }
    };
    Ok(ImageLayers {
        width: shape[1],
        height: shape[0],
        layers: layers.iter().map(layer).collect(),
        attributes: Vec::new(),
    })
}
