//! What a render found as a picture of several layers.

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

/// A render as a picture. Its values are computed as they are asked for: a film is large, and files are written
/// without holding it twice.
#[derive(Debug)]
pub struct Picture<'a> {
    film: &'a Film,
    channels: Cow<'a, [String]>,
    /// The only channel of numbers of samples.
    count: [String; 1],
    /// Quantities besides light.
    quantities: Option<Beside<'a>>,
    /// Second moments of quantities, besides light or in its place: their names, and the channels that they are of.
    squares: Squares,
    /// If light is told apart.
    naming: Option<Naming<'a>>,
    layers: Vec<(String, Content)>,
    attributes: Vec<(String, String)>,
}

/// Quantities besides light.
#[derive(Debug)]
struct Beside<'a> {
    film: &'a Film,
    channels: Vec<String>,
}

/// Second moments of quantities.
#[derive(Debug, Default)]
struct Squares {
    /// Names of their channels.
    names: Vec<String>,
    /// The channels of the film of quantities that they are of.
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

/// What a layer shows.
#[derive(Debug)]
enum Content {
    /// Means, of a layer of light told apart or of all light.
    Mean(Option<usize>),
    /// Variances of these.
    Variance(Option<usize>),
    /// Where these are not to be trusted: 1, else 0.
    Few(Option<usize>),
    /// Number of samples.
    Samples,
    /// Means of the squares of all light's samples.
    SecondMoment,
    /// Means of quantities besides light.
    Quantities,
    /// Variances of these.
    QuantityVariance,
    /// Means of the squares of quantities.
    QuantityMoment,
    /// Values with channels interleaved.
    Stored(Vec<f32>),
}

impl<'a> Picture<'a> {
    /// With the mean as main layer, and layers `variance` (of the mean), `few` (1 where that is not to be trusted), `samples`
    /// (their number), `reweighted` if it was asked for, and of photon maps `bias` (what is known of that of every pixel) and `bound` (which the error
    /// by bias and noise exceeds in one of twenty pixels at most); then every layer of light told apart with
    /// its own, such as `length.0012`, `variance.length.0012` and `few.length.0012`; quantities besides light by the names of the
    /// scene, such as `depth` and `variance.depth`; and second moments, such as `m2_image`.
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

    /// The light of a scene that came from no file, without the layers of light told apart: the channel of a film of one is `Y`,
    /// those of a film of three are `R`, `G` and `B`, and others have numbers from 0.
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

    /// Writes the picture in the format that the name of the file tells: as [`write_exr`](Picture::write_exr),
    /// [`write_npy`](Picture::write_npy) or [`write_png`](Picture::write_png), as bright as [`Exposure::Auto`] makes it.
    ///
    /// # Errors
    ///
    /// As these, and [`Problem::Unsupported`](crate::Problem::Unsupported) for other names.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        self.write_exposed(path, Exposure::Auto)
    }

    /// As [`write`](Picture::write), where `exposure` says how bright a `.png` file is.
    ///
    /// # Errors
    ///
    /// As for [`write`](Picture::write).
    pub fn write_exposed(&self, path: &Path, exposure: Exposure) -> Result<(), FileError> {
        let extension = path.extension().and_then(|e| e.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => self.write_exr(path),
            Some("npy") => self.write_npy(path),
            Some("png") => self.write_png(path, self.tone(exposure, Curve::default())),
            _ => Err(unknown_format(path)),
        }
    }

    /// Some rows of the main layer, in memory.
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

    /// How bright the main layer is shown on a screen.
    pub fn tone(&self, exposure: Exposure, curve: Curve) -> Tone {
        Tone {
            exposure: exposure.stops(self.on_screen()),
            curve,
        }
    }

    /// Writes what a screen shows of the main layer as a PNG file, at once or not at all.
    ///
    /// # Errors
    ///
    /// As [`png::write()`].
    pub fn write_png(&self, path: &Path, tone: Tone) -> Result<(), FileError> {
        let size = [self.film.width(), self.film.height()];
        png::write_pixels(path, size, self.on_screen(), tone)
    }

    /// The colours of the main layer, row by row, of which one is in memory at a time.
    fn on_screen(&self) -> impl Iterator<Item = [f32; 3]> {
        let row = |row| self.rows(row..row + 1).on_screen().unwrap_or_default();
        (0..self.film.height()).flat_map(move |y| row(y).pixels)
    }

    /// Writes all layers as an EXR file, at once or not at all.
    ///
    /// # Errors
    ///
    /// As [`exr::write()`].
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

    /// Writes the means as a float32 array, at once or not at all: `[row, column, channel]`, or where light is told apart
    /// `[row, column, length, bounce, light, channel]` without the axes that are not asked for and without
    /// light that is outside of the bins.
    ///
    /// # Errors
    ///
    /// As [`npy::write()`].
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

    /// The film of quantities: the only one, if they are what the picture shows.
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

/// The layers of all light, or of other quantities.
fn layers(rendering: &Rendering, is_light: bool) -> Vec<(String, Content)> {
    let film = &rendering.film;
    let mut layers = vec![
        (String::new(), Content::Mean(None)),
        ("variance".into(), Content::Variance(None)),
    ];
    // Quantities of other kinds may be of either sign, of which effective numbers tell nothing.
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
