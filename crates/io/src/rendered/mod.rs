//! Renders as images of several layers.

mod naming;

pub use naming::{Naming, extend};

use crate::image::{ImageLayers, Layer};
use transport::Film;
use transport::render::{Rendering, StrategyImage};

/// A film as an image: its mean, and layers `variance` (of the mean), `samples` (their number), and
/// `reweighted` if it was asked for.
pub fn layers(film: &Film, names: &[String], attributes: Vec<(String, String)>) -> ImageLayers {
    let counts = film.counts().into_iter().map(|n| n as f32).collect();
    let samples = Layer {
        name: "samples".into(),
        channels: vec![("N".into(), counts)],
    };
    let mut layers = vec![
        layer("", &film.mean(), names),
        layer("variance", &film.variance(), names),
        samples,
    ];
    let reweighted = film.reweighted();
    layers.extend(reweighted.map(|values| layer("reweighted", &values, names)));
    image(film, layers, attributes)
}

/// Of photon maps, layers `bias` (what is known of that of every pixel) and `bound` (which the error by bias and
/// noise exceeds in one of twenty pixels at most).
pub fn bias(rendering: &Rendering, names: &[String]) -> Vec<Layer> {
    let layers = rendering.debiased.iter().flat_map(|debiased| {
        let film = &rendering.film;
        [
            layer("bias", &debiased.pixel_bias(film), names),
            layer("bound", &debiased.bound(film), names),
        ]
    });
    layers.collect()
}

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
    image(&rendering.film, layers, attributes)
}

/// A layer from channels that are interleaved.
pub fn layer(name: &str, values: &[f32], channels: &[String]) -> Layer {
    let planes = planes(values, channels.len());
    Layer {
        name: name.into(),
        channels: channels.iter().cloned().zip(planes).collect(),
    }
}

fn image(film: &Film, layers: Vec<Layer>, attributes: Vec<(String, String)>) -> ImageLayers {
    ImageLayers {
        width: film.width(),
        height: film.height(),
        layers,
        attributes,
    }
}

/// Channels that are interleaved, one by one.
fn planes(values: &[f32], channels: usize) -> impl Iterator<Item = Vec<f32>> {
    (0..channels).map(move |c| values.iter().skip(c).step_by(channels).copied().collect())
}
