//! Renders as pictures with several layers.

use super::Naming;
use crate::assemble::{Loaded, NamedQuantity};
use crate::error::FileError;
use crate::image::exposure::Exposure;
use crate::image::tone::{Curve, Tone};
use crate::image::{ImageLayers, Layer, channel_name, exr, png, unknown_format};
use crate::npy;
use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;
use transport::Film;
use transport::render::Rendering;

/// A render as a picture. Values are computed on request: a film is large, and writing a file does
/// not need a second copy.
#[derive(Debug)]
pub struct Picture<'a> {
    film: &'a Film,
    channels: Cow<'a, [String]>,
    /// Name of the single channel of sample counts.
    count: [String; 1],
    /// Quantities besides light.
    quantities: Option<Beside<'a>>,
    /// Second moments of quantities, which the film holds besides light or instead of it.
    squares: Squares,
    /// Names of layers, if light is separated.
    naming: Option<Naming<'a>>,
    layers: Vec<(String, Content)>,
    attributes: Vec<(String, String)>,
}

/// Film and channels of quantities besides light.
#[derive(Debug)]
struct Beside<'a> {
    film: &'a Film,
    channels: Vec<String>,
}

/// Second moments of quantities.
#[derive(Debug, Default)]
struct Squares {
    /// Names of the channels.
    names: Vec<String>,
    /// Channels in the film of quantities to which the moments belong.
    channels: Vec<usize>,
}

impl Squares {
    fn of(quantities: &[NamedQuantity]) -> Self {
        let mut squares = Squares::default();
        let mut first = 0;
        for quantity in quantities {
            let names = quantity.squares().enumerate();
            for (i, name) in names {
                squares.names.push(name);
                squares.channels.push(first + i);
            }
            first += quantity.channels.len();
        }
        squares
    }
}

/// Content of a layer.
#[derive(Debug)]
enum Content {
    /// Means, of a separate layer of light or of all light.
    Mean(Option<usize>),
    /// Variances of the means of a layer or of all light.
    Variance(Option<usize>),
    /// Flags: 1 where the variances of a layer or of all light are unreliable, otherwise 0.
    Few(Option<usize>),
    /// Number of samples.
    Samples,
    /// Mean squares of the samples of all light.
    SecondMoment,
    /// Means of quantities besides light.
    Quantities,
    /// Variances of the means of quantities.
    QuantityVariance,
    /// Mean squares of quantities.
    QuantityMoment,
    /// Values with channels interleaved.
    Stored(Vec<f32>),
}

impl<'a> Picture<'a> {
    /// Makes the picture of a render, with these layers:
    ///
    /// - the mean as the main layer, `variance` of the mean, `few` (1 where the variance is
    ///   unreliable) and `samples` (their number);
    /// - `reweighted`, if requested;
    /// - for photon maps, `bias` (the estimated bias of each pixel) and `bound` (a bound of the
    ///   error by bias and noise, which at most one of twenty pixels exceeds);
    /// - for each separate layer of light, layers such as `length.0012`, `variance.length.0012` and
    ///   `few.length.0012`;
    /// - quantities besides light with the names from the scene, such as `depth` and
    ///   `variance.depth`;
    /// - second moments, such as `m2_image`.
    pub fn new(
        rendering: &'a Rendering,
        loaded: &'a Loaded,
        attributes: Vec<(String, String)>,
    ) -> Self {
        let naming = Naming::of(loaded);
        let mut layers = layers(rendering, loaded.renderer.is_light());
        if let Some(naming) = &naming {
            layers.extend(naming.names().enumerate().flat_map(|(i, name)| {
                let variance = (format!("variance.{name}"), Content::Variance(Some(i)));
                let few = (format!("few.{name}"), Content::Few(Some(i)));
                let few = naming.is_of_one_sign(i).then_some(few);
                [(name, Content::Mean(Some(i))), variance]
                    .into_iter()
                    .chain(few)
            }));
        }
        let quantities = rendering.quantities.as_ref().map(|quantities| Beside {
            film: &quantities.film,
            channels: (loaded.quantity_names.iter())
                .flat_map(|quantity| quantity.channels.clone())
                .collect(),
        });
        if quantities.is_some() {
            layers.push((String::new(), Content::Quantities));
            layers.push(("variance".into(), Content::QuantityVariance));
        }
        if let Some(name) = &loaded.moment {
            layers.push((name.clone(), Content::SecondMoment));
        }
        layers.push((String::new(), Content::QuantityMoment));
        Picture {
            film: &rendering.film,
            channels: Cow::Borrowed(&loaded.channel_names),
            count: ["N".into()],
            quantities,
            squares: Squares::of(&loaded.quantity_names),
            naming,
            layers,
            attributes,
        }
    }

    /// Makes the picture of a scene that does not come from a file, without separate layers of
    /// light. The channel of a one-channel film is `Y`. The channels of a three-channel film are
    /// `R`, `G` and `B`. Channels of other films are numbered from 0.
    pub fn of_light(rendering: &'a Rendering) -> Self {
        let film = &rendering.film;
        let count = film.channels();
        Picture {
            film,
            channels: (0..count).map(|c| channel_name(c, count)).collect(),
            count: ["N".into()],
            quantities: None,
            squares: Squares::default(),
            naming: None,
            layers: layers(rendering, true),
            attributes: Vec::new(),
        }
    }

    /// Writes the picture in the format of the file's extension with
    /// [`write_exr`](Picture::write_exr), [`write_npy`](Picture::write_npy) or
    /// [`write_png`](Picture::write_png). [`Exposure::Auto`] sets the brightness of a PNG file.
    ///
    /// # Errors
    ///
    /// Returns the errors of these functions, and
    /// [`Problem::Unsupported`](crate::Problem::Unsupported) for other extensions.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        self.write_exposed(path, Exposure::Auto)
    }

    /// Writes the picture like [`write`](Picture::write); `exposure` sets the brightness of a
    /// `.png` file.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`write`](Picture::write).
    pub fn write_exposed(&self, path: &Path, exposure: Exposure) -> Result<(), FileError> {
        let extension = path.extension().and_then(|e| e.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => self.write_exr(path),
            Some("npy") => self.write_npy(path),
            Some("png") => self.write_png(path, self.tone(exposure, Curve::default())),
            _ => Err(unknown_format(path)),
        }
    }

    /// Returns some rows of the main layer, in memory.
    fn rows(&self, rows: Range<usize>) -> ImageLayers {
        let width = self.film.width();
        let pixels = rows.start * width..rows.end * width;
        let plane = |(c, name): (usize, &String)| {
            let values = pixels.clone().map(|i| self.film.mean_at(None, c, i));
            (name.clone(), values.collect())
        };
        ImageLayers {
            width,
            height: rows.len(),
            layers: vec![Layer {
                name: String::new(),
                channels: self.channels.iter().enumerate().map(plane).collect(),
            }],
            attributes: Vec::new(),
        }
    }

    /// Returns the tone mapping of the main layer for a screen.
    pub fn tone(&self, exposure: Exposure, curve: Curve) -> Tone {
        Tone {
            exposure: exposure.stops(self.on_screen()),
            curve,
        }
    }

    /// Writes the main layer as displayed on a screen to a PNG file, completely or not at all.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`png::write()`].
    pub fn write_png(&self, path: &Path, tone: Tone) -> Result<(), FileError> {
        let size = [self.film.width(), self.film.height()];
        png::write_pixels(path, size, self.on_screen(), tone)
    }

    /// Returns the colours of the main layer row by row. A single row is in memory at a time.
    fn on_screen(&self) -> impl Iterator<Item = [f32; 3]> {
        let row = |row| self.rows(row..row + 1).on_screen().unwrap_or_default();
        (0..self.film.height()).flat_map(move |y| row(y).pixels)
    }

    /// Writes all layers as an EXR file, completely or not at all.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`exr::write()`].
    pub fn write_exr(&self, path: &Path) -> Result<(), FileError> {
        let places = self.layers.iter().flat_map(|(name, content)| {
            let names = self.names(content).iter().enumerate();
            names.map(move |(i, channel)| (exr::channel_name(name, channel), (content, i)))
        });
        let (channels, places): (_, Vec<_>) = places.unzip();
        let frame = exr::ExrHeader {
            width: self.film.width(),
            height: self.film.height(),
            channels,
            attributes: self.attributes.clone(),
        };
        exr::write_values(path, &frame, |channel, pixel| {
            let (content, channel) = places[channel];
            self.value(content, channel, pixel)
        })
    }

    /// Writes the means as a float32 array, completely or not at all. Its axes are
    /// `[row, column, channel]`, or, if light is separated,
    /// `[row, column, length, bounce, light, channel]` without axes that are not requested. Light
    /// outside the bins is left out.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`npy::write()`].
    pub fn write_npy(&self, path: &Path) -> Result<(), FileError> {
        let (film, channels) = (self.film, self.channels.len());
        let mut shape = vec![film.height(), film.width()];
        shape.extend(self.naming.iter().flat_map(Naming::shape));
        shape.push(channels);
        let layers: Vec<Option<usize>> = match &self.naming {
            Some(naming) => naming.regular().map(Some).collect(),
            None => vec![None],
        };
        let pixel = |i| {
            let value = move |layer: &Option<usize>, c| film.mean_at(*layer, c, i);
            let layer = move |layer| (0..channels).map(move |c| value(layer, c));
            layers.iter().flat_map(layer)
        };
        let values = (0..film.width() * film.height()).flat_map(pixel);
        npy::write_values(path, &shape, values)
    }

    fn names(&self, content: &Content) -> &[String] {
        match content {
            Content::Samples => &self.count,
            Content::Quantities | Content::QuantityVariance => {
                let quantities = self.quantities.as_ref();
                quantities.map_or(&[], |quantities| &quantities.channels)
            }
            Content::QuantityMoment => &self.squares.names,
            _ => &self.channels,
        }
    }

    /// Returns the film of quantities. It is the only film if the picture shows quantities instead
    /// of light.
    fn of_quantities(&self) -> &Film {
        let quantities = self.quantities.as_ref();
        quantities.map_or(self.film, |quantities| quantities.film)
    }

    fn value(&self, content: &Content, channel: usize, pixel: usize) -> f32 {
        match content {
            Content::Mean(layer) => self.film.mean_at(*layer, channel, pixel),
            Content::Variance(layer) => self.film.variance_at(*layer, channel, pixel),
            Content::Few(layer) => f32::from(u8::from(self.film.few_at(*layer, channel, pixel))),
            Content::Samples => self.film.count(pixel) as f32,
            Content::SecondMoment => self.film.second_moment_at(channel, pixel),
            Content::Quantities => self.of_quantities().mean_at(None, channel, pixel),
            Content::QuantityVariance => self.of_quantities().variance_at(None, channel, pixel),
            Content::QuantityMoment => {
                let channel = self.squares.channels[channel];
                self.of_quantities().second_moment_at(channel, pixel)
            }
            Content::Stored(values) => values[pixel * self.channels.len() + channel],
        }
    }
}

/// Returns the layers of all light, or of other quantities.
fn layers(rendering: &Rendering, is_light: bool) -> Vec<(String, Content)> {
    let film = &rendering.film;
    let mut layers = vec![
        (String::new(), Content::Mean(None)),
        ("variance".into(), Content::Variance(None)),
    ];
    // Other quantities may have either sign; their effective numbers are meaningless.
    if is_light {
        layers.push(("few".into(), Content::Few(None)));
    }
    layers.push(("samples".into(), Content::Samples));
    let mut store = |name: &str, values| layers.push((name.into(), Content::Stored(values)));
    if let Some(values) = film.reweighted() {
        store("reweighted", values);
    }
    if let Some(debiased) = &rendering.debiased {
        store("bias", debiased.pixel_bias(film));
        store("bound", debiased.bound(film));
    }
    layers
}
