//! Conversion of renders to images with several layers.

mod naming;
mod picture;

pub use naming::Naming;
pub use picture::Picture;

use crate::image::{ImageLayers, Layer};
use transport::render::{Rendering, StrategyImage};

/// Returns the images of a render's strategies. A layer such as `s1t2.weighted` is the weighted
/// contribution of a strategy; these layers add up to the main layer, which is the image. A layer
/// such as `s1t2.unweighted` is the strategy's estimate without the others.
pub fn strategies(
    rendering: &Rendering,
    names: &[String],
    attributes: Vec<(String, String)>,
) -> ImageLayers {
    let mut layers = vec![layer("", &rendering.film.mean(), names)];
    for StrategyImage {
        s,
        t,
        weighted,
        unweighted,
    } in &rendering.strategies
    {
        for (kind, film) in [("weighted", weighted), ("unweighted", unweighted)] {
            layers.push(layer(&format!("s{s}t{t}.{kind}"), &film.mean(), names));
        }
    }
    ImageLayers {
        width: rendering.film.width(),
        height: rendering.film.height(),
        layers,
        attributes,
    }
}

/// Makes a layer from interleaved channels.
fn layer(name: &str, values: &[f32], channels: &[String]) -> Layer {
    let planes = planes(values, channels.len());
    Layer {
        name: name.into(),
        channels: channels.iter().cloned().zip(planes).collect(),
    }
}

/// Separates interleaved channels.
fn planes(values: &[f32], channels: usize) -> impl Iterator<Item = Vec<f32>> {
    (0..channels).map(move |c| values.iter().skip(c).step_by(channels).copied().collect())
}
