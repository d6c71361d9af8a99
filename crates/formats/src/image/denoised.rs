//! Denoised images: inputs of a denoiser, and layers for its output.
//!
//! Denoising replaces noise by an unknown bias, so that denoised images are not estimates. The
//! denoised values are in separate layers, never in the main layer, together with the change of
//! each value in units of its standard error.

use super::exposure::Exposure;
use super::{ImageLayers, Layer, RgbImage, variance_of};
use crate::error::Problem;

/// Attribute of denoised images, which names the denoiser.
pub const DENOISED: &str = "denoised";
/// Name of the layer with the denoised values.
pub const LAYER: &str = "denoised";
/// Name of the layer with (denoised − estimate) / standard error.
pub const DIFFERENCE: &str = "difference";
/// Layers that guide denoisers unless the user names others, in order of preference.
const ALBEDOS: [&str; 1] = ["albedo"];
const NORMALS: [&str; 2] = ["sh_normal", "geo_normal"];

/// Channels that are denoised together.
const COLOURS: [&str; 3] = ["R", "G", "B"];
/// Attributes that apply only to the estimate.
const OF_ESTIMATES: [&str; 1] = ["trust"];
/// Number of standard errors above which noise hardly explains a difference.
const MAX_DEVIATIONS: f64 = 3.0;

/// Selection of an image's layers for denoising.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DenoiseOptions {
    /// Layer to denoise; empty for the main layer.
    pub layer: String,
    /// Layer with the albedo of first surfaces.
    pub albedo: Option<String>,
    /// Layer with the normals of first surfaces.
    pub normal: Option<String>,
    /// Layer with standard errors of the denoised layer; the roots of its variances by default.
    pub errors: Option<String>,
    /// True if layers with usual names guide the denoiser where none is named.
    pub usual_guides: bool,
}

/// Name and values of a channel.
type Channel = (String, Vec<f32>);

/// A layer that guides a denoiser.
#[derive(Clone, Debug, PartialEq)]
pub struct DenoiseGuide {
    /// Name of the layer.
    pub name: String,
    /// Red, green and blue of the layer, or X, Y and Z.
    pub image: RgbImage,
}

/// Image during denoising, split into the inputs of a denoiser.
#[derive(Clone, Debug, PartialEq)]
pub struct Denoising {
    /// Albedo of first surfaces.
    pub albedo: Option<DenoiseGuide>,
    /// Normals of first surfaces, never without an albedo.
    pub normal: Option<DenoiseGuide>,
    /// Images to denoise, in sequence.
    pub parts: Vec<Noisy>,
    /// The layer to denoise and its variances.
    image: ImageLayers,
    /// Name of the layer to denoise.
    layer: String,
    /// Standard errors of all channels of the layer, in their order, if known.
    errors: Option<Vec<Channel>>,
}

/// Input image of a denoiser: colours around 1, and the data to restore the original scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Noisy {
    /// Names of the red, green and blue channels, or of a single channel that is all three.
    channels: Vec<String>,
    /// Values times `gain`.
    pub image: RgbImage,
    /// Gain, a power of two.
    gain: f32,
}

/// A denoised image.
#[derive(Clone, Debug, PartialEq)]
pub struct Denoised {
    /// Image with the layers [`LAYER`] and, if standard errors are known, [`DIFFERENCE`].
    pub image: ImageLayers,
    /// Statistics of the changed values, if standard errors are known.
    pub moved: Option<ChangedFractions>,
}

/// Statistics of the values that a denoiser changed, relative to their standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangedFractions {
    /// Fraction of the values with a standard error that changed by more than three standard
    /// errors. With normal noise, 0.0027 of the values of an estimate are this far from the truth.
    pub beyond_three: f64,
    /// Fraction of the values that changed but have no standard error, for instance if no sample
    /// found light.
    pub unknown: f64,
}

impl DenoiseOptions {
    /// Returns true if denoising uses the layer `name`.
    pub fn uses(&self, name: &str) -> bool {
        let named = [&self.albedo, &self.normal, &self.errors];
        name == self.layer
            || name == variance_of(&self.layer)
            || named.into_iter().flatten().any(|n| n == name)
            || self.usual_guides && ALBEDOS.iter().chain(&NORMALS).any(|n| *n == name)
    }
}

impl Denoising {
    /// Splits an image into the inputs of a denoiser: red, green and blue together, and every other
    /// channel separately.
    ///
    /// # Errors
    ///
    /// An image that is already denoised, or of quantities other than light; missing layers;
    /// normals without an albedo; and values that are not finite.
    pub fn new(image: ImageLayers, options: &DenoiseOptions) -> Result<Self, Problem> {
        if image.attribute(DENOISED).is_some() {
            let message = "the image is denoised already: denoise the estimate";
            return Err(Problem::Malformed(message.into()));
        }
        if image.attribute("integrator") == Some("aov") {
            let message = "the image has quantities of rays, not light: nest an integrator of light in the aov";
            return Err(Problem::Malformed(message.into()));
        }
        let guide = |named: &Option<String>, usual: &[&str]| match named {
            Some(name) => image.named_guide(name).map(Some),
            None if options.usual_guides => Ok(usual.iter().find_map(|name| image.guide(name))),
            None => Ok(None),
        };
        let albedo = guide(&options.albedo, &ALBEDOS)?;
        if albedo.is_none() && options.normal.is_some() {
            let message =
                "Open Image Denoise takes normals only beside an albedo: give an albedo, too";
            return Err(Problem::Malformed(message.into()));
        }
        let normal = guide(&options.normal, &NORMALS)?.filter(|_| albedo.is_some());
        let named = options.errors.as_deref();
        let errors = named.and_then(|name| image.layer(name)).cloned();
        let image = image.focused(&options.layer)?;
        let errors = match (errors, image.layer("variance")) {
            (Some(errors), _) => image.errors(&errors, |error| error),
            (None, Some(variances)) => image.errors(variances, f32::sqrt),
            (None, None) => None,
        };
        Ok(Denoising {
            albedo,
            normal,
            parts: image.noisy()?,
            image,
            layer: options.layer.clone(),
            errors,
        })
    }

    /// Describes the guides in a few words.
    pub fn guides(&self) -> String {
        let guides = [&self.albedo, &self.normal].into_iter().flatten();
        let names: Vec<&str> = guides.map(|guide| guide.name.as_str()).collect();
        match &names[..] {
            [] => "without guides".into(),
            names => format!("with {}", names.join(", ")),
        }
    }

    /// Makes a denoised image from a denoiser's outputs for all [parts](Denoising::parts), in their
    /// order. `by` names the denoiser.
    ///
    /// # Errors
    ///
    /// Outputs of another size, and values that are not finite.
    pub fn finish(self, answers: &[RgbImage], by: &str) -> Result<Denoised, Problem> {
        let of_layer = match &*self.layer {
            "" => String::new(),
            layer => format!("the layer {layer} "),
        };
        let by = format!("{of_layer}by {by} {}", self.guides());
        let ImageLayers { width, height, .. } = self.image;
        let mut channels = Vec::new();
        for (noisy, answer) in self.parts.iter().zip(answers) {
            answer.check_finite()?;
            if [answer.width, answer.height] != [width, height] {
                return Err(Problem::Mismatch {
                    expected: format!("{width} x {height} pixels"),
                    found: format!("{} x {}", answer.width, answer.height),
                });
            }
            channels.extend(noisy.planes(answer));
        }
        let estimate = self.image.layer("").into_iter();
        let estimate: Vec<_> = estimate.flat_map(|layer| &layer.channels).collect();
        channels.sort_by_key(|(name, _)| estimate.iter().position(|(other, _)| name == other));
        let mut counts = Counts::default();
        let differences = self.errors.as_ref().map(|errors| {
            let channels = channels.iter().zip(&estimate).zip(errors);
            let of = |((denoised, estimate), errors): ((&Channel, &&Channel), &Channel)| {
                let z = |i: usize| counts.take(denoised.1[i], estimate.1[i], errors.1[i]);
                (denoised.0.clone(), (0..denoised.1.len()).map(z).collect())
            };
            channels.map(of).collect()
        });
        let moved = differences.is_some().then(|| counts.moved());
        let layer = |name: &str, channels| Layer {
            name: name.into(),
            channels,
        };
        let mut layers = vec![layer(LAYER, channels)];
        layers.extend(differences.map(|channels| layer(DIFFERENCE, channels)));
        let attributes = self.image.attributes.into_iter();
        let mut attributes: Vec<_> = attributes
            .filter(|(name, _)| !OF_ESTIMATES.contains(&name.as_str()))
            .collect();
        attributes.push((DENOISED.into(), by));
        let image = ImageLayers {
            width,
            height,
            layers,
            attributes,
        };
        Ok(Denoised { image, moved })
    }
}

impl ImageLayers {
    /// Returns red, green and blue, or X, Y and Z, of a layer as a guide of a denoiser.
    fn guide(&self, name: &str) -> Option<DenoiseGuide> {
        let layer = self.layer(name)?;
        let of = |names: [&str; 3]| {
            let [a, b, c] = names.map(|name| layer.channel(name));
            Some([a?, b?, c?])
        };
        let planes = of(COLOURS).or_else(|| of(["X", "Y", "Z"]))?;
        Some(DenoiseGuide {
            name: name.to_owned(),
            image: self.joined(planes, 1.0),
        })
    }

    fn named_guide(&self, name: &str) -> Result<DenoiseGuide, Problem> {
        self.guide(name).ok_or_else(|| {
            Problem::Malformed(format!(
                "no layer '{name}' with the channels R, G, B or X, Y, Z: render it with an integrator aov (docs/images.md)"
            ))
        })
    }

    /// Returns standard errors of all channels of the main layer, in their order. `error` converts
    /// the values of another layer.
    fn errors(&self, layer: &Layer, error: impl Fn(f32) -> f32) -> Option<Vec<Channel>> {
        let channels = self.layer("")?.channels.iter().map(|(name, _)| {
            let values = layer.channel(name)?.iter();
            Some((name.clone(), values.map(|v| error(*v)).collect()))
        });
        channels.collect()
    }

    /// Splits the main layer into inputs of a denoiser.
    fn noisy(&self) -> Result<Vec<Noisy>, Problem> {
        let main = self.layer("");
        let mut others: Vec<&Channel> = main.iter().flat_map(|main| &main.channels).collect();
        for (name, values) in &others {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let [x, y] = [i % self.width, i / self.width];
                return Err(Problem::NotFinite {
                    place: format!("pixel ({x}, {y}) of channel {name}"),
                    value: values[i].into(),
                });
            }
        }
        let mut parts = Vec::new();
        if let Some(planes) = main.and_then(Layer::colours) {
            parts.push((COLOURS.map(str::to_owned).to_vec(), planes));
            others.retain(|(name, _)| !COLOURS.contains(&name.as_str()));
        }
        for (name, values) in others {
            parts.push((vec![name.clone()], [values; 3]));
        }
        let noisy = |(channels, planes): (_, [&[f32]; 3])| {
            // Scale the values: denoisers treat very small radiances as black.
            let stops = Exposure::of(self.joined(planes, 1.0).pixels.into_iter());
            let gain = stops.round().clamp(-126.0, 126.0).exp2() as f32;
            Noisy {
                channels,
                image: self.joined(planes, gain),
                gain,
            }
        };
        Ok(parts.into_iter().map(noisy).collect())
    }

    fn joined(&self, planes: [&[f32]; 3], gain: f32) -> RgbImage {
        let pixel = |i: usize| planes.map(|plane| plane[i] * gain);
        RgbImage {
            width: self.width,
            height: self.height,
            pixels: (0..self.width * self.height).map(pixel).collect(),
        }
    }
}

impl Noisy {
    /// Returns the channels of a denoiser's output.
    fn planes(&self, answer: &RgbImage) -> Vec<(String, Vec<f32>)> {
        let plane = |of: &dyn Fn(&[f32; 3]) -> f32| {
            let values = answer.pixels.iter().map(|pixel| of(pixel) / self.gain);
            values.collect()
        };
        match &self.channels[..] {
            [grey] => vec![(grey.clone(), plane(&|[r, g, b]| (r + g + b) / 3.0))],
            channels => {
                let channels = channels.iter().enumerate();
                channels
                    .map(|(c, name)| (name.clone(), plane(&|pixel| pixel[c])))
                    .collect()
            }
        }
    }
}

/// Numbers of values.
#[derive(Debug, Default)]
struct Counts {
    all: usize,
    known: usize,
    far: usize,
}

impl Counts {
    /// Counts a value. Returns the difference from its estimate divided by the standard error; NaN
    /// if the value changed but has no standard error.
    fn take(&mut self, denoised: f32, estimate: f32, error: f32) -> f32 {
        let difference = f64::from(denoised) - f64::from(estimate);
        let error = f64::from(error);
        self.all += 1;
        let z = if difference == 0.0 {
            0.0
        } else if error > 0.0 && error.is_finite() {
            difference / error
        } else {
            return f32::NAN;
        };
        self.known += 1;
        self.far += usize::from(z.abs() > MAX_DEVIATIONS);
        z as f32
    }

    fn moved(&self) -> ChangedFractions {
        ChangedFractions {
            beyond_three: self.far as f64 / self.known.max(1) as f64,
            unknown: (self.all - self.known) as f64 / self.all.max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(channels: &[(&str, [f32; 4])], variance: Option<f32>) -> ImageLayers {
        let of = |name: &str, values: &dyn Fn(usize, usize) -> f32| Layer {
            name: name.into(),
            channels: (channels.iter().enumerate())
                .map(|(c, (n, _))| ((*n).into(), (0..4).map(|i| values(c, i)).collect()))
                .collect(),
        };
        let mut layers = vec![of("", &|c, i| channels[c].1[i])];
        layers.extend(variance.map(|v| of("variance", &|_, i| if i == 3 { 0.0 } else { v })));
        ImageLayers {
            width: 2,
            height: 2,
            layers,
            attributes: vec![("seed".into(), "7".into()), ("trust".into(), "{}".into())],
        }
    }

    /// Denoises with a denoiser that adds `shift` to its input.
    fn shifted(image: &ImageLayers, shift: f32) -> Denoised {
        let answer = |noisy: &Noisy| {
            let mut shown = noisy.image.clone();
            let by = shift * noisy.gain;
            shown.pixels.iter_mut().flatten().for_each(|v| *v += by);
            shown
        };
        let denoising = Denoising::new(image.clone(), &DenoiseOptions::default()).unwrap();
        let answers: Vec<_> = denoising.parts.iter().map(answer).collect();
        denoising.finish(&answers, "a test").unwrap()
    }

    /// Checks that a shift of 1, at standard errors of 0.25, gives differences of 4, except where
    /// no error is known.
    #[test]
    fn differences_are_in_standard_errors() {
        let noisy = image(
            &[("G", [1.0; 4]), ("B", [4.0; 4]), ("R", [2.0; 4])],
            Some(0.0625),
        );
        let found = shifted(&noisy, 1.0);
        let [values, difference] = [LAYER, DIFFERENCE].map(|name| found.image.layer(name).unwrap());
        for (name, value) in [("R", 3.0), ("G", 2.0), ("B", 5.0)] {
            assert_eq!(values.channel(name), Some(&[value; 4][..]), "{name}");
            let z = difference.channel(name).unwrap();
            assert_eq!(z[..3], [4.0; 3]);
            assert!(z[3].is_nan());
        }
        let moved = found.moved.unwrap();
        assert_eq!((moved.beyond_three, moved.unknown), (1.0, 0.25));
        let still = shifted(&noisy, 0.0).moved.unwrap();
        assert_eq!((still.beyond_three, still.unknown), (0.0, 0.0));
        assert_eq!(shifted(&noisy, 0.5).moved.unwrap().beyond_three, 0.0);
    }

    #[test]
    fn a_denoised_image_is_no_estimate() {
        let found = shifted(&image(&[("Y", [1e-9; 4])], None), 1e-9);
        assert!(found.image.layer("").is_none() && found.image.layer(DIFFERENCE).is_none());
        assert_eq!(found.moved, None);
        assert_eq!(
            found.image.attribute(DENOISED),
            Some("by a test without guides")
        );
        assert_eq!(found.image.attribute("seed"), Some("7"));
        assert_eq!(found.image.attribute("trust"), None);
        let values = found.image.layer(LAYER).unwrap().channel("Y").unwrap();
        assert!((values[0] / 2e-9 - 1.0).abs() < 1e-6, "{values:?}");
    }

    /// Checks that denoisers receive values around 1: watts per wavelength may be 1e-20, which a
    /// denoiser would treat as black.
    #[test]
    fn denoisers_see_values_around_one() {
        let noisy = image(&[("550nm", [1e-20; 4]), ("600nm", [3e7; 4])], None);
        for part in noisy.noisy().unwrap() {
            let value = part.image.pixels[0][1];
            assert!((0.3..1.5).contains(&value), "{}: {value}", part.channels[0]);
        }
        let mut broken = noisy;
        broken.layers[0].channels[1].1[2] = f32::NAN;
        let message = broken.noisy().unwrap_err().to_string();
        assert!(
            message.contains("pixel (0, 1) of channel 600nm"),
            "{message}"
        );
    }
}
