//! Denoising by a denoiser that Python calls.

use crate::errors;
use crate::image::{Attributes, Given, Values, image, layer_values};
use crate::numbers::array;
use io::Problem;
use io::image::RgbImage;
use io::image::denoised::{DIFFERENCE, DenoiseOptions, Denoising, LAYER};
use numpy::{AllowTypeChange, PyArrayDyn, PyArrayLike3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Denoised values, their differences from the estimate in standard errors, and attributes. The
/// fractions are of values that changed by more than three standard errors, and of changed values
/// without a standard error.
type Found<'py> = (
    Values<'py>,
    Option<Values<'py>>,
    Option<(f64, f64)>,
    Attributes,
);

/// Denoises an image by a function of colours and a dictionary of guides, both arrays (height,
/// width, 3). `given` names the layers `albedo`, `normal` and `error` that the user passed; if
/// `guides` is true, other layers may guide the denoiser.
#[pyfunction]
pub fn denoise<'py>(
    py: Python<'py>,
    mut layers: Given<'py>,
    attributes: Attributes,
    given: Vec<String>,
    guides: bool,
    denoiser: &Bound<'py, PyAny>,
) -> PyResult<Found<'py>> {
    let given = |name: &str| given.iter().any(|n| n == name).then(|| name.to_owned());
    let options = DenoiseOptions {
        layer: String::new(),
        albedo: given("albedo"),
        normal: given("normal"),
        errors: given("error"),
        usual_guides: guides,
    };
    layers.retain(|(name, ..)| options.uses(name));
    let image = io::image::ImageLayers {
        attributes,
        ..image(&layers)?
    };
    let refused = |e: Problem| errors::render(e.to_string());
    let denoising = py.detach(|| Denoising::new(image, &options));
    let denoising = denoising.map_err(refused)?;
    let guides = PyDict::new(py);
    for (name, guide) in [("albedo", &denoising.albedo), ("normal", &denoising.normal)] {
        if let Some(guide) = guide {
            guides.set_item(name, colours(py, &guide.image)?)?;
        }
    }
    let answer = |noisy: &RgbImage| answered(&denoiser.call1((colours(py, noisy)?, &guides))?);
    let parts = denoising.parts.iter();
    let answers: PyResult<Vec<_>> = parts.map(|part| answer(&part.image)).collect();
    let found = denoising.finish(&answers?, "Open Image Denoise (pyoidn)");
    let found = found.map_err(refused)?;
    let values = |name| {
        let layer = found.image.layer(name);
        layer.map(|layer| layer_values(py, [found.image.height, found.image.width], layer))
    };
    let denoised = values(LAYER).transpose()?;
    Ok((
        denoised.ok_or_else(|| errors::render("the denoiser returned no image"))?,
        values(DIFFERENCE).transpose()?,
        found.moved.map(|m| (m.beyond_three, m.unknown)),
        found.image.attributes,
    ))
}

fn colours<'py>(py: Python<'py>, image: &RgbImage) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let values = image.pixels.as_flattened().to_vec();
    array(py, values, &[image.height, image.width, 3])
}

/// Converts an image that the denoiser returned.
fn answered(returned: &Bound<'_, PyAny>) -> PyResult<RgbImage> {
    let values: PyArrayLike3<'_, f32, AllowTypeChange> = returned.extract()?;
    let [height, width, 3] = *values.shape() else {
        return Err(errors::render(
            "the denoiser returned no image of three channels",
        ));
    };
    let values: Vec<f32> = values.as_array().iter().copied().collect();
    Ok(RgbImage {
        width,
        height,
        pixels: values.as_chunks().0.to_vec(),
    })
}
