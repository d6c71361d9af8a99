//! Renders as images of several layers.

mod naming;
mod picture;

pub use naming::Naming;
pub use picture::Picture;

use crate::image::{ImageLayers, Layer};
use transport::render::{Rendering, StrategyImage};

/// What each strategy of a render found, in layers such as `s1t2.weighted` (its share: these add up to
/// the main layer, which is the image) and `s1t2.unweighted` (all that it can find, on its own).
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

/// A layer from channels that are interleaved.
fn layer(name: &str, values: &[f32], channels: &[String]) -> Layer {
    let planes = planes(values, channels.len());
    Layer {
        name: name.into(),
        channels: channels.iter().cloned().zip(planes).collect(),
    }
}

/// Channels that are interleaved, one by one.
fn planes(values: &[f32], channels: usize) -> impl Iterator<Item = Vec<f32>> {
    (0..channels).map(move |c| values.iter().skip(c).step_by(channels).copied().collect())
}
