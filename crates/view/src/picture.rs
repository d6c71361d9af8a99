//! Images whose planes are shared with the responses that send them.

use io::Problem;
use io::arrays::Array;
use io::image::exposure::Exposure;
use io::image::{ImageLayers, Layer};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::sync::Arc;
use transport::Film;

/// Values of a channel, row by row from the top left.
pub(crate) type Plane = Arc<Vec<f32>>;

/// Image of layers with named channels.
#[derive(Clone, Debug, Default)]
pub(crate) struct Picture {
    pub(crate) width: usize,
    pub(crate) height: usize,
    layers: Vec<PictureLayer>,
    attributes: Vec<(String, String)>,
}

#[derive(Clone, Debug)]
struct PictureLayer {
    name: String,
    channels: Vec<(String, Plane)>,
}

impl Picture {
    pub(crate) fn of(image: ImageLayers) -> Self {
        let layer = |layer: Layer| PictureLayer {
            name: layer.name,
            channels: (layer.channels.into_iter())
                .map(|(name, values)| (name, Arc::new(values)))
                .collect(),
        };
        Picture {
            width: image.width,
            height: image.height,
            layers: image.layers.into_iter().map(layer).collect(),
            attributes: image.attributes,
        }
    }

    /// Makes an image from an array `[row, column]` or `[row, column, channel]`: three channels are
    /// red, green and blue, a fourth is opacity.
    pub(crate) fn of_array(array: &Array) -> Self {
        let [height, width] = [array.shape[0], array.shape[1]];
        let count = array.shape.get(2).copied().unwrap_or(1);
        let name = |c: usize| match count {
            1 => "Y".to_owned(),
            3 | 4 => ["R", "G", "B", "A"][c].to_owned(),
            _ => c.to_string(),
        };
        let plane = |c: usize| array.data.iter().skip(c).step_by(count);
        let channels = (0..count).map(|c| {
            let values = plane(c).map(|v| *v as f32).collect();
            (name(c), Arc::new(values))
        });
        Picture {
            width,
            height,
            layers: vec![PictureLayer {
                name: String::new(),
                channels: channels.collect(),
            }],
            attributes: Vec::new(),
        }
    }

    /// Makes an image from the current state of a film: means, their variances, and numbers of
    /// samples.
    pub(crate) fn of_film(film: &Film, channels: &[String]) -> Self {
        let pixels = 0..film.width() * film.height();
        let planes = |value: &(dyn Fn(usize, usize) -> f32 + Sync)| {
            // Use the threads of the render, which are idle meanwhile.
            let values = |c| pixels.clone().into_par_iter().map(move |i| value(c, i));
            let plane = |c| Arc::new(values(c).collect());
            let named = channels.iter().enumerate();
            named.map(|(c, name)| (name.clone(), plane(c))).collect()
        };
        let layer = |name: &str, channels| PictureLayer {
            name: name.into(),
            channels,
        };
        let samples = pixels.clone().map(|i| film.count(i) as f32).collect();
        Picture {
            width: film.width(),
            height: film.height(),
            layers: vec![
                layer("", planes(&|c, i| film.mean_at(None, c, i))),
                layer("variance", planes(&|c, i| film.variance_at(None, c, i))),
                layer("samples", vec![("N".into(), Arc::new(samples))]),
            ],
            attributes: Vec::new(),
        }
    }

    /// Returns the values of a channel.
    pub(crate) fn plane(&self, layer: &str, channel: &str) -> Option<Plane> {
        let layer = self.layers.iter().find(|l| l.name == layer)?;
        let found = layer.channels.iter().find(|(name, _)| name == channel);
        found.map(|(_, values)| values.clone())
    }

    /// Returns a layer, with its variance, as a separate image.
    ///
    /// # Errors
    ///
    /// A layer that does not exist.
    pub(crate) fn focused(&self, layer: &str) -> Result<ImageLayers, Problem> {
        let variance = match layer {
            "" => "variance".to_owned(),
            _ => format!("variance.{layer}"),
        };
        let wanted = self.layers.iter();
        let wanted = wanted.filter(|l| l.name == layer || l.name == variance);
        let copy = |layer: &PictureLayer| Layer {
            name: layer.name.clone(),
            channels: (layer.channels.iter())
                .map(|(name, values)| (name.clone(), values.to_vec()))
                .collect(),
        };
        self.image(wanted.map(copy).collect()).focused(layer)
    }

    /// Returns all layers as an image.
    pub(crate) fn whole(&self) -> ImageLayers {
        let copy = |layer: &PictureLayer| Layer {
            name: layer.name.clone(),
            channels: (layer.channels.iter())
                .map(|(name, values)| (name.clone(), values.to_vec()))
                .collect(),
        };
        self.image(self.layers.iter().map(copy).collect())
    }

    fn image(&self, layers: Vec<Layer>) -> ImageLayers {
        ImageLayers {
            width: self.width,
            height: self.height,
            layers,
            attributes: self.attributes.clone(),
        }
    }

    /// Returns the automatic exposure of the main layer, or of the first layer without one, in
    /// stops.
    pub(crate) fn exposure(&self) -> f64 {
        let first = self.layers.iter().find(|l| l.name.is_empty());
        let first = first.or(self.layers.first());
        let shown = first.and_then(|l| self.focused(&l.name).ok()?.on_screen());
        let shown = shown.unwrap_or_default();
        Exposure::Auto.stops(shown.pixels.iter().copied())
    }

    /// Returns the size, layers, channels and attributes.
    pub(crate) fn json(&self) -> Value {
        let layer = |layer: &PictureLayer| {
            let channels: Vec<&String> = layer.channels.iter().map(|(name, _)| name).collect();
            json!({ "name": layer.name, "channels": channels })
        };
        let attributes = self.attributes.iter();
        let attributes = attributes.map(|(name, value)| json!([name, value]));
        json!({
            "width": self.width,
            "height": self.height,
            "layers": self.layers.iter().map(layer).collect::<Vec<_>>(),
            "attributes": attributes.collect::<Vec<_>>(),
            "exposure": self.exposure(),
        })
    }
}
